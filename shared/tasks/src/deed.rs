use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::{Change, Effect, Object, Snapshot};

/// The underside of what rests on a thing is no further than this from the thing's top, in metres:
/// three standard deviations of what 10 mm of noise leave of the difference of two low-pass filtered
/// heights.
const RESTS_WITHIN_M: f64 = 0.025;

/// What an act did with one thing in respect of another thing, or of another agent. Each is the
/// goal of the act as well: [`Deed::is_achieved`].
///
/// That a thing was moved, and which states it changed, is its [`Change`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Deed {
    /// Placed on something: at rest after a displacement, and held up by another object.
    PlacedOn {
        /// The identity of that object, within the same perspective.
        support: u64,
    },
    /// Handed to somebody: put into his hand, or laid down so that what belonged to another belongs
    /// to him (the resource perspective says whose a thing is).
    Handed {
        /// The agent: 0 the robot, partner 1, 2, …
        to: u16,
    },
}

impl Deed {
    /// Whether a thing is as the deed wants it, as a perspective believes.
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

/// What one perspective believed about an act.
#[derive(Clone, Copy, Debug)]
pub struct Course<'a> {
    /// When the demonstration began, Snp(t0, P).
    pub began: &'a Snapshot,
    /// At the end of the act before it, Snp(t_a, P).
    pub before: &'a Snapshot,
    /// At its end, Snp(t_b, P).
    pub after: &'a Snapshot,
}

/// What an act of `actor` did with the things that it `changes`; things of which there is nothing to say
/// beyond their change are left out.
///
/// A thing is placed on another if it was displaced in respect of it: what is carried along on a tray
/// is not placed on it, and neither is a tower on a block that was pushed. It is handed on if it comes
/// to be in the hand of another than the actor, or if it belonged to somebody and now belongs to
/// another than the actor, who had things of his own when the demonstration began: a territory that
/// only comes about in its course is what the teacher builds. What is everybody's cannot be handed on
/// by laying it down. What changes a state of its own meanwhile (a peg that is inserted) is put to use: it is
/// neither placed nor handed.
///
/// ```
/// use tasks::{Course, Deed, Object, Snapshot, changes, deeds};
///
/// let block = |id, [x, z]: [f64; 2]| Object {
///     id,
///     position_m: Some([x, 0.0, z]),
///     half_extents_m: Some([0.03; 3]),
///     ..Object::default()
/// };
/// let before = Snapshot { objects: vec![block(1, [0.0, 0.03]), block(2, [0.3, 0.03])], ..Snapshot::default() };
/// let after = Snapshot { objects: vec![block(1, [0.3, 0.09]), block(2, [0.3, 0.03])], ..Snapshot::default() };
/// let course = Course { began: &before, before: &before, after: &after };
/// let deeds = deeds(1, &course, &changes(&before, &after, 0.03), 0.03);
/// assert!(deeds[&1].contains(&Deed::PlacedOn { support: 2 }));
/// ```
#[must_use]
pub fn deeds(
    actor: u16,
    course: &Course<'_>,
    changes: &BTreeMap<u64, Change>,
    moved_m: f64,
) -> BTreeMap<u64, BTreeSet<Deed>> {
    let Course { began, before, after } = *course;
    let mut all = BTreeMap::new();
    for (&id, change) in changes.iter().filter(|(_, change)| change.displaced) {
        let (then, Some(now)) = (before.object(id), after.object(id)) else { continue };
        let mut deeds = BTreeSet::new();
        if now.held_by.is_none() && is_only_moved(change) {
            let supports = supports(now, after).into_iter().filter(|support| {
                let earlier = then.zip(before.object(support.id));
                !earlier.is_some_and(|(then, below)| went_together((then, now), (below, support), moved_m))
            });
            deeds.extend(supports.map(|support| Deed::PlacedOn { support: support.id }));
        }
        let receiver = then.and_then(|then| receiver(actor, began, then, now));
        // In whose hand it is, is seen; whose it is where it lies, is a guess.
        let receiver = receiver.filter(|_| now.held_by.is_some() || is_only_moved(change));
        deeds.extend(receiver.map(|to| Deed::Handed { to }));
        if !deeds.is_empty() {
            all.insert(id, deeds);
        }
    }
    all
}

/// Who received a thing, if anybody.
fn receiver(actor: u16, began: &Snapshot, then: &Object, now: &Object) -> Option<u16> {
    let had_things = |agent: u16| began.objects.iter().any(|object| object.owner == Some(agent));
    let heir =
        || now.owner.filter(|heir| then.owner.is_some() && then.owner != now.owner && had_things(*heir));
    now.held_by.or_else(heir).filter(|receiver| *receiver != actor)
}

fn is_only_moved(change: &Change) -> bool {
    change.signature.iter().all(|effect| *effect == Effect::Moved)
}

/// What holds a thing up: of things that lie on one another, the uppermost.
fn supports<'a>(thing: &Object, believed: &'a Snapshot) -> Vec<&'a Object> {
    let below: Vec<&Object> = believed
        .objects
        .iter()
        .filter(|support| support.id != thing.id && rests_on(thing, support))
        .collect();
    let is_covered = |support: &Object| below.iter().any(|other| rests_on(other, support));
    below.iter().copied().filter(|support| !is_covered(support)).collect()
}

/// Whether an object stands on another: its underside is at the other's top, and the middle of one is
/// above or below the other.
///
/// Things stand upright. What is not known to have a size holds nothing up.
fn rests_on(object: &Object, support: &Object) -> bool {
    let (Some([_, _, z]), Some([_, _, below])) = (object.position_m, support.position_m) else {
        return false;
    };
    let (Some([_, _, half]), Some([_, _, half_below])) = (object.half_extents_m, support.half_extents_m)
    else {
        return false;
    };
    let gap_m = (z - half) - (below + half_below);
    // Of two thin things that lie on each other, only one is the upper one.
    gap_m.abs() <= RESTS_WITHIN_M && z > below && (is_within(object, support) || is_within(support, object))
}

/// Whether the middle of an object lies within another's outline, seen from above.
fn is_within(object: &Object, outline: &Object) -> bool {
    let (Some([x, y, _]), Some([of_x, of_y, _])) = (object.position_m, outline.position_m) else {
        return false;
    };
    let Some([half_x, half_y, _]) = outline.half_extents_m else { return false };
    let (sin, cos) = outline.heading_rad.unwrap_or(0.0).sin_cos();
    let (dx, dy) = (x - of_x, y - of_y);
    cos.mul_add(dx, sin * dy).abs() <= half_x && cos.mul_add(dy, -sin * dx).abs() <= half_y
}

/// Whether two things, each before and after, were displaced alike.
fn went_together(one: (&Object, &Object), other: (&Object, &Object), moved_m: f64) -> bool {
    let way = |(before, after): (&Object, &Object)| {
        let (from, to) = (before.position_m?, after.position_m?);
        Some(from.into_iter().zip(to).map(|(from, to)| to - from))
    };
    let (Some(one), Some(other)) = (way(one), way(other)) else { return false };
    one.zip(other).map(|(one, other)| (one - other) * (one - other)).sum::<f64>().sqrt() <= moved_m
}

#[cfg(test)]
mod tests;
