use std::collections::BTreeSet;

use crate::change::{has_percepts, is_achieved};
use crate::hypothesis::belongs;
use crate::{Class, Object, Signature, Snapshot, Template};

/// What Leo takes a teacher to have meant: all objects of these classes shall be as the
/// expectation says.
///
/// A rule stands for all the hypotheses that say the same of every object made of the feature
/// values seen: its template has no feature that could be dropped.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// What is expected of the objects.
    pub expectation: Signature,
    /// The class features that it looks at.
    pub template: Template,
    /// The classes, a simple disjunction.
    pub classes: BTreeSet<Class>,
    /// Examples that it is consistent with.
    pub tally: usize,
    /// Examples seen.
    pub examples: usize,
    /// Posterior probability, that of all its hypotheses together.
    pub posterior: f64,
    /// Rank from 1; rules that tie share their rank.
    pub rank: usize,
    /// Whether its tally is the highest, and its posterior not far below the best.
    pub high_likelihood: bool,
    /// What people would call it, computed from its classes and what else was seen.
    pub name: String,
}

impl Rule {
    /// Whether it is about an object: the object is of one of the classes and has what the
    /// expectation is about.
    #[must_use]
    pub fn is_about(&self, object: &Object) -> bool {
        has_percepts(object, &self.expectation) && belongs(object, &self.template, &self.classes)
    }

    /// Whether an object is as the rule wants it. Movements count as done: whether a thing has
    /// moved cannot be seen in one snapshot.
    #[must_use]
    pub fn is_done(&self, object: &Object) -> bool {
        is_achieved(object, &self.expectation, true)
    }

    /// The objects that the rule is about and that are not yet as it wants them. The goal is
    /// achieved when there are none ("all objects with the criteria features must match the
    /// expectation features").
    pub fn open<'a>(&'a self, snapshot: &'a Snapshot) -> impl Iterator<Item = &'a Object> {
        snapshot.objects.iter().filter(|object| self.is_about(object) && !self.is_done(object))
    }

    /// Whether two rules say the same.
    #[must_use]
    pub fn agrees_with(&self, other: &Self) -> bool {
        self.expectation == other.expectation
            && self.template == other.template
            && self.classes == other.classes
    }
}
