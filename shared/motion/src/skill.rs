use std::f64::consts::{FRAC_PI_4, PI, TAU};

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
        /// How it shall be turned on the way; `None` where that does not matter.
        turn: Option<Turn>,
    },
    /// Turn the neck and the eyes towards a point.
    LookAt(Position<Base>),
    /// Every joint stays where it is.
    Hold,
    /// Both arms, the torso and the gaze to rest.
    Rest,
    /// Make a face.
    Show(Face),
}

/// A turn of a thing about the vertical, seen from above anticlockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// By how much, in radians.
    pub by_rad: f64,
    /// Turned by this much, in radians, the thing looks as before, so that any number of these more
    /// will do as well: half a turn for a brick, a quarter for a cube.
    pub period_rad: f64,
}

impl Turn {
    /// All turns up to one way round that do as well, the shortest first.
    pub(crate) fn equivalents(self) -> impl Iterator<Item = f64> + Clone {
        let period_rad = self.period_rad.clamp(PERIOD_LEAST_RAD, TAU);
        let rest = self.by_rad.rem_euclid(period_rad);
        let shortest = if rest > period_rad / 2.0 { rest - period_rad } else { rest };
        let sign = if shortest > 0.0 { -1.0 } else { 1.0 };
        let whole = (0..8).flat_map(move |count| {
            let further = f64::from(count) * period_rad * sign;
            [shortest + further, shortest - further].into_iter().take(if count == 0 { 1 } else { 2 })
        });
        whole.filter(|turn_rad| turn_rad.abs() <= PI + 1e-9)
    }
}

/// Nothing looks the same again after less than an eighth of a turn but what is round.
const PERIOD_LEAST_RAD: f64 = FRAC_PI_4;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_turns_that_do_as_well_the_shortest_comes_first() {
        let degrees = |by: f64, period: f64| {
            let turn = Turn { by_rad: by.to_radians(), period_rad: period.to_radians() };
            turn.equivalents().map(|turn_rad| turn_rad.to_degrees().round()).collect::<Vec<_>>()
        };
        assert_eq!(degrees(170.0, 180.0), [-10.0, 170.0]);
        assert_eq!(degrees(100.0, 90.0), [10.0, -80.0, 100.0, -170.0]);
        assert_eq!(degrees(-270.0, 360.0), [90.0]);
        assert!(degrees(f64::NAN, 90.0).is_empty(), "no number is no turn");
    }
}
