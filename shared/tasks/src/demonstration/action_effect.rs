//! Classifies an action by its effects on the objects.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::change::{Change, Effect};
use super::snapshot::{Object, Snapshot};

/// Maximum gap between an object's underside and the top of its support, in metres: three standard deviations of
/// the difference of two low-pass filtered heights with 10 mm of noise each.
const RESTS_WITHIN_M: f64 = 0.025;

/// The effect of an action on one object, in relation to another object or agent. It is also the goal of the action:
/// [`ActionEffect::is_achieved`].
///
/// Displacement and state changes of the object are in its [`Change`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ActionEffect {
    /// Placed on an object: at rest after a displacement, and supported by that object.
    PlacedOn {
        /// The identity of the support, within the same perspective.
        support: u64,
    },
    /// Handed over: put into the hand of an agent, or put down such that the owner changes to that agent (the
    /// resource perspective assigns owners).
    Handed {
        /// The agent: 0 the robot, partner 1, 2, …
        to: u16,
    },
}

impl ActionEffect {
    /// Whether the effect holds for an object in this snapshot.
    #[must_use]
    pub fn is_achieved(self, thing: u64, believed: &Snapshot) -> bool {
        let Some(object) = believed.object(thing) else { return false };
        match self {
            Self::PlacedOn { support } => {
                believed.object(support).is_some_and(|support| rests_on(object, support))
            }
            Self::Handed { to } => object.held_by == Some(to) || object.owner == Some(to),
        }
    }
}

/// The snapshots of one perspective around an action.
#[derive(Clone, Copy, Debug)]
pub struct ActionContext<'a> {
    /// At the beginning of the demonstration, Snp(t0, P).
    pub at_start: &'a Snapshot,
    /// At the end of the preceding act, Snp(t_a, P).
    pub before: &'a Snapshot,
    /// At the end of the action, Snp(t_b, P).
    pub after: &'a Snapshot,
}

/// The effects of an action of `actor` on the objects in `changes`; objects without an effect beyond their change are
/// left out.
///
/// - Placed on: the object was displaced relative to its support. An object carried on a tray, or a tower on a pushed
///   block, is not placed.
/// - A hand-over: the holder, or the owner, changes to an agent other than the actor. A change of owner counts only
///   if the object had an owner before and the receiver owned something at the start of the demonstration. A
///   territory that appears later is what the teacher builds.
/// - An object that changed a state of its own (an inserted peg) is not placed, and is handed over only into a hand.
///
/// ```
/// use tasks::{ActionContext, ActionEffect, Object, Snapshot, changes, action_effects};
///
/// let block = |id, [x, z]: [f64; 2]| Object {
///     id,
///     position_m: Some([x, 0.0, z]),
///     half_extents_m: Some([0.03; 3]),
///     ..Object::default()
/// };
/// let before = Snapshot { objects: vec![block(1, [0.0, 0.03]), block(2, [0.3, 0.03])], ..Snapshot::default() };
/// let after = Snapshot { objects: vec![block(1, [0.3, 0.09]), block(2, [0.3, 0.03])], ..Snapshot::default() };
/// let course = ActionContext { at_start: &before, before: &before, after: &after };
/// let action_effects = action_effects(1, &course, &changes(&before, &after, 0.03), 0.03);
/// assert!(action_effects[&1].contains(&ActionEffect::PlacedOn { support: 2 }));
/// ```
#[must_use]
pub fn action_effects(
    actor: u16,
    course: &ActionContext<'_>,
    changes: &BTreeMap<u64, Change>,
    moved_m: f64,
) -> BTreeMap<u64, BTreeSet<ActionEffect>> {
    let ActionContext { at_start, before, after } = *course;
    let mut all = BTreeMap::new();
    for (&id, change) in changes.iter().filter(|(_, change)| change.displaced) {
        let (then, Some(now)) = (before.object(id), after.object(id)) else { continue };
        let mut action_effects = BTreeSet::new();
        if now.held_by.is_none() && is_only_moved(change) {
            let supports = supports(now, after).into_iter().filter(|support| {
                let earlier = then.zip(before.object(support.id));
                !earlier.is_some_and(|(then, below)| {
                    have_same_displacement((then, now), (below, support), moved_m)
                })
            });
            action_effects.extend(supports.map(|support| ActionEffect::PlacedOn { support: support.id }));
        }
        let receiver = then.and_then(|then| receiver(actor, at_start, then, now));
        // A hand is observed; ownership by place is only inferred.
        let receiver = receiver.filter(|_| now.held_by.is_some() || is_only_moved(change));
        action_effects.extend(receiver.map(|to| ActionEffect::Handed { to }));
        if !action_effects.is_empty() {
            all.insert(id, action_effects);
        }
    }
    all
}

/// The receiver of an object, if any.
fn receiver(actor: u16, at_start: &Snapshot, then: &Object, now: &Object) -> Option<u16> {
    let had_things = |agent: u16| at_start.objects.iter().any(|object| object.owner == Some(agent));
    let heir =
        || now.owner.filter(|heir| then.owner.is_some() && then.owner != now.owner && had_things(*heir));
    now.held_by.or_else(heir).filter(|receiver| *receiver != actor)
}

fn is_only_moved(change: &Change) -> bool {
    change.signature.iter().all(|effect| *effect == Effect::Moved)
}

/// The supports of an object; of a stack only the topmost object.
fn supports<'a>(thing: &Object, believed: &'a Snapshot) -> Vec<&'a Object> {
    let below: Vec<&Object> = believed
        .objects
        .iter()
        .filter(|support| support.id != thing.id && rests_on(thing, support))
        .collect();
    let is_covered = |support: &Object| below.iter().any(|other| rests_on(other, support));
    below.iter().copied().filter(|support| !is_covered(support)).collect()
}

/// Whether an object rests on another: its underside is at the top of the support, and the centre of one lies within
/// the outline of the other.
///
/// Objects are assumed upright. Without known extents there is no support.
fn rests_on(object: &Object, support: &Object) -> bool {
    let (Some([_, _, z]), Some([_, _, below])) = (object.position_m, support.position_m) else {
        return false;
    };
    let (Some([_, _, half]), Some([_, _, half_below])) = (object.half_extents_m, support.half_extents_m)
    else {
        return false;
    };
    let gap_m = (z - half) - (below + half_below);
    // z > below: of two thin objects only the upper one rests on the other.
    gap_m.abs() <= RESTS_WITHIN_M && z > below && (is_within(object, support) || is_within(support, object))
}

/// Whether the centre of an object lies within another's outline, seen from above.
fn is_within(object: &Object, outline: &Object) -> bool {
    let (Some([x, y, _]), Some([of_x, of_y, _])) = (object.position_m, outline.position_m) else {
        return false;
    };
    let Some([half_x, half_y, _]) = outline.half_extents_m else { return false };
    let (sin, cos) = outline.heading_rad.unwrap_or(0.0).sin_cos();
    let (dx, dy) = (x - of_x, y - of_y);
    cos.mul_add(dx, sin * dy).abs() <= half_x && cos.mul_add(dy, -sin * dx).abs() <= half_y
}

/// Whether two objects, each before and after, had the same displacement, within `moved_m`.
fn have_same_displacement(one: (&Object, &Object), other: (&Object, &Object), moved_m: f64) -> bool {
    let displacement = |(before, after): (&Object, &Object)| {
        let (from, to) = (before.position_m?, after.position_m?);
        Some(from.into_iter().zip(to).map(|(from, to)| to - from))
    };
    let (Some(one), Some(other)) = (displacement(one), displacement(other)) else { return false };
    one.zip(other).map(|(one, other)| (one - other) * (one - other)).sum::<f64>().sqrt() <= moved_m
}

#[cfg(test)]
mod tests;
