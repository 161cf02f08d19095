use clock::Duration;

/// The part of an observation in the estimate.
const WEIGHT: u32 = 64;
/// What is later than this counts as so late: it is the machine that stands still, and no thread's wake-up.
const MOST: Duration = Duration::from_micros(100);

/// How late a sleeping thread is woken on the whole: the mean of how late it was, as it goes on.
///
/// Bytes on a wire do not wait for a thread. A thread that is woken earlier by this much, and waits awake for what is
/// left, is on time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lateness {
    usual: Duration,
}

impl Lateness {
    /// The usual lateness.
    pub(crate) const fn usual(&self) -> Duration {
        self.usual
    }

    /// Notes how late the thread was woken.
    pub(crate) fn note(&mut self, late: Duration) {
        self.usual = ((WEIGHT - 1) * self.usual + late.min(MOST)) / WEIGHT;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const US: Duration = Duration::from_micros(1);

    #[test]
    fn it_comes_to_the_mean_and_a_standstill_counts_for_little() {
        let mut lateness = Lateness::default();
        (0..1000).for_each(|round| lateness.note(if round % 4 == 0 { 50 * US } else { 10 * US }));
        assert!((19 * US..=21 * US).contains(&lateness.usual()), "{lateness:?}");
        lateness.note(30_000 * US);
        assert!(lateness.usual() < 23 * US, "{lateness:?}");
        (0..1000).for_each(|_| lateness.note(30_000 * US));
        assert!((MOST - US..=MOST).contains(&lateness.usual()), "{lateness:?}");
        (0..1000).for_each(|_| lateness.note(Duration::ZERO));
        assert!(lateness.usual() < US, "{lateness:?}");
    }
}
