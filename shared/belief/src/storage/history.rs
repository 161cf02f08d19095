use std::fmt;

use clock::Instant;

use super::sample::Sample;

/// A history generator g with its histories h (Eq. 3), for `history = { plugin = "NAME" }`.
///
/// The belief system stores the samples of each history in preallocated memory. The generator itself is stateless.
///
/// ```
/// use belief::{History, Sample, Samples};
/// use clock::Instant;
///
/// /// Keeps the sample of the highest confidence.
/// struct Surest;
///
/// impl History for Surest {
///     fn samples(&self) -> usize {
///         1
///     }
///
///     fn take(&self, kept: &mut Samples<'_>, sample: &Sample) {
///         if kept.as_slice().first().is_none_or(|surest| surest.confidence < sample.confidence) {
///             kept.clear();
///             kept.push(*sample);
///         }
///     }
///
///     fn at(&self, kept: &[Sample], instant: Instant) -> Option<Sample> {
///         kept.first().copied().filter(|sample| sample.at <= instant)
///     }
/// }
/// ```
pub trait History: Send + Sync {
    /// Largest number of samples in a history, from 1 to 4096.
    fn samples(&self) -> usize;

    /// Adds a sample to a history: the union with g(m, c, d). The sample may be older than those kept, or of the same
    /// instant. Must not allocate.
    fn take(&self, kept: &mut Samples<'_>, sample: &Sample);

    /// Merges a history with another of the same generator (M), in the older belief's memory. The result should not
    /// depend on which of the two is older. Must not allocate.
    fn merge(&self, kept: &mut Samples<'_>, others: &[Sample]) {
        for sample in others {
            self.take(kept, sample);
        }
    }

    /// h(t): the evaluation at an instant, which may be in the past or later than all samples. `None` before the first
    /// sample.
    ///
    /// Return the confidence of the sample, undecayed. If the instant is not before the newest kept sample, the belief
    /// system applies the decay from the time of the returned sample on. An invalid evaluation (a confidence of 7, a
    /// NaN position) counts as `None`. Must not allocate.
    fn at(&self, kept: &[Sample], instant: Instant) -> Option<Sample>;
}

/// Only says that there is one: a plug-in function has no contents to show.
impl fmt::Debug for dyn History {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("Supplied")
    }
}

/// The samples of one history, in memory of a fixed capacity.
#[derive(Debug)]
pub struct Samples<'a> {
    pub(crate) cells: &'a mut [Sample],
    pub(crate) len: &'a mut u32,
}

impl Samples<'_> {
    /// The kept samples, in order of insertion.
    #[must_use]
    pub fn as_slice(&self) -> &[Sample] {
        self.cells.get(..*self.len as usize).unwrap_or(&[])
    }

    /// The kept samples, mutable.
    pub fn as_mut_slice(&mut self) -> &mut [Sample] {
        self.cells.get_mut(..*self.len as usize).unwrap_or_default()
    }

    /// Appends a sample; returns `false`, with nothing changed, if there is no room.
    pub fn push(&mut self, sample: Sample) -> bool {
        match self.cells.get_mut(*self.len as usize) {
            Some(cell) => {
                *cell = sample;
                *self.len += 1;
                true
            }
            None => false,
        }
    }

    /// Removes and returns the sample at `index`; later ones move up. `None` if there is none.
    pub fn remove(&mut self, index: usize) -> Option<Sample> {
        let after = self.as_mut_slice().get_mut(index..)?;
        let removed = *after.first()?;
        after.rotate_left(1);
        *self.len -= 1;
        Some(removed)
    }

    /// Removes all samples.
    pub fn clear(&mut self) {
        *self.len = 0;
    }
}
