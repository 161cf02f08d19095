use clock::Duration;

/// Exchanges after which the timeout shrinks to what they needed.
const EXCHANGES: u32 = 50;

/// Adaptive reply timeout: how long a servo may be silent beyond the time on the wire.
///
/// A timeout that is too short takes a servo on a slow adapter or machine for silent. So late bytes double it. But a
/// short stall of the machine must not slow the bus for good, because a silent servo costs one timeout. So where all
/// answers come far sooner, it shrinks to the time needed and a quarter more.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patience {
    least: Duration,
    most: Duration,
    now: Duration,
    /// Longest time that the counted exchanges needed.
    needed: Duration,
    count: u32,
}

impl Patience {
    /// Creates a timeout that varies between `least` and `most`.
    pub(crate) fn new(least: Duration, most: Duration) -> Self {
        Self { least, most: most.max(least), now: least, needed: Duration::ZERO, count: 0 }
    }

    /// The timeout of the next exchange.
    pub(crate) const fn get(&self) -> Duration {
        self.now
    }

    /// The shortest timeout, for bytes that are already on their way.
    pub(crate) const fn least(&self) -> Duration {
        self.least
    }

    /// Records an exchange. `late`: whether bytes of the previous exchange arrived late. `needed`: the time beyond
    /// the time on the wire until the answers that were in time.
    pub(crate) fn note(&mut self, late: bool, needed: Duration) {
        if late {
            self.now = (2 * self.now).min(self.most);
            (self.needed, self.count) = (Duration::ZERO, 0);
            return;
        }
        self.needed = self.needed.max(needed);
        self.count += 1;
        if self.count >= EXCHANGES {
            self.now = (self.needed + self.needed / 4).clamp(self.least, self.now);
            (self.needed, self.count) = (Duration::ZERO, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    fn grown() -> Patience {
        let mut patience = Patience::new(MS, 5 * MS);
        let grown = [(); 4].map(|()| {
            patience.note(true, MS);
            patience.get()
        });
        assert_eq!(grown, [2 * MS, 4 * MS, 5 * MS, 5 * MS]);
        patience
    }

    fn note_all(patience: &mut Patience, needed: Duration) {
        for _ in 0..EXCHANGES {
            patience.note(false, needed);
        }
    }

    #[test]
    fn patience_grows_where_answers_are_late_and_shrinks_when_they_no_longer_are() {
        let mut patience = grown();
        for _ in 0..EXCHANGES - 1 {
            patience.note(false, Duration::ZERO);
        }
        assert_eq!(patience.get(), 5 * MS);
        patience.note(false, Duration::ZERO);
        assert_eq!(patience.get(), MS);
    }

    #[test]
    fn patience_stays_as_long_as_it_is_needed() {
        let mut patience = grown();
        for (needed, left) in [(4 * MS, 5 * MS), (2 * MS, 5 * MS / 2), (4 * MS, 5 * MS / 2), (MS / 4, MS)] {
            note_all(&mut patience, needed);
            assert_eq!(patience.get(), left);
        }
        note_all(&mut patience, MS);
        assert_eq!(patience.get(), MS, "only what is late lets it grow");
    }
}
