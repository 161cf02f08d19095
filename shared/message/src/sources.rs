use crate::{LOSSES, Loss, Text, ZeroCopySend, filled};

/// Maximum number of sources of a robot.
pub const MAX_SOURCES: usize = 16;

/// Counters of the frames and observations of one source.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/SourceHealth/1")]
pub struct SourceHealth {
    /// Its display name.
    pub name: Text,
    /// Frames accepted.
    pub frames: u64,
    /// Observations added to the percept buffer.
    pub observations: u64,
    /// When a frame was last accepted, in nanoseconds of the clock; zero if never.
    pub last_frame_at_ns: u64,
    /// Whether it has been silent for longer than its rate allows: 1 yes, 0 no.
    pub silent: u64,
    /// Number of losses, indexed by [`Loss`].
    pub losses: [u64; LOSSES],
}

impl SourceHealth {
    /// Number of losses for a reason.
    #[must_use]
    pub fn lost(&self, loss: Loss) -> u64 {
        self.losses.get(usize::from(loss.raw())).copied().unwrap_or(0)
    }
}

/// Counters of all sources. The sensor process writes them to its board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Sources/1")]
pub struct Sources {
    /// Number of sources.
    pub count: u64,
    /// The sources, by number.
    pub sources: [SourceHealth; MAX_SOURCES],
}

impl Sources {
    /// The sources in use, by number.
    #[must_use]
    pub fn all(&self) -> &[SourceHealth] {
        filled(&self.sources, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_false_source_count_is_limited_to_the_capacity() {
        assert_eq!(Sources { count: u64::MAX, ..Sources::default() }.all().len(), MAX_SOURCES);
        assert_eq!(Sources { count: 2, ..Sources::default() }.all().len(), 2);
    }
}
