use clock::{Instant, nanos};
use message::Health;

/// The account of one cycle under way: opened when it starts, closed when it ends.
#[derive(Debug)]
#[must_use = "a cycle that is not closed leaves no trace of its execution"]
pub struct Account {
    started_at: Instant,
}

impl Account {
    /// Notes in `health` that the cycle released at `release` starts `now`.
    ///
    /// For a process that is woken, `release` is the instant at which it was called.
    pub fn open(health: &mut Health, release: Instant, now: Instant) -> Self {
        health.cycles += 1;
        health.beat += 1;
        health.beat_at_ns = now.as_nanos();
        health.wakeup.record(nanos(now.since(release)));
        Self { started_at: now }
    }

    /// Notes in `health` that the cycle ended `now`, past so many releases.
    pub fn close(self, health: &mut Health, skipped: u64, now: Instant) {
        self.close_woken(health, now);
        health.overruns += u64::from(skipped > 0);
        health.skipped += skipped;
    }

    /// Notes in `health` that the cycle of a process that is woken, which has no deadline,
    /// ended `now`.
    pub fn close_woken(self, health: &mut Health, now: Instant) {
        health.execution.record(nanos(now.since(self.started_at)));
    }
}

#[cfg(test)]
mod tests {
    use clock::Duration;

    use super::*;
    use crate::Schedule;

    #[test]
    fn lateness_execution_overruns_and_skipped_releases_are_told_apart() {
        let mut health = Health::default();
        let mut schedule = Schedule::new(Duration::from_micros(1000), Instant::EPOCH).unwrap();
        for (late_us, works_us) in [(10, 100), (900, 200), (0, 3500)] {
            let start = schedule.release() + Duration::from_micros(late_us);
            let account = Account::open(&mut health, schedule.release(), start);
            let end = start + Duration::from_micros(works_us);
            account.close(&mut health, schedule.finish(end), end);
        }
        assert_eq!((health.cycles, health.beat), (3, 3));
        // The second started in time to work and ended late all the same.
        assert_eq!((health.overruns, health.skipped), (2, 4));
        assert_eq!(health.wakeup.max_ns(), 900_000);
        assert_eq!(health.execution.max_ns(), 3_500_000);
        assert_eq!((health.wakeup.count(), health.execution.count()), (3, 3));
    }

    #[test]
    fn a_woken_cycle_has_no_overruns() {
        let mut health = Health::default();
        let account = Account::open(&mut health, Instant::from_nanos(5), Instant::from_nanos(9));
        account.close_woken(&mut health, Instant::from_nanos(90_000_000));
        assert_eq!((health.cycles, health.overruns, health.execution.count()), (1, 0, 1));
    }
}
