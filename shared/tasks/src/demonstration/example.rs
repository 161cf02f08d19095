//! A task as it was taught: its examples, each in the view of every perspective.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::action_effect::ActionEffect;
use super::change::{Change, Effect, Signature, changes};
use super::snapshot::{Object, Snapshot};
use super::telling::Telling;

/// A task as taught so far: the schema S, whose hypotheses are computed from its examples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// Its name, as spelled at first.
    pub name: String,
    /// Its finished demonstrations, in the order of teaching.
    pub examples: Vec<Example>,
}

impl Task {
    /// The views of one perspective on the examples.
    pub fn views(&self, perspective: u16) -> impl Iterator<Item = &View> {
        self.examples.iter().filter_map(move |example| example.view(perspective))
    }

    /// What was said about its rule, in the order of saying.
    pub fn tellings(&self) -> impl Iterator<Item = &Telling> {
        self.examples.iter().filter_map(|example| example.telling.as_ref())
    }

    /// Removes an example; `None` if there is none of this number. A sentence that prevails over a number of first
    /// examples does not prevail over a later one instead.
    pub fn remove(&mut self, number: usize) -> Option<Example> {
        let removed = (number < self.examples.len()).then(|| self.examples.remove(number))?;
        for telling in self.examples.iter_mut().filter_map(|example| example.telling.as_mut()) {
            telling.prevails = telling.prevails.map(|before| before - usize::from(before > number));
        }
        Some(removed)
    }

    /// The objects of answered questions, in the state that the answer gives them.
    pub fn answers(&self) -> impl Iterator<Item = &Object> {
        self.views(0).filter_map(View::answer)
    }

    /// The teachers' views: each example as its own teacher saw it, see [`Example::taught`].
    pub fn taught<'a>(&'a self, simulated: &'a [u16]) -> impl Iterator<Item = &'a View> {
        self.examples.iter().filter_map(move |example| example.taught(simulated))
    }
}

/// The record of one demonstration in a schema, of an answer, or of a sentence about its rule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Example {
    /// Its teacher: partner 1, 2, …
    pub teacher: u16,
    /// The view of every perspective; empty for a sentence.
    pub views: Vec<View>,
    /// The sentence, if it is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub telling: Option<Telling>,
}

impl Example {
    /// An example that was shown.
    #[must_use]
    pub const fn shown(teacher: u16, views: Vec<View>) -> Self {
        Self { teacher, views, telling: None }
    }

    /// An example that was told. `teacher` is the one whose perspective is followed.
    #[must_use]
    pub const fn told(teacher: u16, telling: Telling) -> Self {
        Self { teacher, views: Vec::new(), telling: Some(telling) }
    }

    /// The view of one perspective.
    #[must_use]
    pub fn view(&self, perspective: u16) -> Option<&View> {
        self.views.iter().find(|view| view.perspective == perspective)
    }

    /// The view of the teacher of the example, or the robot's if that perspective is not simulated. What another
    /// teacher could see says nothing about what this one meant.
    #[must_use]
    pub fn taught(&self, simulated: &[u16]) -> Option<&View> {
        let his = self.view(self.teacher).filter(|view| simulated.contains(&view.perspective));
        his.or_else(|| self.view(0))
    }
}

/// A demonstration as one perspective saw it: [(E1 … Ex), G, 1] with G the change between the snapshots.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// The perspective: 0 the robot's, n partner n's.
    pub perspective: u16,
    /// Snp(t0, P).
    pub before: Snapshot,
    /// Snp(t_end, P).
    pub after: Snapshot,
    /// The acts in between, the same in every perspective.
    #[serde(default)]
    pub executables: Vec<Executable>,
}

impl View {
    /// The object of an answered question, in the state that the answer gives it. Such an example has one object
    /// without a position. `None` for a demonstration.
    #[must_use]
    pub fn answer(&self) -> Option<&Object> {
        match self.after.objects.as_slice() {
            [only] => Some(only).filter(|only| only.position_m.is_none()),
            _ => None,
        }
    }

    /// The part of the view that concerns its agent (the resource perspective): the agent's own objects and the shared
    /// ones.
    ///
    /// An object left alone because it belongs to another agent is no evidence about the goal. But an agent that works
    /// on other agents' objects ignores ownership; then nothing is left out. Worked on are the objects with a state
    /// change, or, if there are none, those moved by more than `moved_m` metres. The robot's view is never
    /// reduced, because the robot is not the actor.
    #[must_use]
    pub fn attended(&self, moved_m: f64) -> Self {
        // The owner at the beginning of the demonstration; for objects that came later, at its end.
        let owner = |object: &Object| self.before.object(object.id).unwrap_or(object).owner;
        let attends = |object: &Object| owner(object).is_none_or(|owner| owner == self.perspective);
        let changes = changes(&self.before, &self.after, moved_m);
        let moved = Signature::from([Effect::Moved]);
        let any_state = changes.values().any(|change| change.signature != moved);
        let is_worked_on = |object: &Object| {
            let change = changes.get(&object.id);
            change.is_some_and(|change| !any_state || change.signature != moved)
        };
        let goes_by_owners = || self.after.objects.iter().filter(|object| is_worked_on(object)).all(&attends);
        if self.perspective == 0 || !goes_by_owners() {
            return self.clone();
        }
        Self { before: self.before.filtered(attends), after: self.after.filtered(attends), ..self.clone() }
    }
}

/// An executable of a schema: a primitive act or another task (E = a | S), and its goal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Executable {
    /// The actor: 0 the robot, partner 1, 2, …, or `message::NOBODY`.
    pub actor: u16,
    /// The task that was performed, if it was one.
    pub task: Option<String>,
    /// Its changes in this perspective, by object identity.
    pub changes: BTreeMap<u64, Change>,
    /// Its effects in relation to other objects and agents (placed on, handed over), by object identity.
    #[serde(rename = "deeds", default, skip_serializing_if = "BTreeMap::is_empty")]
    pub action_effects: BTreeMap<u64, BTreeSet<ActionEffect>>,
}
