use message::{DEPTH_MOST, PERSPECTIVES_MOST};

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
    /// There are more of them than a robot can keep.
    #[error(
        "{partners} partners make {perspectives} perspectives when nested {depth} deep, and the most is \
         {PERSPECTIVES_MOST}: take fewer partners or less depth"
    )]
    TooMany {
        /// Partners whose perspectives were asked for.
        partners: u32,
        /// How deep they were to be nested.
        depth: u32,
        /// How many perspectives that makes.
        perspectives: u32,
    },
    /// They are to be nested deeper than a path can say, or not at all.
    #[error("perspectives can be nested from 1 to {DEPTH_MOST} deep, not {depth}")]
    Depth {
        /// How deep they were to be nested.
        depth: u32,
    },
}
