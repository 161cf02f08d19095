use quantity::number::float_of_count;

use crate::Prior;

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
