//! The prior probability of a hypothesis.

use quantity::number::float_of_count;

/// The prior over hypotheses: log P(h) = -λ (K - 1) + μ (|T| + |E|), with K classes, |T|
/// criteria and |E| expectation features per class.
///
/// "Hypotheses whose goal states apply to the broadest object classes with the most specific
/// class descriptions are preferred (determined by number of classes and criteria/expectation
/// features, respectively)": the fewest classes first, then the most features.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// λ: the cost of an additional class.
    pub lambda: f64,
    /// μ: the gain of an additional feature.
    pub mu: f64,
}

impl Default for Prior {
    fn default() -> Self {
        Self { lambda: 4.0, mu: 0.5 }
    }
}

impl Prior {
    pub(crate) fn log(&self, classes: usize, features: usize) -> f64 {
        let more = float_of_count(classes.saturating_sub(1));
        self.mu.mul_add(float_of_count(features), -self.lambda * more)
    }
}

/// Prior weight of a disjunction of classes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Weight {
    /// The prior of the paper.
    Prior {
        prior: Prior,
        /// |E|.
        expected: usize,
    },
    /// Description length, one nat for each literal. Disjunctions with at most `beyond` literals have weight
    /// zero, because the enumerated descriptions already contain them.
    Length { beyond: usize },
}

impl Weight {
    /// log P(h) of a disjunction of `classes` classes under a template of `features` features.
    pub(crate) fn log(&self, classes: usize, features: usize) -> f64 {
        match self {
            Self::Prior { prior, expected } => prior.log(classes, features + expected),
            Self::Length { beyond } => {
                let literals = classes * features;
                if literals > *beyond { -float_of_count(literals) } else { f64::NEG_INFINITY }
            }
        }
    }

    /// Upper bound on log P(h) for at least `classes` classes under a template with at least `features` and at
    /// most `max` features.
    pub(crate) fn bound(&self, classes: usize, features: usize, max: usize) -> f64 {
        match self {
            // With λ < 0 more classes have a higher prior, so there is no bound.
            Self::Prior { prior, .. } if prior.lambda < 0.0 => f64::INFINITY,
            Self::Prior { prior, expected } => {
                prior.log(classes, features + expected).max(prior.log(classes, max + expected))
            }
            Self::Length { .. } => -float_of_count(classes.saturating_mul(features)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_holds_for_more_classes_and_more_features() {
        let prior = Weight::Prior { prior: Prior::default(), expected: 1 };
        for weight in [prior, Weight::Length { beyond: 3 }] {
            for (classes, features) in [(1, 0), (1, 2), (3, 1), (4, 4)] {
                let bound = weight.bound(classes, features, 6);
                for more in classes..9 {
                    assert!((features..=6).all(|larger| weight.log(more, larger) <= bound));
                }
            }
        }
    }
}
