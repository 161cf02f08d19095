//! Responses to sentences.

use clock::Instant;
use invariant::require;
use language::{Act, ActKind, Context, Reading};
use message::EventKind;
use motion::{Face, Skill};
use tasks::{Task, key};

use super::proposal::Proposal;
use super::saying::{decline, say};
use super::utterance_queue::PendingSentence;
use super::{Learner, Output};
use crate::performance::Performance;
use crate::question::Question;
use crate::{Body, answers};

impl<B: Body> Learner<B> {
    /// Processes every stop at once, without waiting for object identities. Requests to perform that were made
    /// before it are cancelled; other earlier sentences are still answered in order.
    pub(super) fn process_stops(&mut self, now: Instant, present_rad: &[Option<f64>], output: &mut Output) {
        while let Some(index) = self.pending_sentences.iter().position(|waiting| !waiting.is_checked) {
            let mut later = self.pending_sentences.split_off(index);
            let Some(mut sentence) = later.pop_front() else { return };
            sentence.is_checked = true;
            // A requested performance counts as one: the sentence may be about it.
            let requests = self.pending_sentences.iter().any(|earlier| self.request(earlier).is_some());
            let context = Context { is_moving: requests || self.performance.is_some(), ..self.context() };
            if self.grammar.is_stop(&sentence.text, &context) {
                self.stop(now, present_rad, output);
                let meant = self.grammar.understand(&sentence.text, &self.context());
                if matches!(meant, Reading::Understood(act) if act.kind.is_telling()) {
                    say(output, "", "if that was about the rule, please say it again now");
                }
                for waiting in std::mem::take(&mut self.pending_sentences) {
                    match self.request(&waiting) {
                        Some(name) => self.cancel_request(&name, output),
                        None => self.pending_sentences.push_back(waiting),
                    }
                }
            } else {
                self.pending_sentences.push_back(sentence);
            }
            self.pending_sentences.extend(later);
        }
    }

    /// The name of the task that a sentence would start; `None` if it starts no movement.
    fn request(&self, sentence: &PendingSentence) -> Option<String> {
        let Reading::Understood(act) = self.grammar.understand(&sentence.text, &self.context()) else {
            return None;
        };
        let proposed = self.proposal.as_ref().is_some_and(Proposal::is_movement);
        let is_request = act.kind.is_movement() || act.kind == ActKind::Confirm && proposed;
        let current = || self.current_task().map(|task| task.name.clone()).unwrap_or_default();
        is_request.then(|| act.task.unwrap_or_else(current))
    }

    /// Declines a request to perform; its task becomes the current one nevertheless.
    fn cancel_request(&mut self, name: &str, output: &mut Output) {
        decline(output, name, &format!("I do not begin {name}: you said stop"));
        let known = Some(key(name)).filter(|key| self.tasks.contains_key(key));
        self.current_task = known.or_else(|| self.current_task.take());
    }

    /// What the dialogue knows.
    fn context(&self) -> Context {
        let features = self.vocabulary.language.features.iter().flat_map(|feature| feature.values.clone());
        Context {
            tasks: self.tasks.values().map(|task| task.name.clone()).collect(),
            current: self.current_task().map(|task| task.name.clone()),
            showing: self.teaching.as_ref().map(|teaching| teaching.recording.task.clone()),
            is_moving: self.performance.is_some(),
            features: features.collect(),
            feature_names: self.vocabulary.language.features.iter().map(|words| words.name.clone()).collect(),
        }
    }

    pub(super) fn answer(
        &mut self,
        now: Instant,
        said: &PendingSentence,
        present_rad: &[Option<f64>],
        output: &mut Output,
    ) {
        let proposal = self.proposal.take();
        match (self.grammar.understand(&said.text, &self.context()), proposal) {
            // A question about a contradiction stays open while the teacher asks something, and is repeated where the
            // answer is not understood.
            (Reading::Guessed { .. }, Some(Proposal::GoByWords { task, .. })) => {
                say(output, "", "please answer with yes or no");
                self.ask_about_contradiction(&task, output);
            }
            (Reading::Understood(act), Some(proposal)) if self.repeats(&act, &proposal) => {
                self.accept(now, said, proposal, present_rad, output);
            }
            (Reading::Understood(act), Some(proposal @ Proposal::GoByWords { .. }))
                if act.kind.is_question() =>
            {
                self.do_act(now, said, &act, present_rad, output);
                self.proposal = self.proposal.take().or(Some(proposal));
            }
            (Reading::Understood(act), Some(Proposal::Which(kind))) if act.kind == ActKind::TellOnly => {
                self.do_act(now, said, &Act { kind, ..act }, present_rad, output);
            }
            (Reading::Guessed { act, sentence }, _) => {
                self.ask_back(now, &said.text, act, &sentence, present_rad, output);
            }
            (Reading::Understood(act), Some(proposal)) if act.kind == ActKind::Confirm => {
                self.accept(now, said, proposal, present_rad, output);
            }
            (Reading::Understood(act), Some(Proposal::GoByWords { task, example }))
                if act.kind == ActKind::Deny =>
            {
                self.settle_contradiction(&task, example, false, output);
            }
            (Reading::Understood(act), Some(_)) if act.kind == ActKind::Deny => {
                say(output, act.task.as_deref().unwrap_or_default(), "all right, I leave it");
            }
            (Reading::Understood(act), _) => self.do_act(now, said, &act, present_rad, output),
        }
    }

    /// Does what a sentence asks for.
    pub(super) fn do_act(
        &mut self,
        now: Instant,
        said: &PendingSentence,
        act: &Act,
        present_rad: &[Option<f64>],
        output: &mut Output,
    ) {
        // A counter-question keeps Leo's question open. Any other sentence either answers the question or drops it.
        let question = self.question.take_if(|_| !act.kind.is_question());
        if let (ActKind::Confirm | ActKind::Deny, Some(question)) = (act.kind, question) {
            self.add_answer_as_example(&question, said.speaker, act.kind == ActKind::Confirm, output);
            return;
        }
        let task = act.task.as_deref();
        match act.kind {
            ActKind::Stop => self.stop(now, present_rad, output),
            ActKind::KeepOn => self.keep_on(output),
            ActKind::GoOn => self.go_on(output),
            ActKind::Do | ActKind::Again => match task {
                Some(name) => self.begin_performance(name, output),
                None => drop(self.known_task(None, output)),
            },
            ActKind::Can => self.propose_to_do(task, output),
            ActKind::NotThatOne => self.skip(now, present_rad, output),
            ActKind::Teach => self.teach(now, said, task, present_rad, output),
            ActKind::LikeThis => self.show_again(now, said, present_rad, output),
            ActKind::Name | ActKind::Rename => {
                self.rename(task, act.name.as_deref().unwrap_or_default(), output);
            }
            ActKind::End => self.end_teaching(now, said.timing, task, output),
            ActKind::Cancel => self.cancel(output),
            ActKind::Undo => self.propose_to_undo(output),
            ActKind::Forget => self.propose_to_forget(task, output),
            ActKind::Confirm => match self.current_task() {
                Some(task) => {
                    say(output, &task.name.clone(), "good, I will do it like that");
                    self.show(now, Face::Pleased, present_rad);
                }
                None => say(output, "", "I did not ask anything"),
            },
            ActKind::Deny => match self.current_task() {
                Some(Task { name, .. }) => {
                    let text =
                        format!("what is wrong? Say \"like this\", show me, and say \"{name} is done\"");
                    say(output, name, &text);
                }
                None => say(output, "", "I did not do anything"),
            },
            ActKind::TellOnly | ActKind::TellAlso | ActKind::TellNot | ActKind::TellAllBut => {
                self.tell_rule(now, said, act, output);
            }
            ActKind::TellAll | ActKind::TellIrrelevant | ActKind::TellCount | ActKind::Tell => {
                self.tell_rule(now, said, act, output);
            }
            ActKind::Why => self.explain_why(task, output),
            ActKind::Learned => self.tell_learned(task, output),
            ActKind::HowSure => self.tell_certainty(task, output),
            ActKind::WhatSettles => self.tell_what_settles(task, output),
            ActKind::WhatNext => self.next_step(output),
            ActKind::ListTasks => say(output, "", &format!("I know {}", self.known_names())),
            ActKind::SeeLeo | ActKind::KnowLeo => self.tell_own_view(now, &act.objects.concat(), output),
            ActKind::SeeMe | ActKind::KnowMe => {
                self.tell_their_view(now, said.speaker, &act.objects.concat(), output);
            }
            ActKind::Help => self.help(output),
            ActKind::Greet => {
                say(output, "", &self.grammar.replies().hello.clone());
                self.help(output);
            }
            ActKind::Farewell => say(output, "", &self.grammar.replies().goodbye.clone()),
            ActKind::Thank => say(output, "", &self.grammar.replies().welcome.clone()),
            ActKind::Praise => {
                say(output, "", &self.grammar.replies().praised.clone());
                self.show(now, Face::Pleased, present_rad);
            }
        }
    }

    /// Begins a demonstration; one without a name gets a provisional one.
    fn teach(
        &mut self,
        now: Instant,
        said: &PendingSentence,
        name: Option<&str>,
        present_rad: &[Option<f64>],
        output: &mut Output,
    ) {
        match (name, &self.teaching) {
            (Some(name), _) => self.begin_teaching(now, said, name, present_rad, output),
            (None, Some(teaching)) => {
                let name = &teaching.recording.task;
                say(output, name, &format!("I am watching {name} already; say \"I'm done\" at the end"));
            }
            (None, None) => {
                let name = self.fresh_name();
                self.begin_teaching(now, said, &name, present_rad, output);
                if self.teaching.is_some() {
                    say(output, &name, "you can also give it a name: say \"This is called\" and the name");
                }
            }
        }
    }

    /// Begins another demonstration of the current task.
    fn show_again(
        &mut self,
        now: Instant,
        said: &PendingSentence,
        present_rad: &[Option<f64>],
        output: &mut Output,
    ) {
        match self.current_task().map(|task| task.name.clone()) {
            Some(name) => {
                if self.performance.is_some() {
                    self.stop(now, present_rad, output);
                }
                self.begin_teaching(now, said, &name, present_rad, output);
            }
            None => {
                say(output, "", "like what? Say \"Leo, I can teach you to do\" and what it is called");
            }
        }
    }

    /// Says why a task has the rule that it has.
    fn explain_why(&mut self, name: Option<&str>, output: &mut Output) {
        let settings = &self.settings.learning;
        let task = match name {
            Some(_) => match self.known_task(name, output) {
                Some(task) => Some(task),
                None => return,
            },
            None => self.current_task(),
        };
        let (task, text) = match task {
            Some(task) => {
                let language = &self.vocabulary.language;
                (task.name.as_str(), answers::why(language, task, &self.perspectives, settings))
            }
            None => ("", "I have learned nothing and done nothing yet".to_owned()),
        };
        say(output, task, &text);
        self.ask_again(output);
    }

    /// Holds the body still and ends the performance.
    pub(super) fn stop(&mut self, now: Instant, present_rad: &[Option<f64>], output: &mut Output) {
        self.has_started_body = true;
        self.holds_still = true;
        self.subject = None;
        self.question = None;
        self.proposal = None;
        self.body.begin(now, Skill::Hold, present_rad);
        match self.performance.take() {
            Some(performance) => {
                output.events.push(performance.stopped());
                say(output, &performance.task, "I stopped");
                self.note_performed(&performance.task);
                self.stopped = Some(key(&performance.task));
            }
            None => say(output, "", "I hold still"),
        }
    }

    /// "Don't stop": the performance continues anyway. It starts none.
    fn keep_on(&mut self, output: &mut Output) {
        match (&self.performance, self.stopped_task()) {
            (Some(performance), _) => {
                say(output, &performance.task, &format!("I go on with {}", performance.task));
            }
            (None, Some(name)) => {
                say(output, &name, &format!("I hold still. Should I go on with {name}?"));
                self.proposal = Some(Proposal::Act(Act::new(ActKind::GoOn)));
            }
            (None, None) => say(output, "", "I am not doing anything"),
        }
    }

    /// Continues what was stopped.
    fn go_on(&mut self, output: &mut Output) {
        match (&self.performance, &self.teaching, self.stopped_task()) {
            (Some(performance), ..) => {
                say(output, &performance.task, &format!("I go on with {}", performance.task));
            }
            (None, Some(teaching), _) => {
                let name = &teaching.recording.task;
                say(output, name, &format!("I am watching {name}; say \"I'm done\" at the end"));
            }
            (None, None, Some(name)) => self.begin_performance(&name, output),
            (None, None, None) => say(output, "", "there is nothing to go on with"),
        }
    }

    /// The name of the task whose performance was stopped.
    fn stopped_task(&self) -> Option<String> {
        self.tasks.get(self.stopped.as_ref()?).map(|task| task.name.clone())
    }

    /// Drops the demonstration in progress.
    fn cancel(&mut self, output: &mut Output) {
        match self.teaching.take() {
            Some(teaching) => {
                let name = &teaching.recording.task;
                let told = teaching.and_what_was_said();
                say(output, name, &format!("this showing of {name} does not count{told}"));
            }
            None => say(output, "", "all right, there is nothing to cancel"),
        }
    }

    /// Skips the current object and continues the performance.
    fn skip(&mut self, now: Instant, present_rad: &[Option<f64>], output: &mut Output) {
        let skipped = self.performance.as_mut().and_then(Performance::skip);
        match skipped {
            Some((name, event)) => {
                let task = event.task;
                output.events.push(event);
                self.body.begin(now, Skill::Rest, present_rad);
                say(output, task.as_str(), &format!("I leave the {name} alone"));
            }
            None => say(output, "", "I am not working on anything"),
        }
    }

    pub(super) fn current_task(&self) -> Option<&Task> {
        self.tasks.get(self.current_task.as_ref()?)
    }

    /// Adds the answer to Leo's question as an example.
    fn add_answer_as_example(&mut self, question: &Question, speaker: u16, yes: bool, output: &mut Output) {
        let task = self.tasks.get(&question.task);
        if let Some(task) = require!(task, "a question is about a task, and `{}` is one", question.task) {
            // The answer is attributed to the last teacher, whoever gave it, so the chosen perspective does not change.
            let teacher = task.examples.last().map_or(speaker, |example| example.teacher);
            let example = question.to_example(yes, teacher, &self.perspectives);
            self.add_example(&question.task, example, output);
            self.report_learned(&question.task, EventKind::Answered, if yes { "yes" } else { "no" }, output);
        }
    }
}
