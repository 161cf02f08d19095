use message::{DEPTH_MOST, PERSPECTIVES_MOST};

/// A perspective cannot be created.
#[derive(Debug, thiserror::Error)]
pub enum PerspectiveError {
    /// The belief system cannot be created.
    #[error("the belief system of perspective {agent} cannot be created: {source}")]
    Belief {
        /// The agent: 0 the robot, n partner n.
        agent: u16,
        /// The cause.
        source: belief::BeliefSystemError,
    },
    /// The configured field of view is invalid.
    #[error("the cone of sight of perspective {agent} is invalid: {source}")]
    Cone {
        /// The agent: 0 the robot, n partner n.
        agent: u16,
        /// The cause.
        source: scene::ConeError,
    },
    /// The number of perspectives exceeds [`PERSPECTIVES_MOST`].
    #[error(
        "{partners} partners make {perspectives} perspectives when nested {depth} deep, and the most is \
         {PERSPECTIVES_MOST}: take fewer partners or less depth"
    )]
    TooMany {
        /// Requested number of partners.
        partners: u32,
        /// Requested nesting depth.
        depth: u32,
        /// Resulting number of perspectives.
        perspectives: u32,
    },
    /// The nesting depth is 0 or exceeds [`DEPTH_MOST`].
    #[error("perspectives can be nested from 1 to {DEPTH_MOST} deep, not {depth}")]
    Depth {
        /// Requested nesting depth.
        depth: u32,
    },
}
