use clock::Duration;

/// Exchanges without a late byte after which patience shrinks again.
const CALM: u32 = 500;

/// How long a servo may be silent, beyond the time on the wire, before its turn is over.
///
/// Impatience would take a servo for silent whose adapter, or whose machine, is slow. So whenever
/// bytes come after their time, patience doubles; and it shrinks again where none do for long.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patience {
    least: Duration,
    most: Duration,
    now: Duration,
    calm: u32,
}

impl Patience {
    /// From `least` up to `most`.
    pub(crate) fn new(least: Duration, most: Duration) -> Self {
        Self { least, most: most.max(least), now: least, calm: 0 }
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
            self.now = (2 * self.now).min(self.most);
            self.calm = 0;
            return;
        }
        self.calm += 1;
        if self.calm >= CALM {
            self.now = (self.now / 2).max(self.least);
            self.calm = 0;
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
        for _ in 0..4 {
            patience.note(true);
            grown.push(patience.get());
        }
        assert_eq!(grown, [2 * MS, 4 * MS, 5 * MS, 5 * MS]);
        for _ in 0..CALM - 1 {
            patience.note(false);
        }
        assert_eq!(patience.get(), 5 * MS);
        for _ in 0..4 * CALM {
            patience.note(false);
        }
        assert_eq!(patience.get(), MS);
    }
}
