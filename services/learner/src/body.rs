use clock::Instant;
use geometry::{Base, Position};
use message::JointGoal;

/// A motor skill of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Skill {
    /// Grasps a standing object from above and inserts it into a hole.
    Insert {
        /// The object's centre.
        thing: Position<Base>,
        /// Half its height, in metres.
        half_height_m: f64,
        /// The centre of the hole's upper edge.
        hole: Position<Base>,
    },
    /// Grasps an object from above and puts it down elsewhere.
    Place {
        /// The object's centre.
        thing: Position<Base>,
        /// Half its height, in metres.
        half_height_m: f64,
        /// The goal position of its centre.
        to: Position<Base>,
        /// The rotation of the object on the way; `None` if its heading does not matter.
        turn: Option<Turn>,
    },
    /// Holds the position of every joint.
    Hold,
    /// Opens the hands and moves the arms to the rest pose.
    Rest,
    /// Shows an attentive face.
    Attentive,
    /// Shows a puzzled face.
    Puzzled,
    /// Shows a pleased face.
    Pleased,
}

/// A rotation of an object about the vertical, counterclockwise seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// The angle, in radians.
    pub by_rad: f64,
    /// The rotational symmetry of the object, in radians.
    pub period_rad: f64,
}

/// The state of a skill.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Motion {
    /// In execution.
    Running,
    /// Ended; only the beliefs can show whether it had its effect.
    Done,
    /// Aborted.
    Failed {
        /// The reason, in words.
        why: String,
    },
}

/// The robot's body as the learner uses it: one skill at a time.
pub trait Body {
    /// Starts a skill from the present joint positions, in radians, in the order of the configuration; `None` for
    /// a joint that was not read. A skill in execution is aborted. If the skill cannot start, the next
    /// [`Body::step`] returns [`Motion::Failed`].
    fn begin(&mut self, now: Instant, skill: Skill, present_rad: &[Option<f64>]);

    /// Advances the skill. Appends the current joint goals, also after the end of the skill: the motor process uses
    /// them as the heartbeat of its commander. `Done` and `Failed` persist until the next `begin`.
    fn step(&mut self, now: Instant, present_rad: &[Option<f64>], goals: &mut Vec<JointGoal>) -> Motion;
}
