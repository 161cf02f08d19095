//! Leo's hands: detection of grasp and release.

use clock::Instant;
use config::lesson::Object;
use geometry::{Base, Pose, World};

use crate::settle;
use crate::thing::{Motion, Thing};

/// Hysteresis: a hand is closed from this mean finger closure on, in radians …
const CLOSED_RAD: f64 = 0.7;
/// … and open again below this one.
const OPEN_RAD: f64 = 0.5;
/// A thing is grasped when its centre is within this distance of the grasp point, in metres.
const REACH_M: f64 = 0.03;

/// One of Leo's hands, computed from the joint positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// The pose of the hand, its origin at the grasp point.
    pub pose: Pose<Base, geometry::Hand>,
    /// Mean closure of the fingers, in radians; 0 is open.
    pub closure_rad: f64,
}

/// The state of a hand between steps.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Grasp {
    /// Whether it is closed; `None` until it is first seen.
    is_closed: Option<bool>,
}

impl Grasp {
    /// Updates the state with a closure. Between the two thresholds, and for NaN, the state does not change.
    /// Returns whether the hand has just closed (`true`) or opened (`false`).
    pub(crate) fn note(&mut self, closure_rad: f64) -> Option<bool> {
        let before = self.is_closed;
        let stays_closed = before == Some(true) && (closure_rad.is_nan() || closure_rad >= OPEN_RAD);
        let after = closure_rad > CLOSED_RAD || stays_closed;
        self.is_closed = Some(after);
        // A hand that is closed when first seen has grasped nothing known.
        before.filter(|before| *before != after).map(|_| after)
    }
}

/// Attaches the nearest loose thing within reach of the grasp point to the hand.
pub(crate) fn grasp(things: &mut [Thing], hand: usize, x_world_hand: &Pose<World, geometry::Hand>) {
    let point = x_world_hand.origin();
    let nearest = things
        .iter_mut()
        .filter(|thing| thing.is_loose())
        .map(|thing| (thing.pose.origin().distance(&point), thing))
        .filter(|(distance, _)| *distance <= REACH_M)
        .min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((_, thing)) = nearest {
        let x_hand_thing = x_world_hand.inverse() * thing.pose;
        thing.motion = Motion::Grasped { hand, x_hand_thing };
        thing.seat = None;
    }
}

/// Releases what the hand holds. A peg goes into a hole below it, unless `is_kept` reserves the hole for another thing;
/// everything else falls.
pub(crate) fn release(
    things: &mut [Thing],
    objects: &[Object],
    hand: usize,
    now: Instant,
    is_kept: impl Fn(usize) -> bool,
) {
    let holds =
        |thing: &Thing| matches!(thing.motion, Motion::Grasped { hand: holder, .. } if holder == hand);
    let Some(index) = things.iter().position(holds) else { return };
    let rest = settle::hole_below(things, objects, index, is_kept)
        .or_else(|| settle::support_below(things, objects, index));
    let (Some(rest), Some(thing)) = (rest, things.get_mut(index)) else { return };
    thing.seat = rest.seat;
    thing.motion = Motion::Settling { path: rest.path(thing.pose, now) };
}
