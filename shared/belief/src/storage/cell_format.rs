use clock::Instant;
use message::{Feature, PerceptValue};

use super::sample::Sample;
use super::stored_sample::{KIND_AT, SampleRef, StoredSample};

/// Storage format of a sample in a history's cells.
pub(crate) trait CellFormat: Copy {
    /// Initial content of an unused cell.
    const NONE: Self;

    fn of(sample: StoredSample) -> Self;

    /// Converts a sample from an evaluation.
    fn from_ref(sample: SampleRef<'_>) -> Self;

    fn kept(self) -> StoredSample;

    fn at(&self) -> Instant;
}

impl CellFormat for StoredSample {
    const NONE: Self = Self::NONE;

    #[inline(always)]
    fn of(sample: StoredSample) -> Self {
        sample
    }

    #[inline(always)]
    fn from_ref(sample: SampleRef<'_>) -> Self {
        sample.kept()
    }

    #[inline(always)]
    fn kept(self) -> StoredSample {
        self
    }

    #[inline(always)]
    fn at(&self) -> Instant {
        self.at
    }
}

/// A smaller format for percepts that derive a symbol, a number or nothing. A feature of several numbers is stored as
/// none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scalar {
    /// Lower and upper half of the time in nanoseconds, to avoid padding between array elements.
    at: [u32; 2],
    /// As in [`StoredSample`].
    matching: u32,
    confidence: f32,
    number: f32,
}

impl Scalar {
    /// The part of a feature that this format can represent.
    #[inline]
    pub(crate) fn representable(feature: Feature) -> Feature {
        match feature {
            Feature::None | Feature::Symbol(_) | Feature::Number(_) => feature,
            Feature::Vector(_) | Feature::Orientation(_) => Feature::None,
        }
    }
}

impl CellFormat for Scalar {
    const NONE: Self = Self { at: [0; 2], matching: 0, confidence: 0.0, number: 0.0 };

    #[inline]
    fn of(sample: StoredSample) -> Self {
        let Sample { at, matching, confidence, feature } = sample.sample();
        let value = PerceptValue::new(0, matching, confidence, feature);
        Self::from_ref(SampleRef { at, value: &value })
    }

    #[inline(always)]
    fn from_ref(sample: SampleRef<'_>) -> Self {
        let PerceptValue { matching, confidence, .. } = *sample.value;
        let (kind, [number, ..]) = sample.value.raw_feature();
        let kind = if kind <= Feature::NUMBER { u32::from(kind) } else { 0 };
        let at = sample.at.as_nanos();
        // The halves always fit.
        let at = [at & u64::from(u32::MAX), at >> 32].map(|half| u32::try_from(half).unwrap_or(0));
        Self {
            at,
            matching: (matching + 0.0).to_bits() | kind << KIND_AT,
            confidence: confidence + 0.0,
            number,
        }
    }

    #[inline]
    fn kept(self) -> StoredSample {
        let Self { matching, confidence, number, .. } = self;
        StoredSample {
            at: self.at(),
            matching,
            confidence: confidence.to_bits(),
            numbers: [number, 0.0, 0.0, 0.0],
        }
    }

    #[inline(always)]
    fn at(&self) -> Instant {
        let [lower, upper] = self.at.map(u64::from);
        Instant::from_nanos(lower | upper << 32)
    }
}
