use crate::{Histogram, Text, ZeroCopySend, filled};

/// Maximum number of servo buses of a robot.
pub const MAX_BUSES: usize = 16;

/// Health of one servo bus, counted since this incarnation of the motor process started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/BusHealth/2")]
pub struct BusHealth {
    /// Its name in the configuration.
    pub name: Text,
    /// Joints on it.
    pub joints: u64,
    /// Joints on it that are quarantined now.
    pub quarantined: u64,
    /// Whether its serial line is lost now: 1 yes, 0 no.
    pub lost: u64,
    /// Requests completed.
    pub exchanges: u64,
    /// Cycles skipped because the bus was still busy with the previous request.
    pub skipped: u64,
    /// Status packets that did not arrive.
    pub missed: u64,
    /// Status packets that arrived corrupt.
    pub corrupt: u64,
    /// Status packets dropped because they were not expected, or because they were sampled too early.
    pub stale: u64,
    /// Bytes that arrived after the reply timeout.
    pub late_bytes: u64,
    /// Hardware alerts of its servos.
    pub alerts: u64,
    /// Unexpected reboots of its servos.
    pub restarts: u64,
    /// Bus watchdogs of its servos that have tripped.
    pub watchdogs: u64,
    /// Instructions that a servo rejected with an error number.
    pub refusals: u64,
    /// Identifiers to which two servos replied.
    pub duplicates: u64,
    /// Times that its serial line was lost.
    pub hang_ups: u64,
    /// Duration of the requests, in nanoseconds.
    pub exchange: Histogram,
}

/// Health of all servo buses. The motor process writes it to its board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Buses/2")]
pub struct Buses {
    /// Number of buses.
    pub count: u64,
    /// The buses, in the order of the configuration.
    pub buses: [BusHealth; MAX_BUSES],
}

impl Buses {
    /// The buses in use.
    #[must_use]
    pub fn all(&self) -> &[BusHealth] {
        filled(&self.buses, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_false_bus_count_is_limited_to_the_capacity() {
        assert_eq!(Buses { count: u64::MAX, ..Buses::default() }.all().len(), MAX_BUSES);
        assert_eq!(Buses { count: 2, ..Buses::default() }.all().len(), 2);
    }
}
