//! Instants of the machine's monotonic clock, and absolute sleeps.
//!
//! [`Instant`] counts nanoseconds of `CLOCK_MONOTONIC`, whose epoch is the same for all processes of a machine. So
//! unlike `std::time::Instant`, it can be sent through shared memory and compared by another process.
//!
//! Only this crate reads the clock. The processes' cores take time as an argument.

use std::ops::{Add, AddAssign, Sub};
pub use std::time::Duration;

use rustix::thread::{ClockId, clock_nanosleep_absolute};
use rustix::time::{Timespec, clock_gettime};

const NANOS_PER_SECOND: u64 = 1_000_000_000;

/// An instant, in nanoseconds of the machine's monotonic clock, or of simulated time in lockstep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Instant(u64);

impl Instant {
    /// The epoch of the clock.
    pub const EPOCH: Self = Self(0);

    /// The instant `nanos` nanoseconds after the clock's epoch.
    #[must_use]
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the clock's epoch.
    #[must_use]
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// Time from `earlier` to `self`; zero if `earlier` is later.
    ///
    /// ```
    /// use clock::{Duration, Instant};
    /// let (early, late) = (Instant::from_nanos(5), Instant::from_nanos(9));
    /// assert_eq!(late.since(early), Duration::from_nanos(4));
    /// assert_eq!(early.since(late), Duration::ZERO);
    /// ```
    #[must_use]
    pub const fn since(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }
}

/// Nanoseconds of a duration, saturating after 584 years.
#[must_use]
pub fn nanos(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

impl Add<Duration> for Instant {
    type Output = Self;

    fn add(self, rhs: Duration) -> Self {
        Self(self.0.saturating_add(nanos(rhs)))
    }
}

impl AddAssign<Duration> for Instant {
    fn add_assign(&mut self, rhs: Duration) {
        *self = *self + rhs;
    }
}

impl Sub<Duration> for Instant {
    type Output = Self;

    fn sub(self, rhs: Duration) -> Self {
        Self(self.0.saturating_sub(nanos(rhs)))
    }
}

/// The current instant of `CLOCK_MONOTONIC`.
#[must_use]
pub fn now() -> Instant {
    let time = clock_gettime(ClockId::Monotonic);
    let seconds = u64::try_from(time.tv_sec).unwrap_or(0);
    let nanos = u64::try_from(time.tv_nsec).unwrap_or(0);
    Instant(seconds * NANOS_PER_SECOND + nanos)
}

/// Sleeps until the absolute instant `wake`; returns at once if it has passed.
///
/// An absolute sleep does not drift, and an interrupting signal does not lengthen it.
pub fn sleep_until(wake: Instant) {
    let request = Timespec {
        tv_sec: i64::try_from(wake.0 / NANOS_PER_SECOND).unwrap_or(i64::MAX),
        tv_nsec: i64::try_from(wake.0 % NANOS_PER_SECOND).unwrap_or(0),
    };
    // Repeating an interrupted absolute sleep does not move its end.
    while clock_nanosleep_absolute(ClockId::Monotonic, &request) == Err(rustix::io::Errno::INTR) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sleep_ends_no_earlier_than_asked() {
        let wake = now() + Duration::from_millis(2);
        sleep_until(wake);
        assert!(now() >= wake);
    }

    #[test]
    fn subtraction_stops_at_the_epoch() {
        assert_eq!(Instant::from_nanos(3) - Duration::from_nanos(9), Instant::EPOCH);
    }
}
