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
use super::utterance_queue::PendingSentence;
use super::{Learner, Output, StoreChange, say};
use crate::Body;
use crate::question::Question;
use crate::statement::Hearing;

impl<B: Body> Learner<B> {
    /// Learns from a sentence about a rule: that of the task that is being shown, or of the current one.
    pub(super) fn tell_rule(&mut self, now: Instant, said: &PendingSentence, act: &Act, output: &mut Output) {
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
        let states = self.tasks.get(&key(&name)).map(|task| goal_states(language, task)).unwrap_or_default();
        let hearing = Hearing {
            language,
            speakers: snapshots.get(&said.speaker).or_else(|| snapshots.get(&0)),
            own: snapshots.get(&0),
            states: &states,
            has_numbers: self.settings.learning.language == HypothesisLanguage::Extended,
        };
        let statement = match hearing.statement(act) {
            Ok(statement) => statement,
            Err(unclear) => return say(output, &name, &unclear.to_string()),
        };
        let telling = Telling { speaker: said.speaker, statement, prevails: false };
        let words = telling.statement.words(&self.vocabulary.language);
        if let Some(teaching) = &mut self.teaching {
            say(output, &name, &format!("I understand: {words}. I keep that beside what you show me"));
            teaching.told.push(telling);
            return;
        }
        say(output, &name, &format!("I understand: {words}"));
        let task_key = key(&name);
        self.add_told(&task_key, vec![telling], output);
        if !self.ask_about_contradiction(&task_key, output) {
            self.report_learned(&task_key, EventKind::Told, &words, output);
            self.ask_about_hidden(&task_key, output);
        }
    }

    /// Adds sentences to the examples of a task.
    pub(super) fn add_told(&mut self, task_key: &str, told: Vec<Telling>, output: &mut Output) {
        for telling in told {
            let Some(task) = require!(self.tasks.get(task_key), "`{task_key}` is a task") else { return };
            // The sentence is attributed to the last teacher, whoever said it, so the chosen perspective does not change.
            let teacher = task.examples.last().map_or(telling.speaker, |example| example.teacher);
            self.add_example(task_key, Example::told(teacher, telling), output);
        }
    }

    /// Asks about what was said: about a contradiction, or else about what its speaker cannot know of.
    pub(super) fn ask_about_told(&mut self, task_key: &str, output: &mut Output) {
        if !self.ask_about_contradiction(task_key, output) {
            self.ask_about_hidden(task_key, output);
        }
    }

    /// Asks whether a sentence prevails over what contradicts it. Returns whether there is such a sentence.
    fn ask_about_contradiction(&mut self, task_key: &str, output: &mut Output) -> bool {
        let language = &self.vocabulary.language;
        let Some(task) = self.tasks.get(task_key) else { return false };
        let tellings =
            task.examples.iter().enumerate().filter_map(|(index, one)| Some((index, one.telling.as_ref()?)));
        let found = tellings.filter(|(_, telling)| !telling.prevails).find_map(|(index, telling)| {
            let found = contradictions_of(language, task, &self.perspectives, telling);
            (!found.is_empty()).then_some((index, telling.statement.words(language), found))
        });
        let Some((index, words, found)) = found else { return false };
        let states = goal_states(language, task);
        let of_goals = |object: &&Object| object.states.keys().any(|state| states.contains(state));
        let all: Vec<&Object> = task.views(0).flat_map(|view| &view.after.objects).filter(of_goals).collect();
        let name = |contradiction: &Contradiction| {
            let object = Object { features: contradiction.kind.clone(), ..Object::default() };
            format!("the {}", describe_object(language, &object, all.iter().copied()))
        };
        let of_kind = |is_told: bool| -> Vec<String> {
            let shown = found.iter().filter(|one| one.said.is_none() && one.is_told == is_told);
            shown.map(&name).collect()
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
        let name = task.name.clone();
        let parts = listed(&parts);
        say(output, &name, &format!("you said \"{words}\", but {parts}. Should I go by \"{words}\"?"));
        self.subject = found.first().map(|contradiction| contradiction.kind.clone());
        self.question = None;
        self.proposal = Some(Proposal::GoByWords { task: task_key.to_owned(), example: index });
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
        if prevails {
            let telling = task.examples.get_mut(example).and_then(|example| example.telling.as_mut());
            let Some(telling) = require!(telling, "example {example} of `{task_key}` is a sentence") else {
                return;
            };
            telling.prevails = true;
        } else if example < task.examples.len() {
            task.examples.remove(example);
        }
        let words = if prevails { "what you said" } else { "what you showed and said before" };
        let name = task.name.clone();
        output.save.push(StoreChange::Rewrite { key: task_key.to_owned(), task: Some(task.clone()) });
        let told = task.tellings().map(|telling| telling.statement.words(language)).collect::<Vec<_>>();
        say(output, &name, &format!("all right, I go by {words}"));
        self.report_learned(task_key, EventKind::Told, &listed(&told), output);
        self.ask_about_contradiction(task_key, output);
    }

    /// "All of them" of somebody who does not know of all: asks about a kind of object that they cannot know of.
    fn ask_about_hidden(&mut self, task_key: &str, output: &mut Output) {
        let Some(task) = self.tasks.get(task_key) else { return };
        let is_all = |telling: &Telling| {
            let Statement::Also(which) = &telling.statement else { return false };
            which.iter().any(|which| which.features.is_empty() && which.known == Some(KnownBy::Speaker))
        };
        let Some(telling) = task.tellings().filter(|telling| is_all(telling)).last() else { return };
        let question = Question::about_unknown(&self.vocabulary.language, task_key, task, telling.speaker);
        if let Some(question) = question {
            say(output, &task.name, &question.text);
            self.subject = Some(question.features.clone());
            self.question = Some(question);
        }
    }
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
