mod cell;

use std::cmp::Ordering;

pub(crate) use cell::{CellFormat, Scalar};
use clock::Instant;
use message::{Feature, PerceptValue};
use quantity::number::{saturating_u16, single};

/// One evaluation (m, c, d) of a percept and its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time of the underlying observation.
    pub at: Instant,
    /// Match m in [0, 1].
    pub matching: f32,
    /// Confidence c in [0, 1].
    pub confidence: f32,
    /// The feature d.
    pub feature: Feature,
}

impl Sample {
    /// Initial content of an unused cell.
    pub(crate) const NONE: Self =
        Self { at: Instant::EPOCH, matching: 0.0, confidence: 0.0, feature: Feature::None };

    /// Whether match, confidence and feature are valid.
    pub(crate) fn is_sound(&self) -> bool {
        let Self { matching, confidence, feature, .. } = *self;
        let within = (0.0..=1.0).contains(&matching) && (0.0..=1.0).contains(&confidence);
        within && PerceptValue::new(0, matching, confidence, feature).feature().is_some()
    }

    /// Which of two samples of one instant is kept: that of higher m·c. Ties are broken by the values, so that the
    /// result does not depend on the order of arrival.
    pub(crate) fn rank(&self, other: &Self) -> Ordering {
        let strength = |sample: &Self| f64::from(sample.matching) * f64::from(sample.confidence);
        strength(self)
            .total_cmp(&strength(other))
            .then_with(|| self.matching.total_cmp(&other.matching))
            .then_with(|| order(&self.feature, &other.feature))
    }

    /// The newest sample as remembered at `now`: its confidence decays exponentially.
    pub(crate) fn decayed(self, now: Instant, decay_per_s: f64) -> Self {
        let age = now.since(self.at);
        if age.is_zero() {
            return self;
        }
        let confidence = f64::from(self.confidence) * (-decay_per_s * age.as_secs_f64()).exp();
        Self { confidence: single(confidence), ..self }
    }
}

/// Compact form of a sample in a history. There are many, and each step writes one or two per history.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StoredSample {
    pub(crate) at: Instant,
    /// The match, and in the top two bits the lower two bits of the feature's kind. Numbers from 0 to 1 leave these
    /// bits free.
    matching: u32,
    /// The confidence, and in the top bits the kind's third bit.
    confidence: u32,
    numbers: [f32; 4],
}

/// First bit of the kind.
const KIND_AT: u32 = 30;
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

/// An arbitrary total order of features.
pub(crate) fn order(a: &Feature, b: &Feature) -> Ordering {
    let (kind_a, numbers_a) = numbers(a);
    let (kind_b, numbers_b) = numbers(b);
    let mut ordering = kind_a.cmp(&kind_b);
    for (a, b) in numbers_a.iter().zip(&numbers_b) {
        ordering = ordering.then_with(|| a.total_cmp(b));
    }
    ordering
}

fn numbers(feature: &Feature) -> (u8, [f32; 4]) {
    match *feature {
        Feature::None => (0, [0.0; 4]),
        Feature::Symbol(symbol) => (1, [f32::from(symbol), 0.0, 0.0, 0.0]),
        Feature::Number(number) => (2, [number, 0.0, 0.0, 0.0]),
        Feature::Vector([x, y, z]) => (3, [x, y, z, 0.0]),
        Feature::Orientation(xyzw) => (4, xyzw),
    }
}
