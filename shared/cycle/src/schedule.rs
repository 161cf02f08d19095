use clock::{Duration, Instant, nanos};

/// The period of a cycle is zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the period of a cycle is zero: it must be at least a nanosecond")]
pub struct ZeroPeriodError;

/// Release times of a cycle: `first_release + n * period`, without end.
///
/// A cycle that overruns loses the releases it missed. They are counted and skipped, but not made up for: catching up
/// would delay the next cycle too, and moving the grid would drift.
#[derive(Clone, Debug)]
pub struct Schedule {
    period: u64,
    release: Instant,
}

impl Schedule {
    /// A schedule whose grid contains `first_release`.
    ///
    /// # Errors
    ///
    /// The period is zero.
    pub fn new(period: Duration, first_release: Instant) -> Result<Self, ZeroPeriodError> {
        if period.is_zero() {
            return Err(ZeroPeriodError);
        }
        Ok(Self { period: nanos(period), release: first_release })
    }

    /// Release time of the next or current cycle.
    #[must_use]
    pub const fn release(&self) -> Instant {
        self.release
    }

    /// The period of the cycle.
    #[must_use]
    pub const fn period(&self) -> Duration {
        Duration::from_nanos(self.period)
    }

    /// Ends the cycle at `now`, and moves the release to the next grid point at or after `now`. The deadline of a
    /// cycle is the next release. Returns the number of missed releases, zero if the cycle was in time.
    pub fn finish(&mut self, now: Instant) -> u64 {
        let taken = nanos(now.since(self.release));
        let periods = taken.div_ceil(self.period).max(1);
        self.release += Duration::from_nanos(periods.saturating_mul(self.period));
        periods - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn schedule(period: u64, first: u64) -> Schedule {
        Schedule::new(Duration::from_nanos(period), Instant::from_nanos(first)).unwrap()
    }

    #[test]
    fn a_period_of_zero_is_refused() {
        assert_eq!(Schedule::new(Duration::ZERO, Instant::EPOCH).unwrap_err(), ZeroPeriodError);
    }

    #[test]
    fn a_cycle_must_end_by_the_next_release() {
        let mut schedule = schedule(100, 1000);
        assert_eq!(schedule.finish(Instant::from_nanos(1100)), 0);
        assert_eq!(schedule.finish(Instant::from_nanos(1201)), 1);
        assert_eq!(schedule.release(), Instant::from_nanos(1300));
    }

    #[test]
    fn a_cycle_that_ends_on_a_grid_point_keeps_it() {
        let mut schedule = schedule(100, 0);
        assert_eq!(schedule.finish(Instant::from_nanos(300)), 2);
        assert_eq!(schedule.release(), Instant::from_nanos(300));
    }

    #[test]
    fn a_cycle_that_ends_before_its_release_keeps_to_the_grid() {
        let mut schedule = schedule(100, 1000);
        assert_eq!(schedule.finish(Instant::from_nanos(3)), 0);
        assert_eq!(schedule.release(), Instant::from_nanos(1100));
    }

    proptest! {
        #[test]
        fn releases_stay_on_the_grid_and_skipped_are_the_points_passed(
            period in 1_u64..20_000_000,
            first in 0_u64..1_000_000_000_000,
            durations in prop::collection::vec(0_u64..100_000_000, 1..200),
        ) {
            let mut schedule = schedule(period, first);
            let (mut cycles, mut skipped) = (0, 0);
            for duration in durations {
                let release = schedule.release();
                let end = release + Duration::from_nanos(duration);
                let passed = (1_u64..).take_while(|n| n * period < duration).count();
                let skips = schedule.finish(end);
                prop_assert_eq!(skips, u64::try_from(passed).unwrap());
                cycles += 1;
                skipped += skips;
                prop_assert!(schedule.release() >= end);
                prop_assert!(schedule.release() > release);
            }
            // Every grid point was either a cycle or skipped, exact to the nanosecond.
            prop_assert_eq!(schedule.release().as_nanos(), first + (cycles + skipped) * period);
        }
    }
}
