use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::{Histogram, Text};

/// Servo buses that a robot has at most.
pub const MAX_BUSES: usize = 16;

/// How one servo bus fares, since the motor process's life began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/BusHealth/2")]
pub struct BusHealth {
    /// What the configuration calls it.
    pub name: Text,
    /// Joints on it.
    pub joints: u64,
    /// Joints of it that are quarantined now.
    pub quarantined: u64,
    /// Whether its line is lost now: 1 yes, 0 no.
    pub lost: u64,
    /// Requests carried out.
    pub exchanges: u64,
    /// Cycles in which it was still busy with the request before.
    pub skipped: u64,
    /// Answers that did not come.
    pub missed: u64,
    /// Answers that arrived broken.
    pub broken: u64,
    /// Answers dropped because nobody awaited them, or because they were sampled too early.
    pub stale: u64,
    /// Bytes that came after their time.
    pub late_bytes: u64,
    /// Hardware alerts of its servos.
    pub alerts: u64,
    /// Times that a servo of it began anew by itself.
    pub restarts: u64,
    /// Bus watchdogs of its servos that were found to have tripped.
    pub watchdogs: u64,
    /// Instructions that a servo refused by an error number.
    pub refusals: u64,
    /// Identifiers to which two servos were found to answer.
    pub duplicates: u64,
    /// Times that its line was lost.
    pub hang_ups: u64,
    /// How long the requests took, in nanoseconds.
    pub exchange: Histogram,
}

/// How the servo buses fare: the motor process writes it to a board of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Buses/2")]
pub struct Buses {
    /// How many buses there are.
    pub count: u64,
    /// Each of them, in the order of the configuration.
    pub buses: [BusHealth; MAX_BUSES],
}

impl Buses {
    /// The buses that there are.
    #[must_use]
    pub fn all(&self) -> &[BusHealth] {
        let count = usize::try_from(self.count).unwrap_or(MAX_BUSES).min(MAX_BUSES);
        self.buses.get(..count).unwrap_or(&[])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lying_count_shows_no_more_buses_than_there_is_room_for() {
        assert_eq!(Buses { count: u64::MAX, ..Buses::default() }.all().len(), MAX_BUSES);
        assert_eq!(Buses { count: 2, ..Buses::default() }.all().len(), 2);
    }
}
