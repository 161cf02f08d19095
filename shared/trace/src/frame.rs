use message::Observation;

/// The observations of one source at one instant.
///
/// An empty frame means that the source looked and observed nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// The instant, in nanoseconds of any clock that all sources of the trace share.
    pub at_ns: u64,
    /// The source number, the same as in every observation.
    pub source: u16,
    /// The observations, in the robot's base frame.
    pub observations: Vec<Observation>,
}

impl Frame {
    /// Memory use of its observations, in bytes.
    pub(crate) fn kept_bytes(&self) -> u64 {
        u64::try_from(size_of::<Self>() + size_of_val(self.observations.as_slice())).unwrap_or(u64::MAX)
    }
}
