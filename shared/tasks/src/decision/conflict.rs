//! Which perspective's rules are followed, and how conflicts between two perspectives are resolved.

use std::collections::{BTreeMap, BTreeSet};

use super::explanation::explain;
use super::learned::Learned;
use super::rule::Rule;
use crate::demonstration::{Effect, Object, Signature, Task, has_percepts, is_achieved, is_told};
use crate::hypotheses::{OnConflict, Selection};
use crate::language::Language;

/// Which perspective's rules are followed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Decision {
    /// None: no perspective explains anything.
    NoRule,
    /// The rules of this perspective.
    Followed(u16),
    /// None yet: the teacher has to answer a question first.
    Open(OpenQuestion),
}

/// A kind of object that contradicts the teacher's rule, is known to the teacher, and was not asked about yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenQuestion {
    /// The class features of such an object.
    pub kind: BTreeMap<String, String>,
    /// The expectation of the rule.
    pub goal: Signature,
}

/// Returns the teacher's perspective if it is simulated and explains the examples, else 0 (the robot); `None` if
/// neither explains anything ("take the perspective of the teacher, and assume that their schema is correct").
///
/// With several teachers, the teacher's perspective stands for all of them ([`Task::taught`]).
#[must_use]
pub fn decide(learned: &BTreeMap<u16, Learned>, teacher: u16) -> Option<u16> {
    [teacher, 0].into_iter().find(|perspective| learned.get(perspective).is_some_and(Learned::explains))
}

/// As [`decide`], with a policy for a conflict between the schema from the robot's own view and the teacher's
/// ("Task and Goal Learning"). There is a conflict if both explain the examples and they [`differ`].
///
/// [`OnConflict::Resolve`] examines every object that contradicts the teacher's rule in the robot's view. It is
/// explained if the teacher could not know it or its state, or does not own it ([`explain`]). Otherwise the
/// teacher has to answer a question about its kind. Then the teacher's schema is followed, unless the answers
/// contradict it more often than the robot's. Rules about numbers, spatial relations or movements cannot be
/// settled by a question about one object; for those the teacher's schema is followed.
#[must_use]
pub fn decide_with(
    language: &Language,
    task: &Task,
    learned: &BTreeMap<u16, Learned>,
    teacher: u16,
    on_conflict: OnConflict,
) -> Decision {
    let Some(followed) = decide(learned, teacher) else { return Decision::NoRule };
    let (Some(theirs), Some(own)) = (learned.get(&followed), learned.get(&0)) else {
        return Decision::Followed(followed);
    };
    if followed == 0 || !own.explains() || !differ(own, theirs) {
        return Decision::Followed(followed);
    }
    match on_conflict {
        OnConflict::Human => Decision::Followed(followed),
        OnConflict::Own => Decision::Followed(0),
        OnConflict::Resolve => {
            let simulated: Vec<u16> = learned.keys().copied().collect();
            match open_question(language, task, &simulated, theirs) {
                Some(question) => Decision::Open(question),
                None if contradicted(task, own, theirs) < contradicted(task, theirs, own) => {
                    Decision::Followed(0)
                }
                None => Decision::Followed(followed),
            }
        }
    }
}

/// Whether two perspectives learned different things: another rule about a goal, or another spatial configuration.
#[must_use]
pub fn differ(one: &Learned, other: &Learned) -> bool {
    let has = |learned: &Learned, rule: &Rule| learned.primary().any(|other| other.agrees_with(rule));
    let looks_otherwise = match (one.arrangements.first(), other.arrangements.first()) {
        (Some(one), Some(other)) => !one.arrangement.looks_like(&other.arrangement),
        (None, None) => false,
        (Some(_), None) | (None, Some(_)) => true,
    };
    looks_otherwise
        || one.primary().any(|rule| !has(other, rule))
        || other.primary().any(|rule| !has(one, rule))
}

/// The first kind of object that contradicts the teacher's rules, is known to the teacher, and has no answer yet.
fn open_question(
    language: &Language,
    task: &Task,
    simulated: &[u16],
    theirs: &Learned,
) -> Option<OpenQuestion> {
    let can_be_asked =
        |rule: &&Rule| rule.selection == Selection::All && !rule.expectation.contains(&Effect::Moved);
    theirs.primary().filter(can_be_asked).find_map(|rule| {
        let goal = &rule.expectation;
        let is_answered = |kind: &BTreeMap<String, String>| {
            is_told(task, kind)
                || task.answers().any(|answer| answer.features == *kind && has_percepts(answer, goal))
        };
        let kinds = explain(language, task, simulated, rule).unexplained_kinds;
        let kind = kinds.into_iter().find(|kind| !is_answered(kind))?;
        Some(OpenQuestion { kind, goal: goal.clone() })
    })
}

/// The number of answers that contradict what was learned, over all goals of it and of its rival.
fn contradicted(task: &Task, learned: &Learned, rival: &Learned) -> usize {
    let goals: BTreeSet<&Signature> =
        learned.primary().chain(rival.primary()).map(|rule| &rule.expectation).collect();
    let is_contradicted = |answer: &Object, goal: &Signature| {
        let done = is_achieved(answer, goal, false);
        match learned.primary().find(|rule| rule.expectation == *goal) {
            Some(rule) if rule.selection == Selection::All => rule.is_about(answer) != done,
            // An object without a position may or may not be among a number, or have a relation.
            Some(_) => false,
            None => done,
        }
    };
    let about = |answer: &Object| {
        let asked = goals.iter().filter(|goal| has_percepts(answer, goal));
        asked.filter(|goal| is_contradicted(answer, goal)).count()
    };
    task.answers().map(about).sum()
}
