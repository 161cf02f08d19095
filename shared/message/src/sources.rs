use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::{LOSSES, Loss, Text};

/// Sources that a robot has at most.
pub const MAX_SOURCES: usize = 16;

/// What became of what one source reported.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/SourceHealth/1")]
pub struct SourceHealth {
    /// What people call it.
    pub name: Text,
    /// Frames that were taken.
    pub frames: u64,
    /// Observations that entered the percept buffer.
    pub observations: u64,
    /// When a frame was taken last, in nanoseconds of the clock; zero where none was.
    pub heard_at_ns: u64,
    /// Whether it has been silent for longer than its rate lets expect: 1 yes, 0 no.
    pub silent: u64,
    /// What was lost, by the number of the [`Loss`].
    pub losses: [u64; LOSSES],
}

impl SourceHealth {
    /// How much was lost for a reason.
    #[must_use]
    pub fn lost(&self, loss: Loss) -> u64 {
        self.losses.get(usize::from(loss.raw())).copied().unwrap_or(0)
    }
}

/// What became of what each source reported: the sensor process writes it to a board of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Sources/1")]
pub struct Sources {
    /// How many sources there are.
    pub count: u64,
    /// Each of them, by its number.
    pub sources: [SourceHealth; MAX_SOURCES],
}

impl Sources {
    /// The sources that there are, in the order of their numbers.
    #[must_use]
    pub fn all(&self) -> &[SourceHealth] {
        let count = usize::try_from(self.count).unwrap_or(MAX_SOURCES).min(MAX_SOURCES);
        self.sources.get(..count).unwrap_or(&[])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lying_count_shows_no_more_sources_than_there_is_room_for() {
        assert_eq!(Sources { count: u64::MAX, ..Sources::default() }.all().len(), MAX_SOURCES);
        assert_eq!(Sources { count: 2, ..Sources::default() }.all().len(), 2);
    }
}
