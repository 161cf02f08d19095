use crate::Prior;

/// What a hypothesis can say of the objects that it is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hypotheses {
    /// A template and a simple disjunction of its classes: what the robot of the paper could
    /// represent.
    #[default]
    Paper,
    /// Beyond the paper: also negations, conjunctions of different templates in one disjunction,
    /// numbers, and where a thing stands among the others, by description length.
    Extended,
}

/// What is done on conflict between the schema learned from the robot's own view and the one learned from the
/// teacher's perspective: the three policies that the paper names ("Task and Goal Learning").
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnConflict {
    /// The teacher's schema is followed, whatever speaks against it: the paper's evaluation.
    #[default]
    Human,
    /// The robot's own is.
    Own,
    /// The teacher's is where all that contradicts it is explained by what he could not know, or by what he
    /// says when he is asked; until then neither is.
    Resolve,
}

/// How hypotheses are made and weighed, and whose are followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// What a hypothesis can say.
    pub language: Hypotheses,
    /// The prior over the hypotheses of [`Hypotheses::Paper`].
    pub prior: Prior,
    /// [`Hypotheses::Extended`]: what a number or a relation costs, in nats. A literal costs 1,
    /// and its negation 1 more.
    pub selection_nats: f64,
    /// How often a teacher slips.
    pub noise: Noise,
    /// The share of the best posterior that a high-likelihood rule has at least.
    pub high_likelihood: f64,
    /// What is done where the robot's own view and the teacher's perspective differ.
    pub on_conflict: OnConflict,
}

impl Default for Settings {
    /// What the robot of the paper had.
    fn default() -> Self {
        Self {
            language: Hypotheses::Paper,
            prior: Prior::default(),
            selection_nats: 4.0,
            noise: Noise::NONE,
            high_likelihood: 0.01,
            on_conflict: OnConflict::Human,
        }
    }
}

/// The probability ε that a teacher treats one object of a demonstration otherwise than his rule
/// says: from 0 to below one half.
///
/// With 0 a demonstration is consistent with a hypothesis or not, and P(D|h) is the share of the
/// examples that are. Above, P(D|h) = Π ε or 1 - ε over the objects of all demonstrations that
/// were not already as the goal wants them.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Noise(f64);

/// A probability of slips that is none.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{0} is out of range: a teacher slips with a probability from 0 to below 0.5")]
pub struct NoiseOutOfRange(f64);

impl TryFrom<f64> for Noise {
    type Error = NoiseOutOfRange;

    fn try_from(value: f64) -> Result<Self, NoiseOutOfRange> {
        if (0.0..0.5).contains(&value) { Ok(Self(value)) } else { Err(NoiseOutOfRange(value)) }
    }
}

impl Noise {
    /// Teachers do not slip.
    pub const NONE: Self = Self(0.0);

    /// The probability.
    #[must_use]
    pub const fn get(self) -> f64 {
        self.0
    }

    /// Whether slips are reckoned with, and then ln ε and ln(1 - ε).
    pub(crate) fn logs(self) -> Option<(f64, f64)> {
        (self.0 > 0.0).then(|| (self.0.ln(), (-self.0).ln_1p()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_teacher_who_slips_every_other_time_teaches_nothing_and_is_refused() {
        for value in [-0.1, 0.5, 1.0, f64::NAN, f64::INFINITY] {
            assert!(Noise::try_from(value).is_err(), "{value}");
        }
        assert_eq!(Noise::try_from(0.0), Ok(Noise::NONE));
    }
}
