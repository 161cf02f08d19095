use std::cmp::Ordering;

use clock::Instant;
use message::{Feature, PerceptValue};
use quantity::number::single;

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
            .then_with(|| self.feature.total_cmp(&other.feature))
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
