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

impl Frame {
    /// Bytes of memory that its observations take while they are kept.
    pub(crate) fn kept_bytes(&self) -> u64 {
        u64::try_from(size_of::<Self>() + size_of_val(self.observations.as_slice())).unwrap_or(u64::MAX)
    }
}
