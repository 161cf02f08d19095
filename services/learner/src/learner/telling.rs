//! Sentences about a rule: what is said becomes an example beside what is shown.

use std::collections::BTreeSet;

use clock::Instant;
use invariant::require;
use language::Act;
use message::EventKind;
use tasks::{
    Contradiction, Effect, Example, HypothesisLanguage, KnownBy, Language, Object, Statement, Task, Telling,
    changes, contradictions_of, describe_object, key, listed,
};

use super::proposal::Proposal;
use super::saying::say;
use super::utterance_queue::{PendingSentence, Timing};
use super::{Learner, NO_BELIEFS_THEN, Output, StoreChange};
use crate::Body;
use crate::question::Question;
use crate::statement::{Hearing, UnclearError};

impl<B: Body> Learner<B> {
    /// Learns from a sentence about a rule: that of the task that is being shown, or of the current one.
    pub(super) fn tell_rule(&mut self, now: Instant, said: &PendingSentence, act: &Act, output: &mut Output) {
        // Where a thing was then is not known; its kind does not change.
        if said.timing == Timing::TooLate && act.scope.is_some() {
            say(output, "", &format!("{NO_BELIEFS_THEN}: please say it again"));
            return;
        }
        let showing = self.teaching.as_ref().map(|teaching| teaching.recording.task.clone());
        let current = || self.current_task().map(|task| task.name.clone());
        let Some(name) = showing.or_else(current) else {
            let known = self.known_names();
            say(
                output,
                "",
                &format!("which task is that about? I know {known}. Say \"Let me show you\" first"),
            );
            return;
        };
        let snapshots = self.views.snapshots(now, &self.vocabulary.language, &self.perspectives);
        let language = &self.vocabulary.language;
        let task = self.tasks.get(&key(&name));
        let states = task.map(|task| goal_states(language, task)).unwrap_or_default();
        if task.is_some() && states.is_empty() {
            let text = format!(
                "{name} is about places, and I can only be told about kinds of things: please show me"
            );
            return say(output, &name, &text);
        }
        let hearing = Hearing {
            language,
            speakers: snapshots.get(&said.speaker),
            own: snapshots.get(&0),
            states: &states,
            has_numbers: self.settings.learning.language == HypothesisLanguage::Extended,
        };
        let statement = match hearing.statement(act) {
            Ok(statement) => statement,
            Err(unclear) => {
                if matches!(unclear, UnclearError::Ambiguous { .. }) {
                    self.proposal = Some(Proposal::Which(act.kind));
                }
                return say(output, &name, &unclear.to_string());
            }
        };
        let telling = Telling { speaker: said.speaker, statement, prevails: None };
        let words = telling.statement.words(language);
        if let Some(teaching) = &mut self.teaching {
            say(output, &name, &format!("I understand: {words}. I keep that beside what you show me"));
            teaching.told.push(telling);
            return;
        }
        say(output, &name, &format!("I understand: {words}"));
        let task_key = key(&name);
        self.add_told(&task_key, vec![telling.clone()], output);
        let evaluation = self.publish_learned(&task_key, EventKind::Told, &words, output);
        if !self.ask_about_contradiction(&task_key, output)
            && let Some(evaluation) = evaluation
        {
            self.say_learned(&task_key, &evaluation, output);
            self.ask_about_hidden(&task_key, &[telling], output);
        }
    }

    /// Adds sentences to the examples of a task.
    pub(super) fn add_told(&mut self, task_key: &str, told: Vec<Telling>, output: &mut Output) {
        for telling in told {
            let Some(task) = require!(self.tasks.get(task_key), "`{task_key}` is a task") else { return };
            // The sentence is attributed to the last teacher, so the chosen perspective does not change.
            let teacher = task.examples.last().map_or(telling.speaker, |example| example.teacher);
            self.add_example(task_key, Example::told(teacher, telling), output);
        }
    }

    /// After a demonstration: asks about a sentence that it contradicts, or else about what a speaker of `told` cannot
    /// know of.
    pub(super) fn ask_about_told(&mut self, task_key: &str, told: &[Telling], output: &mut Output) {
        if !self.ask_about_contradiction(task_key, output) {
            self.ask_about_hidden(task_key, told, output);
        }
    }

    /// Asks whether a sentence prevails over what contradicts it. Returns whether there is such a sentence.
    pub(super) fn ask_about_contradiction(&mut self, task_key: &str, output: &mut Output) -> bool {
        let language = &self.vocabulary.language;
        let Some(task) = self.tasks.get(task_key) else { return false };
        let tellings = task.examples.iter().enumerate().rev();
        let tellings = tellings.filter_map(|(number, example)| Some((number, example.telling.as_ref()?)));
        let mut found = tellings.filter_map(|(number, telling)| {
            let found = contradictions_of(language, task, &self.perspectives, number);
            (!found.is_empty()).then_some((number, telling.statement.words(language), found))
        });
        let Some((number, words, found)) = found.next() else { return false };
        let parts = listed(&contradicting(language, task, &found));
        let name = task.name.clone();
        say(output, &name, &format!("you said \"{words}\", but {parts}. Should I go by \"{words}\"?"));
        self.subject = found.first().map(|contradiction| contradiction.kind.clone());
        self.question = None;
        self.proposal = Some(Proposal::GoByWords { task: task_key.to_owned(), example: number });
        true
    }

    /// The answer to whether a sentence prevails.
    pub(super) fn settle_contradiction(
        &mut self,
        task_key: &str,
        example: usize,
        prevails: bool,
        output: &mut Output,
    ) {
        let language = &self.vocabulary.language;
        let Some(task) = self.tasks.get_mut(task_key) else { return };
        let examples = task.examples.len();
        let telling = task.examples.get_mut(example).and_then(|example| example.telling.as_mut());
        let Some(telling) = require!(telling, "example {example} of `{task_key}` is a sentence") else {
            return;
        };
        let words = telling.statement.words(language);
        let text = if prevails {
            telling.prevails = Some(examples);
            format!("all right, I go by \"{words}\"")
        } else {
            task.remove(example);
            format!("all right, I forget \"{words}\"")
        };
        let name = task.name.clone();
        output.save.push(StoreChange::Rewrite { key: task_key.to_owned(), task: Some(task.clone()) });
        say(output, &name, &text);
        let evaluation = self.publish_learned(task_key, EventKind::Told, &words, output);
        if !self.ask_about_contradiction(task_key, output)
            && let Some(evaluation) = evaluation
        {
            self.say_learned(task_key, &evaluation, output);
        }
    }

    /// Whether an act repeats the sentence that Leo asks about: then it is the answer "yes".
    pub(super) fn repeats(&self, act: &Act, proposal: &Proposal) -> bool {
        let Proposal::GoByWords { task, example } = proposal else { return false };
        let example = self.tasks.get(task).and_then(|task| task.examples.get(*example));
        let asked = example.and_then(|example| example.telling.as_ref()).map(|telling| &telling.statement);
        let language = &self.vocabulary.language;
        let states = BTreeSet::new();
        let hearing = Hearing { language, speakers: None, own: None, states: &states, has_numbers: true };
        act.kind.is_telling() && asked.is_some() && hearing.statement(act).ok().as_ref() == asked
    }

    /// "All of them" of a speaker that does not know of all: asks about a kind of object that is there, and that they
    /// cannot know of.
    fn ask_about_hidden(&mut self, task_key: &str, told: &[Telling], output: &mut Output) {
        let Some(task) = self.tasks.get(task_key) else { return };
        let is_all = |telling: &&Telling| {
            let Statement::Also(which) = &telling.statement else { return false };
            which.iter().any(|which| which.features.is_empty() && which.known == Some(KnownBy::Speaker))
        };
        let (Some(telling), Some(own)) =
            (told.iter().rfind(is_all), self.views.own(&self.vocabulary.language))
        else {
            return;
        };
        let present = own.objects.into_iter().map(|object| object.features).collect();
        let language = &self.vocabulary.language;
        let question = Question::about_unknown(language, task_key, task, telling.speaker, &present);
        if let Some(question) = question {
            say(output, &task.name, &question.text);
            self.subject = Some(question.features.clone());
            self.question = Some(question);
        }
    }
}

/// What contradicts a sentence, in words: "you worked on the green square".
fn contradicting(language: &Language, task: &Task, found: &[Contradiction]) -> Vec<String> {
    let states = goal_states(language, task);
    let of_goals = |object: &&Object| object.states.keys().any(|state| states.contains(state));
    let all: Vec<&Object> = task.views(0).flat_map(|view| &view.after.objects).filter(of_goals).collect();
    let named = |contradiction: &Contradiction| {
        let object = Object { features: contradiction.kind.clone(), ..Object::default() };
        format!("the {}", describe_object(language, &object, all.iter().copied()))
    };
    let of_kind = |is_told: bool| -> Vec<String> {
        let shown = found.iter().filter(|one| one.said.is_none() && one.is_told == is_told);
        shown.map(&named).collect()
    };
    let mut parts = Vec::new();
    for (objects, did) in [(of_kind(false), "you worked on"), (of_kind(true), "you left out")] {
        if !objects.is_empty() {
            parts.push(format!("{did} {}", listed(&objects)));
        }
    }
    if let Some(earlier) = found.iter().find_map(|one| one.said.as_ref()) {
        parts.push(format!("you said \"{}\" before", earlier.words(language)));
    }
    parts
}

/// The states that the goals of a task are about.
fn goal_states(language: &Language, task: &Task) -> BTreeSet<String> {
    let changes =
        task.views(0).flat_map(|view| changes(&view.before, &view.after, language.moved_m).into_values());
    let in_place = changes.filter(|change| !change.displaced).flat_map(|change| change.signature);
    in_place
        .filter_map(|effect| match effect {
            Effect::State { name, .. } => Some(name),
            Effect::Moved => None,
        })
        .collect()
}
