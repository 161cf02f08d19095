//! What was learned of a task in one perspective.

use std::collections::{BTreeMap, BTreeSet};

use super::arrangement::ArrangementRule;
use super::rule::Rule;
use crate::demonstration::Signature;

/// The result of learning a task from the examples of one perspective.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Learned {
    /// Number of examples of the perspective.
    pub examples: usize,
    /// The rules of every goal belief of the task, best first; the first is the primary one.
    pub goals: Vec<Vec<Rule>>,
    /// Spatial configurations, best first, if the goal is an arrangement of objects.
    pub arrangements: Vec<ArrangementRule>,
    /// The remaining changes: the means to the goals.
    pub means: Vec<Means>,
}

impl Learned {
    /// The primary rule of every goal belief.
    pub fn primary(&self) -> impl Iterator<Item = &Rule> {
        self.goals.iter().filter_map(|rules| rules.first())
    }

    /// The number of examples that its primary rules, or else its first figure, are consistent with. If it is
    /// smaller than the number of examples, no rule explains all of them.
    #[must_use]
    pub fn tally(&self) -> usize {
        let rules = self.primary().map(|rule| rule.standing.tally).min();
        rules.or_else(|| self.arrangements.first().map(|arrangement| arrangement.standing.tally)).unwrap_or(0)
    }

    /// Whether anything was learned.
    #[must_use]
    pub fn explains(&self) -> bool {
        !self.goals.is_empty() || !self.arrangements.is_empty()
    }
}

/// Changes to *some* objects of a kind: a peg goes into every hole, and any peg will do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Means {
    /// The signature of the change.
    pub signature: Signature,
    /// The class features of the objects that changed.
    pub kinds: BTreeSet<BTreeMap<String, String>>,
}
