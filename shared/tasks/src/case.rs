use crate::lexicon::{Key, Mask, present};
use crate::selection::Place;

/// What a demonstration says about one object with respect to one goal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// The goal state was reached for it: a positive example.
    Changed,
    /// It was in the goal state before: uninformative.
    AlreadySo,
    /// It is not in the goal state: a negative example.
    LeftOut,
}

/// One object of a demonstration that a goal can apply to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Witness {
    pub(crate) key: Key,
    pub(crate) verdict: Verdict,
    pub(crate) place: Option<Place>,
}

/// A demonstration in the form in which hypotheses about one goal are tested on it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Case {
    pub(crate) witnesses: Vec<Witness>,
    /// The distinct kinds of changed and of left-out objects, sorted.
    pub(crate) changed: Vec<Kind>,
    pub(crate) left_out: Vec<Kind>,
    /// Whether this is the answer to a question about a single hypothetical object.
    pub(crate) is_answer: bool,
}

/// A set of objects with identical class features.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Kind {
    pub(crate) key: Key,
    /// The features that have a value.
    pub(crate) present: Mask,
}

impl Case {
    pub(crate) fn new(witnesses: Vec<Witness>) -> Self {
        let kinds = |verdict: Verdict| {
            let such = witnesses.iter().filter(|witness| witness.verdict == verdict);
            let mut kinds: Vec<Kind> =
                such.map(|witness| Kind { key: witness.key, present: present(witness.key) }).collect();
            kinds.sort_unstable();
            kinds.dedup();
            kinds
        };
        let (changed, left_out) = (kinds(Verdict::Changed), kinds(Verdict::LeftOut));
        Self { witnesses, changed, left_out, is_answer: false }
    }

    /// Whether the demonstration is consistent with a set of kinds: every changed object is covered, and no
    /// left-out object is.
    ///
    /// The paper demands that "the state change seen in the example is consistent with the goal
    /// representation". Without the second condition an over-general rule would always be consistent.
    pub(crate) fn is_consistent(&self, covers: impl Fn(Kind) -> bool) -> bool {
        self.changed.iter().all(|&kind| covers(kind)) && !self.left_out.iter().any(|&kind| covers(kind))
    }
}
