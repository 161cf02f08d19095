use clock::{Instant, nanos};
use message::Health;

/// Measurement of one cycle: opened when the cycle starts, closed when it ends.
#[derive(Debug)]
#[must_use = "a cycle that is not closed leaves no trace of its execution"]
pub struct Account {
    started_at: Instant,
}

impl Account {
    /// Records in `health` that the cycle with the release time `release` starts `now`.
    ///
    /// For an event-driven process, `release` is the time of the event.
    pub fn open(health: &mut Health, release: Instant, now: Instant) -> Self {
        health.cycles += 1;
        health.beat += 1;
        health.beat_at_ns = now.as_nanos();
        health.wakeup.record(nanos(now.since(release)));
        Self { started_at: now }
    }

    /// Records in `health` that the cycle ended `now` and missed `skipped` further releases. One or more count as an
    /// overrun.
    pub fn close(self, health: &mut Health, skipped: u64, now: Instant) {
        self.close_event_driven(health, now);
        health.overruns += u64::from(skipped > 0);
        health.skipped += skipped;
    }

    /// Records in `health` that the cycle of an event-driven process, which has no deadline, ended `now`.
    pub fn close_event_driven(self, health: &mut Health, now: Instant) {
        health.execution.record(nanos(now.since(self.started_at)));
    }
}

#[cfg(test)]
mod tests {
    use clock::Duration;

    use super::*;
    use crate::Schedule;

    #[test]
    fn lateness_execution_overruns_and_skipped_releases_are_counted_separately() {
        let mut health = Health::default();
        let mut schedule = Schedule::new(Duration::from_micros(1000), Instant::EPOCH).unwrap();
        for (late_us, works_us) in [(10, 100), (900, 200), (0, 3500)] {
            let start = schedule.release() + Duration::from_micros(late_us);
            let account = Account::open(&mut health, schedule.release(), start);
            let end = start + Duration::from_micros(works_us);
            account.close(&mut health, schedule.finish(end), end);
        }
        assert_eq!((health.cycles, health.beat), (3, 3));
        // The second cycle started in time and overran all the same.
        assert_eq!((health.overruns, health.skipped), (2, 4));
        assert_eq!(health.wakeup.max_ns(), 900_000);
        assert_eq!(health.execution.max_ns(), 3_500_000);
        assert_eq!((health.wakeup.count(), health.execution.count()), (3, 3));
    }

    #[test]
    fn a_woken_cycle_has_no_overruns() {
        let mut health = Health::default();
        let account = Account::open(&mut health, Instant::from_nanos(5), Instant::from_nanos(9));
        account.close_event_driven(&mut health, Instant::from_nanos(90_000_000));
        assert_eq!((health.cycles, health.overruns, health.execution.count()), (1, 0, 1));
    }
}
