use std::collections::{BTreeMap, BTreeSet};

use crate::change::{has_percepts, is_achieved};
use crate::lexicon::{Key, Mask};
use crate::{Change, Object, Selection, Signature, Snapshot};

/// Scores closer than this, in nats, are a tie: the difference is rounding.
pub(crate) const TIE: f64 = 1e-9;

/// The class features that a hypothesis tests, T ⊆ F, in alphabetical order.
pub type Template = Vec<String>;

/// A class of objects: the values of the features of a template, in the template's order.
pub type Class = Vec<String>;

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
        let more = quantity::number::float_of_count(classes.saturating_sub(1));
        self.mu.mul_add(quantity::number::float_of_count(features), -self.lambda * more)
    }
}

/// A demonstration in the form in which hypotheses about one signature are tested on it.
#[derive(Clone, Debug)]
pub(crate) struct Evidence<'a> {
    pub(crate) after: &'a Snapshot,
    pub(crate) changes: BTreeMap<u64, Change>,
}

impl<'a> Evidence<'a> {
    /// The objects at the end that have the percepts of this signature.
    pub(crate) fn eligible(&self, signature: &Signature) -> impl Iterator<Item = &'a Object> {
        self.after.objects.iter().filter(move |object| has_percepts(object, signature))
    }

    /// The objects whose change has exactly this signature.
    pub(crate) fn changed(&self, signature: &Signature) -> impl Iterator<Item = &'a Object> {
        self.eligible(signature).filter(move |object| {
            self.changes.get(&object.id).is_some_and(|change| change.signature == *signature)
        })
    }

    /// Whether an object is in the expected state at the end.
    pub(crate) fn achieved(&self, object: &Object, signature: &Signature) -> bool {
        let moved = self.changes.get(&object.id).is_some_and(|change| change.displaced);
        is_achieved(object, signature, moved)
    }
}

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

/// The class of an object under a template; `None` if it lacks a feature.
pub(crate) fn class_of(object: &Object, template: &Template) -> Option<Class> {
    template.iter().map(|feature| object.features.get(feature).cloned()).collect()
}

/// Whether an object belongs to one of the classes.
pub(crate) fn belongs(object: &Object, template: &Template, classes: &BTreeSet<Class>) -> bool {
    class_of(object, template).is_some_and(|class| classes.contains(&class))
}
