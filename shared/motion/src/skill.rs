use std::f64::consts::{FRAC_PI_4, PI, TAU};

use geometry::{Base, Position};
use kinematics::{Side, UnreachableError};

use crate::Face;

/// An action of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Skill {
    /// Grasp a standing peg from above and insert it into a hole.
    Insert {
        /// Centre of the peg, in metres.
        thing: Position<Base>,
        /// Half the peg's height, in metres.
        half_height_m: f64,
        /// Centre of the hole's rim, in metres.
        hole: Position<Base>,
    },
    /// Grasp an object from above and put it down elsewhere.
    Place {
        /// Centre of the object, in metres.
        thing: Position<Base>,
        /// Half the object's height, in metres.
        half_height_m: f64,
        /// Target position of its centre, in metres.
        to: Position<Base>,
        /// Rotation of the object on the way; `None` if it does not matter.
        turn: Option<Turn>,
    },
    /// Turn the neck and the eyes towards a point.
    LookAt(Position<Base>),
    /// Hold every joint at its position.
    Hold,
    /// Move both arms, the torso and the gaze to rest.
    Rest,
    /// Show a facial expression.
    Show(Face),
}

/// A rotation of an object about the vertical, counterclockwise seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// The angle, in radians.
    pub by_rad: f64,
    /// Rotational symmetry of the object, in radians: any multiple of this angle may be added. Half a turn for a
    /// brick, a quarter for a cube.
    pub period_rad: f64,
}

impl Turn {
    /// All equivalent rotations up to half a turn either way, shortest first.
    pub(crate) fn equivalents(self) -> impl Iterator<Item = f64> + Clone {
        let period_rad = self.period_rad.clamp(MIN_PERIOD_RAD, TAU);
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

/// Minimum symmetry angle: an eighth of a turn. Only round objects have a smaller one.
const MIN_PERIOD_RAD: f64 = FRAC_PI_4;

/// A part of a skill, which ends when the joints have arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Turning neck and eyes.
    Look,
    /// Raising a low hand out of the blocks, before anything else.
    Raise,
    /// Moving the hand in front of the chest, fingers down and open.
    Ready,
    /// Moving above the object.
    Hover,
    /// Moving down to the object.
    Descend,
    /// Closing the fingers.
    Close,
    /// Moving up with the object.
    Lift,
    /// Moving above the target position.
    Carry,
    /// Moving down with the object.
    Lower,
    /// Opening the fingers.
    Open,
    /// Moving up without the object.
    Retreat,
    /// Moving to rest.
    Rest,
    /// Moving the face.
    Face,
}

/// Progress of a skill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// No skill has begun; there are no goals.
    Idle,
    /// In progress.
    Running {
        /// The current phase.
        phase: Phase,
    },
    /// The joints have arrived; the goals hold them there.
    Done,
    /// Aborted; the goals hold the joints at their last goals.
    Failed {
        /// The phase that failed.
        phase: Phase,
        /// Why it failed.
        why: FailureReason,
    },
}

/// Why a phase failed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FailureReason {
    /// A joint did not arrive in time.
    #[error("joint {joint} stays {away_rad:.3} rad away from its goal")]
    Late {
        /// Index of the joint.
        joint: usize,
        /// Distance from its goal, in radians.
        away_rad: f64,
    },
    /// The position of a joint is unknown.
    #[error("the position of joint {joint} is unknown")]
    Silent {
        /// Index of the joint.
        joint: usize,
    },
}

/// Why a skill was not begun.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SkillError {
    /// A coordinate or a height is not finite, or a height is negative.
    #[error("the skill's coordinates are not numbers")]
    NotFinite,
    /// No arm can follow the whole path.
    #[error("no path in phase {phase:?}: {why}")]
    Unreachable {
        /// Phase in which the first attempt failed.
        phase: Phase,
        /// Why it failed.
        why: UnreachableError,
    },
    /// The hand does not reach the ready pose in front of the chest, where every path begins.
    #[error("the {} hand cannot be held before the chest: check the limits of that arm's joints", side.name())]
    NotReady {
        /// Side of the hand.
        side: Side,
    },
    /// The path exceeds the maximum number of waypoints.
    #[error("the path has more than {max} waypoints")]
    TooLong {
        /// The maximum.
        max: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equivalent_rotations_are_ordered_by_their_angle() {
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
