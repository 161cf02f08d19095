use clock::{Duration, Instant, nanos};

/// Why a schedule was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ScheduleError {
    /// Cycles without time between them have no grid.
    #[error("the period of a cycle is zero: it must be at least a nanosecond")]
    ZeroPeriod,
    /// A deadline at the release cannot be kept, and one after the next release hides that the
    /// next cycle starts late.
    #[error(
        "the deadline of a cycle is {deadline:?} after its release: it must be above zero and at most the period, {period:?}"
    )]
    Deadline {
        /// The deadline, after the release.
        deadline: Duration,
        /// The period.
        period: Duration,
    },
}

/// Release times of a cycle: `first_release + n * period`, for ever.
///
/// A cycle that ends late loses the releases it ran past. They are counted and skipped, never
/// made up: catching up would make the next cycle late too, and moving the grid would drift.
#[derive(Clone, Debug)]
pub struct Schedule {
    period: u64,
    deadline: u64,
    release: Instant,
}

/// How a cycle ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Finished {
    overrun: Option<Overrun>,
}

/// A cycle that ended after its deadline, whether it started late or worked for too long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overrun {
    /// Deadline to end.
    pub late_by: Duration,
    /// Releases that passed before the end.
    pub skipped: u64,
}

impl Finished {
    /// The overrun, if the cycle ended after its deadline.
    #[must_use]
    pub const fn overrun(self) -> Option<Overrun> {
        self.overrun
    }
}

impl Schedule {
    /// The grid through `first_release`. Without a `deadline` (after each release), the period
    /// is the deadline.
    ///
    /// # Errors
    ///
    /// The period is zero, or the deadline is zero or longer than the period.
    pub fn new(
        period: Duration,
        deadline: Option<Duration>,
        first_release: Instant,
    ) -> Result<Self, ScheduleError> {
        let deadline = deadline.unwrap_or(period);
        if period.is_zero() {
            return Err(ScheduleError::ZeroPeriod);
        }
        if deadline.is_zero() || deadline > period {
            return Err(ScheduleError::Deadline { deadline, period });
        }
        Ok(Self { period: nanos(period), deadline: nanos(deadline), release: first_release })
    }

    /// When the next cycle may start, or when the one under way could have started.
    #[must_use]
    pub const fn release(&self) -> Instant {
        self.release
    }

    /// Time between two releases.
    #[must_use]
    pub const fn period(&self) -> Duration {
        Duration::from_nanos(self.period)
    }

    /// Ends the cycle at `now` and moves the release to the first point of the grid that is
    /// still to come (or is `now`).
    pub fn finish(&mut self, now: Instant) -> Finished {
        let taken = nanos(now.since(self.release));
        let periods = taken.div_ceil(self.period).max(1);
        let late_by = taken.saturating_sub(self.deadline);
        self.release += Duration::from_nanos(periods.saturating_mul(self.period));
        let overrun =
            (late_by > 0).then(|| Overrun { late_by: Duration::from_nanos(late_by), skipped: periods - 1 });
        Finished { overrun }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn schedule(period: u64, deadline: Option<u64>, first: u64) -> Schedule {
        let deadline = deadline.map(Duration::from_nanos);
        Schedule::new(Duration::from_nanos(period), deadline, Instant::from_nanos(first)).unwrap()
    }

    #[test]
    fn a_period_of_zero_is_refused() {
        let refused = Schedule::new(Duration::ZERO, None, Instant::EPOCH).unwrap_err();
        assert_eq!(refused, ScheduleError::ZeroPeriod);
    }

    #[test]
    fn a_deadline_of_zero_or_beyond_the_period_is_refused() {
        let period = Duration::from_nanos(10);
        for deadline in [Duration::ZERO, Duration::from_nanos(11)] {
            let refused = Schedule::new(period, Some(deadline), Instant::EPOCH).unwrap_err();
            assert_eq!(refused, ScheduleError::Deadline { deadline, period });
        }
    }

    #[test]
    fn a_cycle_that_ends_at_its_deadline_is_on_time() {
        let mut schedule = schedule(100, Some(60), 1000);
        assert_eq!(schedule.finish(Instant::from_nanos(1060)).overrun(), None);
        let overrun = schedule.finish(Instant::from_nanos(1161)).overrun();
        assert_eq!(overrun, Some(Overrun { late_by: Duration::from_nanos(1), skipped: 0 }));
    }

    #[test]
    fn a_cycle_that_ends_on_a_grid_point_does_not_skip_that_point() {
        let mut schedule = schedule(100, None, 0);
        let overrun = schedule.finish(Instant::from_nanos(300)).overrun().unwrap();
        assert_eq!(overrun.skipped, 2);
        assert_eq!(schedule.release(), Instant::from_nanos(300));
    }

    #[test]
    fn a_cycle_that_ends_before_its_release_keeps_to_the_grid() {
        let mut schedule = schedule(100, None, 1000);
        assert_eq!(schedule.finish(Instant::from_nanos(3)).overrun(), None);
        assert_eq!(schedule.release(), Instant::from_nanos(1100));
    }

    proptest! {
        #[test]
        fn releases_stay_on_the_grid_and_skipped_are_the_points_passed(
            period in 1_u64..20_000_000,
            first in 0_u64..1_000_000_000_000,
            deadline_share in 1_u64..=100,
            durations in prop::collection::vec(0_u64..100_000_000, 1..200),
        ) {
            let deadline = (period * deadline_share / 100).max(1);
            let mut schedule = schedule(period, Some(deadline), first);
            let (mut cycles, mut skipped) = (0, 0);
            for duration in durations {
                let release = schedule.release();
                let end = release + Duration::from_nanos(duration);
                let overrun = schedule.finish(end).overrun();
                cycles += 1;
                let passed = (1_u64..).take_while(|n| n * period < duration).count();
                match overrun {
                    Some(overrun) => {
                        prop_assert!(duration > deadline);
                        prop_assert_eq!(nanos(overrun.late_by), duration - deadline);
                        prop_assert_eq!(overrun.skipped, u64::try_from(passed).unwrap());
                        skipped += overrun.skipped;
                    }
                    None => {
                        prop_assert!(duration <= deadline);
                        prop_assert_eq!(passed, 0);
                    }
                }
                prop_assert!(schedule.release() >= end);
                prop_assert!(schedule.release() > release);
            }
            // Every point of the grid was either a cycle or skipped, to the nanosecond.
            prop_assert_eq!(schedule.release().as_nanos(), first + (cycles + skipped) * period);
        }
    }
}
