//! Responses to sentences.

use clock::Instant;
use invariant::require;
use message::EventKind;
use motion::{Face, Skill};
use tasks::{Sentence, Task, key};

use super::utterance_queue::PendingSentence;
use super::{Learner, Output, decline, say};
use crate::performance::Performance;
use crate::question::Question;
use crate::{Body, answers};

impl<B: Body> Learner<B> {
    /// Processes every "stop" at once, without waiting for object identities. Requests to perform that were made
    /// before it are cancelled; other earlier sentences are still answered in order.
    pub(super) fn process_stops(&mut self, now: Instant, present_rad: &[Option<f64>], output: &mut Output) {
        let is_stop = |waiting: &PendingSentence| Sentence::of(&waiting.text) == Sentence::Stop;
        while let Some(index) = self.pending_sentences.iter().position(is_stop) {
            self.pending_sentences.remove(index);
            self.stop(now, present_rad, output);
            let later = self.pending_sentences.split_off(index);
            for waiting in std::mem::take(&mut self.pending_sentences) {
                if let Sentence::Do(name) = Sentence::of(&waiting.text) {
                    self.cancel_request(&name, output);
                } else {
                    self.pending_sentences.push_back(waiting);
                }
            }
            self.pending_sentences.extend(later);
        }
    }

    /// Declines a request to perform; its task becomes the current one nevertheless.
    fn cancel_request(&mut self, name: &str, output: &mut Output) {
        decline(output, name, &format!("I do not begin {name}: you said stop"));
        let known = Some(key(name)).filter(|key| self.tasks.contains_key(key));
        self.current_task = known.or_else(|| self.current_task.take());
    }

    pub(super) fn answer(
        &mut self,
        now: Instant,
        said: &PendingSentence,
        present_rad: &[Option<f64>],
        output: &mut Output,
    ) {
        let PendingSentence { speaker, ref text, .. } = *said;
        let sentence = Sentence::of(text);
        // A counter-question keeps Leo's question open. Any other sentence either answers the question or drops it.
        let asks_back = matches!(sentence, Sentence::Why | Sentence::WhatDidYouLearn | Sentence::WhatDoISee);
        let question = self.question.take_if(|_| !asks_back);
        if let (Sentence::Yes | Sentence::No, Some(question)) = (&sentence, question) {
            self.add_answer_as_example(&question, speaker, sentence == Sentence::Yes, output);
            return;
        }
        match sentence {
            Sentence::Teach(name) => self.begin_teaching(now, said, &name, present_rad, output),
            Sentence::Done(names) => self.end_teaching(now, said.timing, &names, output),
            Sentence::Do(name) => self.begin_performance(&name, output),
            // `process_stops` has already processed it.
            Sentence::Stop => {}
            Sentence::NotThatOne => self.skip(now, present_rad, output),
            Sentence::Yes => match self.current_task() {
                Some(task) => {
                    say(output, &task.name.clone(), "good, I will do it like that");
                    self.show(now, Face::Pleased, present_rad);
                }
                None => say(output, "", "I did not ask anything"),
            },
            Sentence::No => match self.current_task() {
                Some(Task { name, .. }) => {
                    let text =
                        format!("what is wrong? Say \"like this\", show me, and say \"{name} is done\"");
                    say(output, name, &text);
                }
                None => say(output, "", "I did not do anything"),
            },
            Sentence::LikeThis => match self.current_task().map(|task| task.name.clone()) {
                Some(name) => {
                    if self.performance.is_some() {
                        self.stop(now, present_rad, output);
                    }
                    self.begin_teaching(now, said, &name, present_rad, output);
                }
                None => {
                    say(output, "", "like what? Say \"Leo, I can teach you to do\" and what it is called");
                }
            },
            Sentence::WhatDidYouLearn => {
                let settings = &self.settings.learning;
                let known = answers::learned(
                    &self.vocabulary.language,
                    self.tasks.values(),
                    &self.perspectives,
                    settings,
                );
                known.iter().for_each(|(task, text)| say(output, task, text));
            }
            Sentence::Why => {
                let settings = &self.settings.learning;
                let (task, text) = match self.current_task() {
                    Some(task) => {
                        let language = &self.vocabulary.language;
                        (task.name.as_str(), answers::why(language, task, &self.perspectives, settings))
                    }
                    None => ("", "I have learned nothing and done nothing yet".to_owned()),
                };
                say(output, task, &text);
                self.ask_again(output);
            }
            Sentence::WhatDoISee => {
                let language = &self.vocabulary.language;
                let views = self.views.snapshots(now, language, &self.perspectives);
                say(output, "", &answers::seen_by(language, &views, speaker));
            }
            Sentence::Unknown => {
                say(output, "", &format!("I did not understand \"{text}\""));
                say(output, "", &Sentence::help());
                self.show(now, Face::Puzzled, present_rad);
            }
        }
    }

    /// Holds the body still and ends the performance.
    pub(super) fn stop(&mut self, now: Instant, present_rad: &[Option<f64>], output: &mut Output) {
        self.has_started_body = true;
        self.question = None;
        self.body.begin(now, Skill::Hold, present_rad);
        match self.performance.take() {
            Some(performance) => {
                output.events.push(performance.stopped());
                say(output, &performance.task, "I stopped");
                self.note_performed(&performance.task);
            }
            None => say(output, "", "I hold still"),
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

    fn current_task(&self) -> Option<&Task> {
        self.tasks.get(self.current_task.as_ref()?)
    }

    /// Adds the answer to Leo's question as an example.
    fn add_answer_as_example(&mut self, question: &Question, speaker: u16, yes: bool, output: &mut Output) {
        let task = self.tasks.get_mut(&question.task);
        if let Some(task) = require!(task, "a question is about a task, and `{}` is one", question.task) {
            // The answer is attributed to the last teacher, whoever gave it, so the chosen perspective does not change.
            let teacher = task.examples.last().map_or(speaker, |example| example.teacher);
            task.examples.push(question.to_example(yes, teacher, &self.perspectives));
            self.report_learned(&question.task, EventKind::Answered, if yes { "yes" } else { "no" }, output);
        }
    }
}
