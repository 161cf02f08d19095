//! A hypothesis with its score.

use super::key::{Key, Mask};
use super::selection::Selection;

/// Scores closer than this, in nats, are a tie: the difference is rounding.
pub(crate) const TIE: f64 = 1e-9;

/// A goal hypothesis about one signature: the selected objects of these classes shall be in the expected state.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hypothesis {
    pub(crate) mask: Mask,
    /// Ascending; each is a key masked by the template.
    pub(crate) classes: Vec<Key>,
    pub(crate) selection: Selection,
    /// Number of examples that it is consistent with.
    pub(crate) tally: usize,
    /// log P(D|h) P(h).
    pub(crate) log_score: f64,
    /// Its description, unless it is a listing of its classes.
    pub(crate) description: Option<Described>,
}

/// A description of classes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Described {
    /// Number of literals and negations.
    pub(crate) cost: usize,
    /// Index of the description.
    pub(crate) set: usize,
}

/// The relevant hypotheses, and the sum over all hypotheses.
#[derive(Clone, Debug)]
pub(crate) struct Scored {
    pub(crate) hypotheses: Vec<Hypothesis>,
    /// The logarithm of the sum of P(D|h) P(h) over all hypotheses of the language.
    pub(crate) log_total: f64,
}
