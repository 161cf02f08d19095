use std::cmp::Ordering;

use clock::Instant;
use message::{Feature, PerceptValue};
use quantity::number::saturating_u16;

use super::sample::Sample;

/// Compact form of a sample in a history. There are many, and each step writes one or two per history.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StoredSample {
    pub(crate) at: Instant,
    /// The match, and in the top two bits the lower two bits of the feature's kind. Numbers from 0 to 1 leave these
    /// bits free.
    pub(super) matching: u32,
    /// The confidence, and in the top bits the kind's third bit.
    pub(super) confidence: u32,
    pub(super) numbers: [f32; 4],
}

/// First bit of the kind.
pub(super) const KIND_AT: u32 = 30;
const SHARE: u32 = (1 << KIND_AT) - 1;

impl StoredSample {
    /// Initial content of an unused cell.
    pub(crate) const NONE: Self = Self { at: Instant::EPOCH, matching: 0, confidence: 0, numbers: [0.0; 4] };

    #[inline(always)]
    fn new(at: Instant, matching: f32, confidence: f32, (kind, numbers): (u16, [f32; 4])) -> Self {
        // Adding zero turns −0.0 into 0.0, which clears the sign bit.
        let bits = |share: f32, kind: u32| (share + 0.0).to_bits() | kind << KIND_AT;
        let kind = u32::from(kind);
        Self { at, matching: bits(matching, kind & 3), confidence: bits(confidence, kind >> 2), numbers }
    }

    /// The feature d.
    #[inline]
    pub(crate) fn feature(&self) -> Feature {
        let kind = self.matching >> KIND_AT | (self.confidence >> KIND_AT) << 2;
        // Only sound samples are stored.
        Feature::from_sound(saturating_u16(kind as usize), self.numbers)
    }

    #[inline]
    pub(crate) fn sample(&self) -> Sample {
        let [matching, confidence] =
            [self.matching, self.confidence].map(|bits| f32::from_bits(bits & SHARE));
        Sample { at: self.at, matching, confidence, feature: self.feature() }
    }

    /// The same sample with another feature.
    pub(crate) fn with(&self, feature: Feature) -> Self {
        Sample { feature, ..self.sample() }.into()
    }

    /// As [`Sample::rank`].
    pub(crate) fn rank(&self, other: &Self) -> Ordering {
        self.sample().rank(&other.sample())
    }
}

impl From<Sample> for StoredSample {
    fn from(sample: Sample) -> Self {
        let Sample { at, matching, confidence, feature } = sample;
        Self::new(at, matching, confidence, feature.to_raw())
    }
}

/// A sample by reference, because it is large and copied only once.
#[derive(Clone, Copy)]
pub(crate) struct SampleRef<'a> {
    pub(crate) at: Instant,
    /// A sound evaluation.
    pub(crate) value: &'a PerceptValue,
}

impl SampleRef<'_> {
    #[inline(always)]
    pub(crate) fn kept(self) -> StoredSample {
        let PerceptValue { matching, confidence, .. } = *self.value;
        StoredSample::new(self.at, matching, confidence, self.value.raw_feature())
    }
}
