use clock::Duration;

/// Inverse weight of a new sample in the exponential moving average.
const WEIGHT: u32 = 64;
/// Maximum sample: a larger value means that the machine stalled, and is no wake-up latency.
const MAX_SAMPLE: Duration = Duration::from_micros(100);

/// The mean wake-up latency of a sleeping thread, as an exponential moving average.
///
/// A thread that wakes earlier by this latency, and spins for the rest, writes its bytes on time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WakeupLatency {
    pub(crate) mean: Duration,
}

impl WakeupLatency {
    /// Adds a measured latency.
    pub(crate) fn add_sample(&mut self, late: Duration) {
        self.mean = ((WEIGHT - 1) * self.mean + late.min(MAX_SAMPLE)) / WEIGHT;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const US: Duration = Duration::from_micros(1);

    #[test]
    fn the_mean_latency_is_tracked_and_one_standstill_counts_little() {
        let mut lateness = WakeupLatency::default();
        (0..1000).for_each(|round| lateness.add_sample(if round % 4 == 0 { 50 * US } else { 10 * US }));
        assert!((19 * US..=21 * US).contains(&lateness.mean), "{lateness:?}");
        lateness.add_sample(30_000 * US);
        assert!(lateness.mean < 23 * US, "{lateness:?}");
        (0..1000).for_each(|_| lateness.add_sample(30_000 * US));
        assert!((MAX_SAMPLE - US..=MAX_SAMPLE).contains(&lateness.mean), "{lateness:?}");
        (0..1000).for_each(|_| lateness.add_sample(Duration::ZERO));
        assert!(lateness.mean < US, "{lateness:?}");
    }
}
