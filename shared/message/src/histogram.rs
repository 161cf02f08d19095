use crate::ZeroCopySend;

/// Number of equal parts of each octave, so that the relative error is at most 1/16.
const PARTS: u64 = 16;
const PART_BITS: u32 = PARTS.trailing_zeros();
/// Values below 2 to this power of nanoseconds share the first bucket.
const LOWEST_BITS: u32 = 7;
/// Values of 2^34 ns (17 s) and more share the last bucket.
const OCTAVES: u32 = 27;
/// Number of buckets: one below the octaves, then `OCTAVES * PARTS`.
const BUCKETS: usize = 433;
const _: () = assert!(BUCKETS as u64 == 1 + OCTAVES as u64 * PARTS);

/// Histogram of durations in nanoseconds with a relative error of at most 1/16, in the log-linear layout of HDR
/// histograms. It is plain memory: recording takes a few instructions, publishing is a copy, and nothing allocates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Histogram/1")]
pub struct Histogram {
    count: u64,
    max_ns: u64,
    buckets: [u32; BUCKETS],
    reserved: u32,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { count: 0, max_ns: 0, buckets: [0; BUCKETS], reserved: 0 }
    }
}

fn bucket_of(nanos: u64) -> usize {
    let clamped = nanos.min((1 << (LOWEST_BITS + OCTAVES)) - 1);
    if clamped < (1 << LOWEST_BITS) {
        return 0;
    }
    let octave = clamped.ilog2();
    let part = (clamped >> (octave - PART_BITS)) & (PARTS - 1);
    let index = 1 + u64::from(octave - LOWEST_BITS) * PARTS + part;
    usize::try_from(index).unwrap_or(0)
}

/// The largest value of a bucket.
fn upper_bound(bucket: usize) -> u64 {
    let Some(index) = u64::try_from(bucket).ok().and_then(|index| index.checked_sub(1)) else {
        return (1 << LOWEST_BITS) - 1;
    };
    let octave = u32::try_from(index / PARTS).unwrap_or(OCTAVES).min(OCTAVES - 1) + LOWEST_BITS;
    ((PARTS + index % PARTS + 1) << (octave - PART_BITS)) - 1
}

impl Histogram {
    /// Records one duration.
    pub fn record(&mut self, nanos: u64) {
        if let Some(bucket) = self.buckets.get_mut(bucket_of(nanos)) {
            *bucket = bucket.saturating_add(1);
        }
        self.count = self.count.saturating_add(1);
        self.max_ns = self.max_ns.max(nanos);
    }

    /// Number of recorded durations.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The exact largest recorded duration; zero if there is none.
    #[must_use]
    pub fn max_ns(&self) -> u64 {
        self.max_ns
    }

    /// Upper bound of the bucket with this quantile, at most 1/16 above the true value; zero if nothing was recorded.
    ///
    /// ```
    /// let mut histogram = message::Histogram::default();
    /// for nanos in 1..=1000 {
    ///     histogram.record(nanos * 1000);
    /// }
    /// let p50 = histogram.quantile_ns(0.5);
    /// assert!((500_000..=532_000).contains(&p50));
    /// ```
    #[must_use]
    pub fn quantile_ns(&self, quantile: f64) -> u64 {
        self.bucket_at(quantile).map_or(0, |(bucket, _)| upper_bound(bucket).min(self.max_ns))
    }

    /// Like [`Self::quantile_ns`], interpolated linearly within the bucket. Use it to compare quantiles
    /// closer than the width of a bucket.
    ///
    /// ```
    /// let mut histogram = message::Histogram::default();
    /// for nanos in 1..=1000 {
    ///     histogram.record(nanos * 1000);
    /// }
    /// let p90 = histogram.quantile_between_ns(0.9);
    /// assert!((899_000.0..=901_000.0).contains(&p90));
    /// ```
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "bounds below 2^53")]
    pub fn quantile_between_ns(&self, quantile: f64) -> f64 {
        let Some((bucket, along)) = self.bucket_at(quantile) else { return 0.0 };
        let lower = bucket.checked_sub(1).map_or(0, upper_bound);
        (lower as f64 + (upper_bound(bucket) - lower) as f64 * along).min(self.max_ns as f64)
    }

    /// The bucket of a quantile, and the share of its count up to the quantile's rank; `None` if nothing was
    /// recorded.
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "ranks among counts below 2^53; the cast saturates"
    )]
    fn bucket_at(&self, quantile: f64) -> Option<(usize, f64)> {
        let total: u64 = self.buckets.iter().map(|&bucket| u64::from(bucket)).sum();
        let rank = ((quantile.clamp(0.0, 1.0) * total as f64).ceil() as u64).max(1);
        let mut before = 0;
        for (index, &bucket) in self.buckets.iter().enumerate() {
            if before + u64::from(bucket) >= rank {
                return Some((index, (rank - before) as f64 / f64::from(bucket)));
            }
            before += u64::from(bucket);
        }
        None
    }

    /// The durations recorded since `earlier`, an older copy of the same histogram. Its maximum is the upper bound of
    /// its last bucket, limited to the maximum of all time.
    #[must_use]
    pub fn since(&self, earlier: &Self) -> Self {
        let mut window = Self::default();
        let mut last = 0;
        for (index, (bucket, (now, then))) in
            window.buckets.iter_mut().zip(self.buckets.iter().zip(&earlier.buckets)).enumerate()
        {
            *bucket = now.saturating_sub(*then);
            if *bucket > 0 {
                last = upper_bound(index);
            }
        }
        window.count = self.count.saturating_sub(earlier.count);
        window.max_ns = last.min(self.max_ns);
        window
    }

    /// Adds another histogram to this one.
    pub fn add(&mut self, other: &Self) {
        for (bucket, more) in self.buckets.iter_mut().zip(&other.buckets) {
            *bucket = bucket.saturating_add(*more);
        }
        self.count = self.count.saturating_add(other.count);
        self.max_ns = self.max_ns.max(other.max_ns);
    }

    /// The non-empty buckets: upper bound in nanoseconds and count.
    pub fn buckets(&self) -> impl Iterator<Item = (u64, u32)> + '_ {
        self.buckets
            .iter()
            .enumerate()
            .filter(|(_, count)| **count > 0)
            .map(|(index, &count)| (upper_bound(index), count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bucket_bound_is_at_most_a_sixteenth_above_its_values() {
        let mut nanos: u64 = 1 << LOWEST_BITS;
        let mut checked = 0;
        while nanos < (1 << (LOWEST_BITS + OCTAVES)) - 1 {
            let bound = upper_bound(bucket_of(nanos));
            assert!(bound >= nanos && bound - nanos <= nanos / 16, "{nanos}: {bound}");
            nanos += nanos / 37 + 1;
            checked += 1;
        }
        assert!(checked > 500);
    }

    #[test]
    fn quantiles_of_an_empty_histogram_are_zero() {
        assert_eq!(Histogram::default().quantile_ns(0.99), 0);
    }

    #[test]
    fn a_histogram_window_contains_the_values_since_its_start() {
        let mut all = Histogram::default();
        all.record(1_000_000);
        let earlier = all;
        all.record(2_000);
        let window = all.since(&earlier);
        assert_eq!(window.count(), 1);
        assert!(window.quantile_ns(1.0) < 2_200);
    }

    #[test]
    fn a_value_beyond_the_last_bucket_keeps_its_maximum() {
        let mut histogram = Histogram::default();
        histogram.record(u64::MAX);
        assert_eq!(histogram.max_ns(), u64::MAX);
        assert_eq!(histogram.count(), 1);
    }
}
