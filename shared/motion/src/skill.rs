use geometry::{Base, Position};
use kinematics::{Side, Unreachable};

use crate::Face;

/// Something that the body can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Skill {
    /// Take a standing peg from above and put it into a hole.
    Insert {
        /// The peg's centre.
        thing: Position<Base>,
        /// Half the peg's height, in metres.
        half_height_m: f64,
        /// The middle of the hole's rim.
        hole: Position<Base>,
    },
    /// Take a thing from above and put it down elsewhere.
    Place {
        /// The thing's centre.
        thing: Position<Base>,
        /// Half the thing's height, in metres.
        half_height_m: f64,
        /// Where its centre shall come to be.
        to: Position<Base>,
    },
    /// Turn the neck and the eyes towards a point.
    LookAt(Position<Base>),
    /// Both arms, the torso and the gaze to rest.
    Rest,
    /// Make a face.
    Show(Face),
}

/// A part of a skill that ends when the joints have arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Turning neck and eyes.
    Look,
    /// Lifting a low hand out of the blocks, before anything else.
    Raise,
    /// Bringing the hand before the chest, fingers down and open.
    Ready,
    /// Moving above the thing.
    Hover,
    /// Down to the thing.
    Descend,
    /// Closing the fingers.
    Close,
    /// Up with the thing.
    Lift,
    /// Moving above its new place.
    Carry,
    /// Down with the thing.
    Lower,
    /// Opening the fingers.
    Open,
    /// Up without the thing.
    Retreat,
    /// Going to rest.
    Rest,
    /// Moving the face.
    Face,
}

/// How a skill goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// Nothing was begun: there are no goals.
    Idle,
    /// On the way.
    Running {
        /// What it is doing.
        phase: Phase,
    },
    /// The joints have arrived; the goals hold them there.
    Done,
    /// Given up; the goals hold the joints where they were last sent.
    Failed {
        /// What it was doing.
        phase: Phase,
        /// What was wrong.
        why: Why,
    },
}

/// Why a phase failed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Why {
    /// A joint did not arrive in time.
    #[error("joint {joint} stays {away_rad:.3} rad away from its goal")]
    Late {
        /// Its index.
        joint: usize,
        /// How far away it is, in radians.
        away_rad: f64,
    },
    /// A joint's position is not known.
    #[error("joint {joint} does not say where it is")]
    Silent {
        /// Its index.
        joint: usize,
    },
}

/// Why a skill was not begun.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// A coordinate or a height is no number, or a height is negative.
    #[error("the skill's coordinates are no numbers")]
    NoNumber,
    /// No arm gets through the whole way.
    #[error("no way in phase {phase:?}: {why}")]
    Unreachable {
        /// Where the arm that came furthest stopped.
        phase: Phase,
        /// What stopped it.
        why: Unreachable,
    },
    /// The hand cannot wait before the chest, where every way of an arm begins.
    #[error("the {} hand cannot be held before the chest: check the limits of that arm's joints", side.name())]
    NotReady {
        /// Whose hand.
        side: Side,
    },
    /// The way has more waypoints than there is room for.
    #[error("the way has more than {most} waypoints")]
    TooLong {
        /// The room.
        most: usize,
    },
}
