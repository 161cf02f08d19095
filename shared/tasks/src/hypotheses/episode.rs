//! A demonstration as evidence about one goal.

use super::key::{Key, Mask, present};
use super::selection::Place;

/// What a demonstration says about one object with respect to one goal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Label {
    /// The goal state was reached for it: a positive example.
    Changed,
    /// It was in the goal state before: uninformative.
    AlreadyAchieved,
    /// It is not in the goal state: a negative example.
    LeftOut,
}

/// One object of a demonstration that a goal can apply to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LabeledObject {
    pub(crate) key: Key,
    pub(crate) label: Label,
    pub(crate) place: Option<Place>,
}

/// A demonstration in the form in which hypotheses about one goal are tested on it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Episode {
    pub(crate) labeled_objects: Vec<LabeledObject>,
    /// The distinct kinds of changed and of left-out objects, sorted.
    pub(crate) changed: Vec<ObjectKind>,
    pub(crate) left_out: Vec<ObjectKind>,
    /// Whether its objects are hypothetical: those of an answer or of a sentence.
    pub(crate) is_hypothetical: bool,
    /// The number of objects that a sentence says the rule applies to. Such an episode has no objects.
    pub(crate) count: Option<usize>,
}

/// A set of objects with identical class features.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ObjectKind {
    pub(crate) key: Key,
    /// The features that have a value.
    pub(crate) present: Mask,
}

impl Episode {
    pub(crate) fn new(labeled_objects: Vec<LabeledObject>) -> Self {
        let kinds = |label: Label| {
            let such = labeled_objects.iter().filter(|labeled| labeled.label == label);
            let mut kinds: Vec<ObjectKind> =
                such.map(|labeled| ObjectKind { key: labeled.key, present: present(labeled.key) }).collect();
            kinds.sort_unstable();
            kinds.dedup();
            kinds
        };
        let (changed, left_out) = (kinds(Label::Changed), kinds(Label::LeftOut));
        Self { labeled_objects, changed, left_out, is_hypothetical: false, count: None }
    }

    /// Whether the demonstration is consistent with a set of kinds: every changed object is covered, and no
    /// left-out object is. A number of objects is consistent with none.
    ///
    /// The paper demands that "the state change seen in the example is consistent with the goal
    /// representation". Without the second condition an over-general rule would always be consistent.
    pub(crate) fn is_consistent(&self, covers: impl Fn(ObjectKind) -> bool) -> bool {
        self.count.is_none()
            && self.changed.iter().all(|&kind| covers(kind))
            && !self.left_out.iter().any(|&kind| covers(kind))
    }
}
