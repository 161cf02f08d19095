use message::{MAX_DEPTH, MAX_PERSPECTIVES};

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
    /// The number of perspectives exceeds [`MAX_PERSPECTIVES`].
    #[error(
        "{partners} partners make {perspectives} perspectives when nested {depth} deep, and the most is \
         {MAX_PERSPECTIVES}: take fewer partners or less depth"
    )]
    TooMany {
        /// Requested number of partners.
        partners: u32,
        /// Requested nesting depth.
        depth: u32,
        /// Resulting number of perspectives.
        perspectives: u32,
    },
    /// The nesting depth is 0 or exceeds [`MAX_DEPTH`].
    #[error("perspectives can be nested from 1 to {MAX_DEPTH} deep, not {depth}")]
    Depth {
        /// Requested nesting depth.
        depth: u32,
    },
}
