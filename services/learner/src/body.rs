use clock::Instant;
use message::JointGoal;
use motion::Skill;

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
