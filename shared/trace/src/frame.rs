use message::Observation;

/// What one source observed at one instant.
///
/// No observation at all says that it looked and saw nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// When, in nanoseconds of any clock that all sources of the trace share.
    pub at_ns: u64,
    /// The source; every one of the observations has it too.
    pub source: u16,
    /// What was observed, in the robot's base frame.
    pub observations: Vec<Observation>,
}
