//! Rate limit of a page's messages.

use clock::{Duration, Instant};

/// Maximum number of messages accepted from a page per second.
pub(super) const MAX_MESSAGES_PER_SECOND: u32 = 60;
/// A page that sends more messages per second than this is closed.
const FLOOD: u32 = 10 * MAX_MESSAGES_PER_SECOND;

/// The verdict on a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It is processed.
    Accepted,
    /// It is answered with an error.
    TooMany,
    /// The page is closed.
    Flood,
}

/// Counts the messages of a page.
#[derive(Debug, Default)]
pub(super) struct RateLimit {
    /// Start of the current second, and the number of messages since.
    second: Instant,
    heard: u32,
}

impl RateLimit {
    pub(super) fn hear(&mut self, now: Instant) -> Verdict {
        if now.since(self.second) >= Duration::from_secs(1) {
            (self.second, self.heard) = (now, 0);
        }
        self.heard = self.heard.saturating_add(1);
        if self.heard <= MAX_MESSAGES_PER_SECOND {
            Verdict::Accepted
        } else if self.heard <= FLOOD {
            Verdict::TooMany
        } else {
            Verdict::Flood
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_limit_resets_every_second() {
        let mut rate_limit = RateLimit::default();
        let mut second = |from_s: u64, count: u32| -> Vec<Verdict> {
            (0..count).map(|_| rate_limit.hear(Instant::EPOCH + Duration::from_secs(from_s))).collect()
        };
        let first = second(5, FLOOD + 1);
        assert!(first[..60].iter().all(|taken| *taken == Verdict::Accepted));
        assert!(first[60..600].iter().all(|taken| *taken == Verdict::TooMany));
        assert_eq!(first[600..], [Verdict::Flood]);
        assert_eq!(second(6, 1), [Verdict::Accepted]);
    }
}
