use clock::Duration;

/// Exchanges after which the timeout shrinks to what they needed.
const EXCHANGES: u32 = 50;

/// Adaptive reply timeout: how long a servo may be silent beyond the time on the wire.
///
/// A timeout that is too short takes a servo on a slow adapter or machine for silent. So late bytes double it. But a
/// short stall of the machine must not slow the bus for good, because a silent servo costs one timeout. So where all
/// answers come far sooner, it shrinks to the time needed and a quarter more.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReplyTimeout {
    /// The shortest timeout, for bytes that are already on their way.
    pub(crate) min_timeout: Duration,
    max_timeout: Duration,
    /// The timeout of the next exchange.
    pub(crate) now: Duration,
    /// Longest time that the counted exchanges needed.
    needed: Duration,
    count: u32,
}

impl ReplyTimeout {
    /// Creates a timeout that varies between `min_timeout` and `max_timeout`.
    pub(crate) fn new(min_timeout: Duration, max_timeout: Duration) -> Self {
        Self {
            min_timeout,
            max_timeout: max_timeout.max(min_timeout),
            now: min_timeout,
            needed: Duration::ZERO,
            count: 0,
        }
    }

    /// Records an exchange. `late`: whether bytes of the previous exchange arrived late. `needed`: the time beyond
    /// the time on the wire until the answers that were in time.
    pub(crate) fn record(&mut self, late: bool, needed: Duration) {
        if late {
            self.now = (2 * self.now).min(self.max_timeout);
            (self.needed, self.count) = (Duration::ZERO, 0);
            return;
        }
        self.needed = self.needed.max(needed);
        self.count += 1;
        if self.count >= EXCHANGES {
            self.now = (self.needed + self.needed / 4).clamp(self.min_timeout, self.now);
            (self.needed, self.count) = (Duration::ZERO, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    fn grown() -> ReplyTimeout {
        let mut reply_timeout = ReplyTimeout::new(MS, 5 * MS);
        let grown = [(); 4].map(|()| {
            reply_timeout.record(true, MS);
            reply_timeout.now
        });
        assert_eq!(grown, [2 * MS, 4 * MS, 5 * MS, 5 * MS]);
        reply_timeout
    }

    fn note_all(reply_timeout: &mut ReplyTimeout, needed: Duration) {
        for _ in 0..EXCHANGES {
            reply_timeout.record(false, needed);
        }
    }

    #[test]
    fn the_reply_timeout_grows_with_late_replies_and_shrinks_again() {
        let mut reply_timeout = grown();
        for _ in 0..EXCHANGES - 1 {
            reply_timeout.record(false, Duration::ZERO);
        }
        assert_eq!(reply_timeout.now, 5 * MS);
        reply_timeout.record(false, Duration::ZERO);
        assert_eq!(reply_timeout.now, MS);
    }

    #[test]
    fn the_reply_timeout_stays_long_while_replies_are_late() {
        let mut reply_timeout = grown();
        for (needed, left) in [(4 * MS, 5 * MS), (2 * MS, 5 * MS / 2), (4 * MS, 5 * MS / 2), (MS / 4, MS)] {
            note_all(&mut reply_timeout, needed);
            assert_eq!(reply_timeout.now, left);
        }
        note_all(&mut reply_timeout, MS);
        assert_eq!(reply_timeout.now, MS, "only what is late lets it grow");
    }
}
