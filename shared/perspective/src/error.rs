/// Why no perspective can be made.
#[derive(Debug, thiserror::Error)]
pub enum NoPerspective {
    /// No belief system can be made.
    #[error("the belief system of perspective {agent} cannot be made: {source}")]
    Belief {
        /// Whose perspective: 0 the robot, n partner n.
        agent: u16,
        /// What is wrong.
        source: belief::Unbelievable,
    },
    /// A cone of sight is none.
    #[error("the cone of sight of perspective {agent} is none: {source}")]
    Cone {
        /// Whose perspective: 0 the robot, n partner n.
        agent: u16,
        /// What is wrong.
        source: scene::NoCone,
    },
    /// The robot's eye is nowhere.
    #[error(
        "the robot's field of view: eye_m and looks_at_m must be finite, not {eye_m:?} and {looks_at_m:?}"
    )]
    Eye {
        /// Where the eye is.
        eye_m: [f64; 3],
        /// What it looks at.
        looks_at_m: [f64; 3],
    },
}
