use std::cmp::Ordering;

use clock::Instant;
use message::{Feature, PerceptValue};
use quantity::number::single;

/// One evaluation (m, c, d) of a percept and when it was made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// When the observation behind it was made.
    pub at: Instant,
    /// Match m in [0, 1].
    pub matching: f32,
    /// Confidence c in [0, 1].
    pub confidence: f32,
    /// The feature d.
    pub feature: Feature,
}

impl Sample {
    /// What stands in a cell that holds no sample yet.
    pub(crate) const NONE: Self =
        Self { at: Instant::EPOCH, matching: 0.0, confidence: 0.0, feature: Feature::None };

    /// An evaluation made at an instant; `None` for nonsense.
    #[inline]
    pub(crate) fn of(value: &PerceptValue, at: Instant) -> Option<Self> {
        let PerceptValue { matching, confidence, .. } = *value;
        let within = |share: f32| (0.0..=1.0).contains(&share);
        let feature = value.feature().filter(|_| within(matching) & within(confidence))?;
        Some(Self { at, matching, confidence, feature })
    }

    /// Whether it is an evaluation.
    pub(crate) fn is_sound(&self) -> bool {
        let Self { matching, confidence, feature, .. } = *self;
        let within = (0.0..=1.0).contains(&matching) && (0.0..=1.0).contains(&confidence);
        within && PerceptValue::new(0, matching, confidence, feature).feature().is_some()
    }

    /// Which of two samples counts at one instant: that of the higher m·c. Among equals the
    /// numbers decide, so that the outcome does not depend on who came first.
    pub(crate) fn rank(&self, other: &Self) -> Ordering {
        let strength = |sample: &Self| f64::from(sample.matching) * f64::from(sample.confidence);
        strength(self)
            .total_cmp(&strength(other))
            .then_with(|| self.matching.total_cmp(&other.matching))
            .then_with(|| order(&self.feature, &other.feature))
    }

    /// The sample as it is remembered at `now`, after the newest: its confidence decays
    /// exponentially.
    pub(crate) fn decayed(self, now: Instant, decay_per_s: f64) -> Self {
        let age = now.since(self.at);
        if age.is_zero() {
            return self;
        }
        let confidence = f64::from(self.confidence) * (-decay_per_s * age.as_secs_f64()).exp();
        Self { confidence: single(confidence), ..self }
    }
}

/// A total order of features; it has no other meaning than to be one.
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
