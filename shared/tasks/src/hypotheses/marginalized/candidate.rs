//! The disjunctions of a template in the order of their weight.

use std::cmp::Ordering;

use crate::hypotheses::key::{Key, Mask};

/// The classes of one template, by ln g.
pub(super) struct TemplateClasses {
    pub(super) mask: Mask,
    /// Ascending by |ln g|: the cost of flipping the membership of a class.
    pub(super) classes: Vec<(Key, f64)>,
    /// The log weight of its best disjunction, including the empty one.
    pub(super) log_root: f64,
}

impl TemplateClasses {
    /// The classes of the best disjunction, with the membership of some classes flipped.
    pub(super) fn chosen(&self, changed: &[usize]) -> Vec<Key> {
        let chosen = self.classes.iter().enumerate();
        let chosen = chosen.filter(|(index, (_, gain))| (*gain > 0.0) != changed.contains(index));
        let mut classes: Vec<Key> = chosen.map(|(_, (class, _))| *class).collect();
        classes.sort_unstable();
        classes
    }
}

/// A disjunction in the priority queue, ordered by weight.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Candidate {
    pub(super) log_weight: f64,
    pub(super) table: usize,
    /// Indices of the flipped classes, ascending.
    pub(super) changed: Vec<usize>,
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_weight = self.log_weight.total_cmp(&other.log_weight);
        by_weight.then_with(|| (other.table, &other.changed).cmp(&(self.table, &self.changed)))
    }
}

impl Candidate {
    /// The two successors: one more class flipped, or the last flip moved to the next class. Every disjunction is the
    /// successor of exactly one other, and is never heavier than it.
    pub(super) fn next(&self, table: &TemplateClasses) -> impl Iterator<Item = Self> {
        let cost = |index: usize| table.classes.get(index).map(|(_, gain)| gain.abs());
        let last = self.changed.last().copied();
        let next = last.map_or(0, |last| last + 1);
        let more = cost(next).map(|cost| Self {
            log_weight: self.log_weight - cost,
            table: self.table,
            changed: self.changed.iter().copied().chain([next]).collect(),
        });
        let moved = last.zip(cost(next)).and_then(|(last, new)| {
            let kept = self.changed.iter().copied().filter(move |&index| index != last);
            let log_weight = self.log_weight + cost(last)? - new;
            Some(Self { log_weight, table: self.table, changed: kept.chain([next]).collect() })
        });
        more.into_iter().chain(moved)
    }
}
