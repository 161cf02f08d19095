//! How much a page may say.

use clock::{Duration, Instant};

/// Messages of a page that are taken within a second.
pub(super) const SECOND_MOST: u32 = 60;
/// A page that says more within a second is shut.
const FLOOD: u32 = 10 * SECOND_MOST;

/// What becomes of a message for the number of those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Taken {
    /// It is heard.
    Heard,
    /// It is answered with an error.
    TooMany,
    /// Nobody who means well says so much.
    Flood,
}

/// Counts what a page says, of whatever kind.
#[derive(Debug, Default)]
pub(super) struct Pace {
    /// When the present second began, and what was heard in it.
    second: Instant,
    heard: u32,
}

impl Pace {
    pub(super) fn hear(&mut self, now: Instant) -> Taken {
        if now.since(self.second) >= Duration::from_secs(1) {
            (self.second, self.heard) = (now, 0);
        }
        self.heard = self.heard.saturating_add(1);
        if self.heard <= SECOND_MOST {
            Taken::Heard
        } else if self.heard <= FLOOD {
            Taken::TooMany
        } else {
            Taken::Flood
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_much_in_one_second_is_heard_in_the_next() {
        let mut pace = Pace::default();
        let mut second = |from_s: u64, count: u32| -> Vec<Taken> {
            (0..count).map(|_| pace.hear(Instant::EPOCH + Duration::from_secs(from_s))).collect()
        };
        let first = second(5, FLOOD + 1);
        assert!(first[..60].iter().all(|taken| *taken == Taken::Heard));
        assert!(first[60..600].iter().all(|taken| *taken == Taken::TooMany));
        assert_eq!(first[600..], [Taken::Flood]);
        assert_eq!(second(6, 1), [Taken::Heard]);
    }
}
