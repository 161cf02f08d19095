//! Estimates the offset between two machines' clocks from exchanged messages.

use clock::{Duration, Instant};

/// Maximum relative drift of two monotonic clocks in parts per million: the error of both crystals, and the
/// slew of both time services (500 at most, adjtimex(2)).
const DRIFT_PPM: u64 = 1100;

/// The four timestamps of one exchange. The first and the last are of this machine's clock, the others of the
/// peer's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockExchange {
    /// When this machine sent its request.
    pub asked_ns: u64,
    /// When the peer received it.
    pub heard_there_ns: u64,
    /// When the peer sent the answer.
    pub answered_there_ns: u64,
    /// When this machine received the answer.
    pub heard_ns: u64,
}

impl ClockExchange {
    /// The round trip without the time at the peer; `None` if the timestamps are inconsistent.
    #[must_use]
    pub fn round_trip(&self) -> Option<Duration> {
        let here = self.heard_ns.checked_sub(self.asked_ns)?;
        let there = self.answered_there_ns.checked_sub(self.heard_there_ns)?;
        // Both clocks truncate to nanoseconds and run at slightly different rates.
        here.checked_sub(there.min(here))
            .map(Duration::from_nanos)
            .filter(|_| there <= here.saturating_add(here / 500))
    }

    /// Lower and upper bound of the peer's clock minus this one, whatever the delay of either direction.
    fn bounds(&self) -> Option<(i64, i64)> {
        let from = difference(self.answered_there_ns, self.heard_ns)?;
        let to = difference(self.heard_there_ns, self.asked_ns)?;
        Some((from.min(to), to.max(from)))
    }
}

/// Estimate of the peer's clock minus this machine's clock.
///
/// Each exchange bounds the offset within its round trip (Cristian 1989, "Probabilistic clock
/// synchronization"). The bounds of all exchanges are intersected after they are widened by the drift since.
/// The estimate changes only if a bound requires it, so that converted timestamps do not jitter.
#[derive(Clone, Copy, Debug, Default)]
pub struct ClockOffset {
    known: Option<Known>,
}

#[derive(Clone, Copy, Debug)]
struct Known {
    from_ns: i64,
    to_ns: i64,
    estimate_ns: i64,
    at: Instant,
}

impl ClockOffset {
    /// Adds an exchange whose answer was received at `now`.
    pub fn learn(&mut self, now: Instant, exchange: &ClockExchange) {
        let Some((from_ns, to_ns)) = exchange.round_trip().and_then(|_| exchange.bounds()) else { return };
        let before = self.known.map(|known| known.widened(now));
        let both = before.map(|known| (known.from_ns.max(from_ns), known.to_ns.min(to_ns)));
        self.known = Some(match (before, both) {
            (Some(known), Some((from_ns, to_ns))) if from_ns <= to_ns => {
                // If the interval shrinks to half, a jump to its centre is worthwhile.
                let is_far_better = to_ns - from_ns <= known.width() / 2;
                let middle = from_ns + (to_ns - from_ns) / 2;
                let estimate_ns =
                    if is_far_better { middle } else { known.estimate_ns.clamp(from_ns, to_ns) };
                Known { from_ns, to_ns, estimate_ns, at: now }
            }
            // The first exchange, or one that contradicts the estimate because the peer restarted.
            _ => Known { from_ns, to_ns, estimate_ns: from_ns + (to_ns - from_ns) / 2, at: now },
        });
    }

    /// Discards the estimate: the peer may be another machine.
    pub fn forget(&mut self) {
        self.known = None;
    }

    /// The peer's clock minus this one, in nanoseconds; `None` before the first exchange.
    #[must_use]
    pub fn estimate_ns(&self) -> Option<i64> {
        self.known.map(|known| known.estimate_ns)
    }

    /// Upper bound of the error of the estimate.
    #[must_use]
    pub fn error(&self, now: Instant) -> Option<Duration> {
        let known = self.known?.widened(now);
        let max = (known.estimate_ns - known.from_ns).max(known.to_ns - known.estimate_ns);
        Some(Duration::from_nanos(max.unsigned_abs()))
    }
}

impl Known {
    fn width(&self) -> i64 {
        self.to_ns - self.from_ns
    }

    fn widened(self, now: Instant) -> Self {
        let drift = clock::nanos(now.since(self.at)) / 1_000_000 * DRIFT_PPM;
        let drift = i64::try_from(drift).unwrap_or(i64::MAX / 4);
        Self { from_ns: self.from_ns.saturating_sub(drift), to_ns: self.to_ns.saturating_add(drift), ..self }
    }
}

/// `there - here`; `None` if the clocks are out of range (some seventy years).
fn difference(there_ns: u64, here_ns: u64) -> Option<i64> {
    let there = i64::try_from(there_ns).ok().filter(|&there| there <= i64::MAX / 4)?;
    let here = i64::try_from(here_ns).ok().filter(|&here| here <= i64::MAX / 4)?;
    Some(there - here)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn exchange(asked: u64, there: i64, ways: (u64, u64), answer: u64) -> ClockExchange {
        let heard_there = asked + ways.0;
        ClockExchange {
            asked_ns: asked,
            heard_there_ns: heard_there.saturating_add_signed(there),
            answered_there_ns: (heard_there + answer).saturating_add_signed(there),
            heard_ns: heard_there + answer + ways.1,
        }
    }

    proptest! {
        #[test]
        fn the_true_clock_offset_is_within_the_stated_error(
            truth in -1_000_000_000_000_i64..1_000_000_000_000,
            ways in proptest::collection::vec((0_u64..300_000_000, 0_u64..300_000_000, 0_u64..50_000_000), 1..30),
        ) {
            let mut offset = ClockOffset::default();
            let mut asked = 2_000_000_000_000;
            for (there, back, answer) in ways {
                let exchange = exchange(asked, truth, (there, back), answer);
                let now = Instant::from_nanos(exchange.heard_ns);
                offset.learn(now, &exchange);
                let wrong = (offset.estimate_ns().unwrap() - truth).unsigned_abs();
                let max = clock::nanos(offset.error(now).unwrap());
                prop_assert!(wrong <= max, "{wrong} ns off, {max} at most");
                prop_assert!(max <= 2 * (there + back) + 1, "{max} after {there} + {back}");
                asked = exchange.heard_ns + 50_000_000;
            }
        }
    }

    #[test]
    fn a_slower_exchange_does_not_change_the_clock_offset_estimate() {
        let mut offset = ClockOffset::default();
        let first = exchange(1_000, 500_000, (100, 100), 10);
        offset.learn(Instant::from_nanos(first.heard_ns), &first);
        let before = offset.estimate_ns();
        let slow = exchange(50_000, 500_000, (90_000, 10), 10);
        offset.learn(Instant::from_nanos(slow.heard_ns), &slow);
        assert_eq!(offset.estimate_ns(), before);
    }

    #[test]
    fn a_restarted_machine_is_trusted() {
        let mut offset = ClockOffset::default();
        for there in [900_000_000_000, -5] {
            let exchange = exchange(1_000_000, there, (100, 100), 10);
            offset.learn(Instant::from_nanos(exchange.heard_ns), &exchange);
            assert_eq!(offset.estimate_ns(), Some(there));
        }
    }

    #[test]
    fn an_inconsistent_clock_exchange_gives_no_estimate() {
        let mut offset = ClockOffset::default();
        let nonsense =
            ClockExchange { asked_ns: 5, heard_there_ns: 9, answered_there_ns: 3, heard_ns: u64::MAX };
        offset.learn(Instant::from_nanos(9), &nonsense);
        assert_eq!((offset.estimate_ns(), offset.error(Instant::from_nanos(9))), (None, None));
    }
}
