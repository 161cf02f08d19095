//! Events and phrases about what was learned.

use std::collections::BTreeMap;

use geometry::{Base, Position};
use message::{Event, EventKind};
use motion::PartnerMovement;
use quantity::number::saturating_u32;
use tasks::{
    ActionEffect, Change, Executable, Language, Learned, Object, Rule, Snapshot, Standing, Task,
    describe_change, describe_object, listed,
};

use crate::Vocabulary;

/// Maximum number of reported rules per perspective and goal, apart from those of high likelihood.
pub(crate) const MAX_REPORTED_RULES: usize = 8;

/// The learned goal in words: "all filled".
pub(crate) fn goal_phrase(learned: &Learned) -> String {
    if let Some(arrangement) = learned.arrangements.first() {
        return arrangement.name.clone();
    }
    listed(&learned.primary().map(with_expectation).collect::<Vec<_>>())
}

/// A rule in words: "all red filled".
pub(crate) fn with_expectation(rule: &Rule) -> String {
    format!("{} {}", rule.name, expectation(rule))
}

/// The expectation of a rule in words: "filled".
pub(crate) fn expectation(rule: &Rule) -> String {
    describe_change(&Change { signature: rule.expectation.clone(), displaced: false })
}

pub(crate) fn standing_event(
    kind: EventKind,
    task: &Task,
    perspective: u16,
    standing: &Standing,
    text: &str,
) -> Event {
    Event {
        perspective,
        posterior: standing.posterior,
        rank: saturating_u32(standing.rank),
        tally: saturating_u32(standing.tally),
        examples: saturating_u32(standing.examples),
        high_likelihood: u32::from(standing.high_likelihood),
        ..Event::new(kind, &task.name, text)
    }
}

/// The objects of a view in words: "blue square, 2 × red square and 7 × peg".
pub(crate) fn describe_view(language: &Language, view: &Snapshot) -> String {
    describe_view_among(language, view, view)
}

/// As [`describe_view`], with names that distinguish the objects from all those of another view.
pub(crate) fn describe_view_among(language: &Language, view: &Snapshot, all: &Snapshot) -> String {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for object in &view.objects {
        *counts.entry(describe_object(language, object, same_kind(all, object))).or_default() += 1;
    }
    // Sorted by count, so the most frequent kind comes last.
    let mut counts: Vec<(usize, String)> = counts.into_iter().map(|(name, count)| (count, name)).collect();
    counts.sort();
    let mut names = counts
        .into_iter()
        .map(|(count, name)| if count == 1 { name } else { format!("{count} × {name}") })
        .collect::<Vec<_>>();
    let all = names.len();
    // If the text is too long, whole kinds are dropped and counted, so no word is cut.
    loop {
        let text = match (names.len(), all - names.len()) {
            (0, _) => return "nothing".to_owned(),
            (_, 0) => listed(&names),
            (_, untold) => format!("{} and {untold} kinds more", names.join(", ")),
        };
        if text.len() <= message::TEXT_CAPACITY {
            return text;
        }
        names.pop();
    }
}

/// The objects of the same kind, by their set of states: blocks among blocks, pegs among pegs.
pub(crate) fn same_kind<'a>(view: &'a Snapshot, object: &Object) -> impl Iterator<Item = &'a Object> {
    let kind: Vec<String> = object.states.keys().cloned().collect();
    view.objects.iter().filter(move |other| other.states.keys().eq(&kind))
}

/// An act in words: "the teacher: red square filled, small peg inserted".
pub(crate) fn action(vocabulary: &Vocabulary, action: &Executable, now: &Snapshot) -> String {
    let Vocabulary { language, names, .. } = vocabulary;
    let agent_name = if action.actor == 0 { "I".to_owned() } else { names.of(action.actor) };
    let name = |object: &Object| describe_object(language, object, same_kind(now, object));
    let done = |(id, change): (&u64, &Change)| {
        let thing = name(now.object(*id)?);
        let action_effects =
            action.action_effects.get(id).into_iter().flatten().filter_map(|deed| match deed {
                ActionEffect::PlacedOn { support } => {
                    let below = name(now.object(*support)?);
                    let article = if below == thing { "another" } else { "the" };
                    Some(format!("placed on {article} {below}"))
                }
                ActionEffect::Handed { to: 0 } => Some("handed to me".to_owned()),
                ActionEffect::Handed { to } => Some(format!("handed to {}", names.of(*to))),
            });
        let action_effects: Vec<String> = action_effects.collect();
        // A placed or handed object was necessarily moved; only its state changes are mentioned in addition.
        let states = if action_effects.is_empty() { Some(change.clone()) } else { change.states() };
        let all: Vec<String> = states.iter().map(describe_change).chain(action_effects).collect();
        Some(format!("{thing} {}", listed(&all)))
    };
    let what: Vec<String> = action.changes.iter().filter_map(done).collect();
    format!("{agent_name}: {}", listed(&what))
}

/// An observed movement in words: "the teacher: putting the small peg into the red square". `None` if its object is not
/// in the snapshot.
pub(crate) fn movement(
    vocabulary: &Vocabulary,
    movement: &PartnerMovement,
    now: &Snapshot,
) -> Option<String> {
    let Vocabulary { language, names, insertion, .. } = vocabulary;
    let thing = now.object(movement.thing)?;
    let name = |object: &Object| describe_object(language, object, same_kind(now, object));
    // A peg is bound for a free hole, even if there are other objects below.
    let goes_into = |below: &Object| {
        insertion.as_ref().is_some_and(|insertion| {
            thing.states.contains_key(&insertion.inserted)
                && below.states.get(&insertion.filled) == Some(&false)
        })
    };
    let below = below(movement, now);
    let hole = below.iter().find(|below| goes_into(below));
    let (agent_name, what) = (names.of(movement.actor), name(thing));
    Some(match (hole, below.first()) {
        (Some(hole), _) => format!("{agent_name}: putting the {what} into the {}", name(hole)),
        (None, Some(below)) => {
            let below = name(below);
            let article = if below == what { "another" } else { "the" };
            format!("{agent_name}: putting the {what} onto {article} {below}")
        }
        (None, None) => format!("{agent_name}: putting the {what} down"),
    })
}

/// Maximum horizontal distance of an object below a movement's end, in metres.
const MAX_SIDE_OFFSET_M: f64 = 0.04;

/// The objects below the end of a movement, highest first.
fn below<'a>(movement: &PartnerMovement, now: &'a Snapshot) -> Vec<&'a Object> {
    let over = movement.above.point();
    let height_m = |object: &Object| object.position_m.map_or(f64::NEG_INFINITY, |[.., height_m]| height_m);
    let is_below = |object: &&Object| {
        let place = object.position().as_ref().map(Position::<Base>::point);
        let is_under = place.is_some_and(|place| {
            place.z < over.z && (place.x - over.x).hypot(place.y - over.y) <= MAX_SIDE_OFFSET_M
        });
        object.id != movement.thing && object.held_by.is_none() && is_under
    };
    let mut below: Vec<&Object> = now.objects.iter().filter(is_below).collect();
    below.sort_by(|one, other| height_m(other).total_cmp(&height_m(one)));
    below
}
