use clock::Instant;
use geometry::{Base, Position};
use message::JointGoal;

/// What Leo can do with its body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Skill {
    /// Takes a standing thing from above and puts it into a hole.
    Insert {
        /// The thing's centre.
        thing: Position<Base>,
        /// Half its height, in metres.
        half_height_m: f64,
        /// The middle of the hole's upper edge.
        hole: Position<Base>,
    },
    /// Takes a thing from above and puts it down elsewhere.
    Place {
        /// The thing's centre.
        thing: Position<Base>,
        /// Half its height, in metres.
        half_height_m: f64,
        /// Where its centre shall come to be.
        to: Position<Base>,
        /// How it shall be turned on the way; `None` where that does not matter.
        turn: Option<Turn>,
    },
    /// Every joint stays where it is.
    Hold,
    /// Hands open, arms where they are in nobody's way.
    Rest,
    /// The face of one who watches.
    Attentive,
    /// The face of one who did not understand.
    Puzzled,
    /// The face of one who has succeeded.
    Pleased,
}

/// A turn of a thing about the vertical, seen from above anticlockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// By how much, in radians.
    pub by_rad: f64,
    /// Turned by this much more, in radians, it looks the same.
    pub period_rad: f64,
}

/// How a skill stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Under way.
    Running,
    /// Ended; whether it had its effect is for the beliefs to say.
    Done,
    /// Given up.
    Failed {
        /// Why, in words.
        why: String,
    },
}

/// The body as the learner uses it: one skill at a time.
pub trait Body {
    /// Begins a skill from the present joint positions, in radians and in the order of the
    /// configuration; `None` where a joint was not read. A skill under way is given up. One that
    /// cannot be begun fails in the next step.
    fn begin(&mut self, now: Instant, skill: Skill, present_rad: &[Option<f64>]);

    /// Goes on with the skill. Appends the joint goals that hold now, also when the skill has
    /// ended: the motor process takes them for the commander's sign of life. `Done` and `Failed` stay until a
    /// skill is begun.
    fn step(&mut self, now: Instant, present_rad: &[Option<f64>], goals: &mut Vec<JointGoal>) -> Motion;
}
