//! The current state of one object.

use clock::Instant;
use config::lesson::Object;
use geometry::{Hand, Pose, Thing as Frame, World};
use message::NOBODY;

use crate::path::Path;

/// The current state of an object. Its [`Object`], at the same index of the table, describes what it is.
#[derive(Clone, Debug)]
pub(crate) struct Thing {
    pub(crate) pose: Pose<World, Frame>,
    pub(crate) motion: Motion,
    /// Its seat in or on another thing, with which it moves.
    pub(crate) seat: Option<Seat>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Motion {
    AtRest,
    /// In a teacher's hand, by script.
    Carried {
        by: u16,
        path: Path,
        to: Option<Seat>,
    },
    /// In Leo's hand.
    Grasped {
        hand: usize,
        x_hand_thing: Pose<Hand, Frame>,
    },
    /// In the hand of a person who acts interactively: it follows their pointer.
    InHand {
        by: u16,
        path: Path,
    },
    /// Released, on its way to rest.
    Settling {
        path: Path,
    },
}

/// The seat of a thing in or on another one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seat {
    /// The other one's index.
    pub(crate) on: usize,
    pub(crate) kind: SeatKind,
    pub(crate) x_on_thing: Pose<Frame, Frame>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SeatKind {
    Hole,
    Top,
}

impl Thing {
    pub(crate) fn laid(object: &Object) -> Self {
        let [x, y, z] = object.place.position_m;
        let pose = Pose::upright(x, y, z, object.place.heading_rad);
        Self { pose, motion: Motion::AtRest, seat: None }
    }

    /// Whether a hand may take it: it is at rest, and in no hole.
    pub(crate) fn is_loose(&self) -> bool {
        matches!(self.motion, Motion::AtRest) && !self.seat.is_some_and(|seat| seat.kind == SeatKind::Hole)
    }

    pub(crate) fn held_by(&self) -> u16 {
        match self.motion {
            Motion::Carried { by, .. } | Motion::InHand { by, .. } => by,
            Motion::Grasped { .. } => 0,
            Motion::AtRest | Motion::Settling { .. } => NOBODY,
        }
    }

    /// Advances it along its path, if any.
    pub(crate) fn advance(&mut self, now: Instant) {
        match self.motion {
            Motion::AtRest | Motion::Grasped { .. } => {}
            Motion::InHand { path, .. } => self.pose = path.at(now),
            Motion::Carried { path, to, .. } => {
                self.pose = path.at(now);
                if path.is_over(now) {
                    self.motion = Motion::AtRest;
                    self.seat = to;
                }
            }
            Motion::Settling { path } => {
                self.pose = path.at(now);
                if path.is_over(now) {
                    self.motion = Motion::AtRest;
                }
            }
        }
    }
}

/// The pose of an upright thing in the middle of another one's top, `raised_m` above the other's centre.
pub(crate) fn above(pose: &Pose<World, Frame>, raised_m: f64) -> Pose<World, Frame> {
    *pose * Pose::<Frame, Frame>::upright(0.0, 0.0, raised_m, 0.0)
}
