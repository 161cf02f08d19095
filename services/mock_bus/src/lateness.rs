use clock::Duration;

/// Inverse weight of a new sample in the exponential moving average.
const WEIGHT: u32 = 64;
/// Maximum sample: a larger value means that the machine stalled, and is no wake-up latency.
const MOST: Duration = Duration::from_micros(100);

/// The mean wake-up latency of a sleeping thread, as an exponential moving average.
///
/// A thread that wakes earlier by this latency, and spins for the rest, writes its bytes on time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lateness {
    usual: Duration,
}

impl Lateness {
    /// The mean latency.
    pub(crate) const fn usual(&self) -> Duration {
        self.usual
    }

    /// Adds a measured latency.
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
