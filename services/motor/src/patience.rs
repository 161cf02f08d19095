use clock::Duration;

/// Exchanges without a late byte after which patience shrinks again, and a late one is forgotten.
const CALM: u32 = 500;

/// How long a servo may be silent, beyond the time on the wire, before its turn is over.
///
/// Impatience would take a servo for silent whose adapter, or whose machine, is slow. So where bytes
/// come after their time, patience doubles; and it shrinks again where none do for long. But not when
/// they do for once: a machine that stood still for a moment is not slow, and with more patience a
/// silent servo costs more.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patience {
    least: Duration,
    most: Duration,
    now: Duration,
    calm: u32,
    /// Whether bytes were late not long ago.
    was_late: bool,
}

impl Patience {
    /// From `least` up to `most`.
    pub(crate) fn new(least: Duration, most: Duration) -> Self {
        Self { least, most: most.max(least), now: least, calm: 0, was_late: false }
    }

    /// The patience of the next exchange.
    pub(crate) const fn get(&self) -> Duration {
        self.now
    }

    /// The patience with what was on its way already.
    pub(crate) const fn least(&self) -> Duration {
        self.least
    }

    /// Notes an exchange, and whether bytes of the one before it came after their time.
    pub(crate) fn note(&mut self, late: bool) {
        if late {
            if std::mem::replace(&mut self.was_late, true) {
                self.now = (2 * self.now).min(self.most);
            }
            self.calm = 0;
            return;
        }
        self.calm += 1;
        if self.calm >= CALM {
            self.now = (self.now / 2).max(self.least);
            (self.calm, self.was_late) = (0, false);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn patience_grows_where_answers_are_late_and_shrinks_when_they_no_longer_are() {
        let mut patience = Patience::new(MS, 5 * MS);
        let mut grown = Vec::new();
        for _ in 0..5 {
            patience.note(true);
            grown.push(patience.get());
        }
        assert_eq!(grown, [MS, 2 * MS, 4 * MS, 5 * MS, 5 * MS]);
        for _ in 0..CALM - 1 {
            patience.note(false);
        }
        assert_eq!(patience.get(), 5 * MS);
        for _ in 0..4 * CALM {
            patience.note(false);
        }
        assert_eq!(patience.get(), MS);
    }

    #[test]
    fn answers_that_are_late_now_and_then_are_no_reason_for_patience() {
        let mut patience = Patience::new(MS, 5 * MS);
        for _ in 0..4 {
            patience.note(true);
            for _ in 0..CALM {
                patience.note(false);
            }
            assert_eq!(patience.get(), MS);
        }
    }
}
