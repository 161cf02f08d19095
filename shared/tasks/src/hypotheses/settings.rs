//! The settings of learning.

use serde::Deserialize;

use super::prior::Prior;

/// The hypothesis language.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum HypothesisLanguage {
    /// The language of the paper: a template and a simple disjunction of its classes.
    #[default]
    Paper,
    /// A superset: also negations, disjunctions of conjunctions over different features, numbers and spatial
    /// relations, weighted by description length.
    Extended,
}

impl HypothesisLanguage {
    /// Its value in a configuration.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Extended => "extended",
        }
    }
}

/// The policy for a conflict between the schema from the robot's own view and the one from the teacher's
/// perspective: the three policies that the paper names ("Task and Goal Learning").
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OnConflict {
    /// Follow the teacher's schema in any case: the policy of the paper's evaluation.
    #[default]
    Human,
    /// Follow the robot's own schema.
    Own,
    /// Follow the teacher's schema once every contradiction is explained by the teacher's limited knowledge or
    /// by their answers; until then follow neither.
    Resolve,
}

/// How hypotheses are generated, weighted and chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The hypothesis language.
    pub language: HypothesisLanguage,
    /// The prior over the hypotheses of [`HypothesisLanguage::Paper`].
    pub prior: Prior,
    /// [`HypothesisLanguage::Extended`]: the cost of a number or a relation, in nats. A literal costs 1, and its
    /// negation 1 more.
    pub selection_nats: f64,
    /// The label noise: the rate of a teacher's mistakes.
    pub noise: Noise,
    /// The minimum posterior of a high-likelihood rule, relative to the best posterior.
    pub high_likelihood: f64,
    /// The conflict policy.
    pub on_conflict: OnConflict,
}

impl Default for Settings {
    /// The settings of the paper.
    fn default() -> Self {
        Self {
            language: HypothesisLanguage::Paper,
            prior: Prior::default(),
            selection_nats: 4.0,
            noise: Noise::NONE,
            high_likelihood: 0.01,
            on_conflict: OnConflict::Human,
        }
    }
}

/// The label noise ε: the probability that a teacher treats an object of a demonstration contrary to their rule.
/// It lies in [0, 0.5).
///
/// With 0, P(D|h) is the share of the examples that are consistent with h. Above 0, P(D|h) is a product over the
/// objects that were not already in the goal state: ε for each mistake, 1 - ε for each other object.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Deserialize)]
#[serde(try_from = "f64")]
pub struct Noise(f64);

/// The error for a label noise outside [0, 0.5).
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{0} is out of range: the label noise is a probability from 0 to below 0.5")]
pub struct NoiseOutOfRangeError(f64);

impl TryFrom<f64> for Noise {
    type Error = NoiseOutOfRangeError;

    fn try_from(value: f64) -> Result<Self, NoiseOutOfRangeError> {
        if (0.0..0.5).contains(&value) { Ok(Self(value)) } else { Err(NoiseOutOfRangeError(value)) }
    }
}

impl Noise {
    /// No label noise.
    pub const NONE: Self = Self(0.0);

    /// The probability.
    #[must_use]
    pub const fn get(self) -> f64 {
        self.0
    }

    /// ln ε and ln(1 - ε); `None` without label noise.
    pub(crate) fn logs(self) -> Option<(f64, f64)> {
        (self.0 > 0.0).then(|| (self.0.ln(), (-self.0).ln_1p()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn label_noise_of_one_half_or_more_is_refused() {
        for value in [-0.1, 0.5, 1.0, f64::NAN, f64::INFINITY] {
            assert!(Noise::try_from(value).is_err(), "{value}");
        }
        assert_eq!(Noise::try_from(0.0), Ok(Noise::NONE));
    }
}
