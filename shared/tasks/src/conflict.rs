//! Whose rules are followed, and what is done where two perspectives contradict each other.

use std::collections::{BTreeMap, BTreeSet};

use crate::change::{has_percepts, is_achieved};
use crate::explain::explain;
use crate::{Effect, Language, Learned, Object, OnConflict, Rule, Selection, Signature, Task};

/// Whose rules are followed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Nobody's: no perspective explains anything.
    Nobody,
    /// Those of this perspective.
    Followed(u16),
    /// Nobody's yet: the teacher has to say first what he means.
    Open(Doubt),
}

/// What speaks against the teacher's rule although he knew of it, and was not asked about yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Doubt {
    /// The class features of such a thing.
    pub kind: BTreeMap<String, String>,
    /// What the rule expects.
    pub goal: Signature,
}

/// The perspective whose rules Leo follows: the teacher's, or his who stands for all teachers where there
/// were several ([`Task::taught`]), if he is simulated and what he saw explains anything
/// ("take the perspective of the teacher, and assume that their schema is correct"), else Leo's own (0).
/// `None` where neither explains anything.
#[must_use]
pub fn decide(learned: &BTreeMap<u16, Learned>, teacher: u16) -> Option<u16> {
    [teacher, 0].into_iter().find(|perspective| learned.get(perspective).is_some_and(Learned::explains))
}

/// The same, with what is done on conflict between the schema from the robot's own view and the teacher's
/// ("Task and Goal Learning"). There is a conflict where both explain what changed and [differ](differ).
///
/// To *resolve* it, every thing that contradicts the teacher's rule in the robot's view has to be one that he
/// could not know of, or not as it is, or that is not his ([`explain`]), or he has to say what shall become
/// of such a thing. Where all that is settled, his schema is followed unless what he said speaks more against
/// it than against the robot's. About numbers of things, and about where things stand or are moved to, nobody
/// can be asked by naming one thing: there his schema is followed.
#[must_use]
pub fn decide_with(
    language: &Language,
    task: &Task,
    learned: &BTreeMap<u16, Learned>,
    teacher: u16,
    on_conflict: OnConflict,
) -> Decision {
    let Some(followed) = decide(learned, teacher) else { return Decision::Nobody };
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
            match doubt(language, task, &simulated, theirs) {
                Some(doubt) => Decision::Open(doubt),
                None if contradicted(task, own, theirs) < contradicted(task, theirs, own) => {
                    Decision::Followed(0)
                }
                None => Decision::Followed(followed),
            }
        }
    }
}

/// Whether two perspectives learned different things: another rule about some goal, or another figure.
#[must_use]
pub fn differ(one: &Learned, other: &Learned) -> bool {
    let has = |learned: &Learned, rule: &Rule| learned.primary().any(|other| other.agrees_with(rule));
    let looks_otherwise = match (one.figures.first(), other.figures.first()) {
        (Some(one), Some(other)) => !one.figure.looks_like(&other.figure),
        (None, None) => false,
        (Some(_), None) | (None, Some(_)) => true,
    };
    looks_otherwise
        || one.primary().any(|rule| !has(other, rule))
        || other.primary().any(|rule| !has(one, rule))
}

/// The first thing that speaks against a teacher's rules although he knew of it, and about which he was not
/// asked.
fn doubt(language: &Language, task: &Task, simulated: &[u16], theirs: &Learned) -> Option<Doubt> {
    let can_be_asked =
        |rule: &&Rule| rule.selection == Selection::All && !rule.expectation.contains(&Effect::Moved);
    theirs.primary().filter(can_be_asked).find_map(|rule| {
        let goal = &rule.expectation;
        let is_answered = |kind: &BTreeMap<String, String>| {
            task.answers().any(|answer| answer.features == *kind && has_percepts(answer, goal))
        };
        let kinds = explain(language, task, simulated, rule).unexplained_kinds;
        let kind = kinds.into_iter().find(|kind| !is_answered(kind))?;
        Some(Doubt { kind, goal: goal.clone() })
    })
}

/// How many answers contradict what was learned, about all goals that it or its rival has.
fn contradicted(task: &Task, learned: &Learned, rival: &Learned) -> usize {
    let goals: BTreeSet<&Signature> =
        learned.primary().chain(rival.primary()).map(|rule| &rule.expectation).collect();
    let is_contradicted = |answer: &Object, goal: &Signature| {
        let done = is_achieved(answer, goal, false);
        match learned.primary().find(|rule| rule.expectation == *goal) {
            Some(rule) if rule.selection == Selection::All => rule.is_about(answer) != done,
            // Of a number of things, and of those that stand somewhere, one that is nowhere may be one or
            // not.
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
