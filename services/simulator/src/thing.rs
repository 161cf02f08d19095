//! One object as it is now.

use clock::Instant;
use config::lesson::Object;
use geometry::{Hand, Pose, Thing as Frame, World};
use message::NOBODY;

use crate::path::Path;

/// An object as it is now. What it is, its [`Object`] says, at the same index of the table.
#[derive(Clone, Debug)]
pub(crate) struct Thing {
    pub(crate) pose: Pose<World, Frame>,
    pub(crate) motion: Motion,
    /// What it sits in or on; it goes where that goes.
    pub(crate) seat: Option<Seat>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Motion {
    AtRest,
    /// In a teacher's hand.
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
    /// In the hand of a teacher who is there himself: it goes where he moves it.
    InHand {
        by: u16,
        path: Path,
    },
    /// Let go, on its way to rest.
    Settling {
        path: Path,
    },
}

/// Where a thing sits on another one.
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

    /// Whether a hand may take it: it rests, and in no hole.
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

    /// Goes on along its path, if it is on one.
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

/// The pose of a thing that stands upright on the top of another, `raised_m` above the other's
/// centre, right in the middle.
pub(crate) fn above(pose: &Pose<World, Frame>, raised_m: f64) -> Pose<World, Frame> {
    *pose * Pose::<Frame, Frame>::upright(0.0, 0.0, raised_m, 0.0)
}
