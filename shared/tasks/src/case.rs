use crate::lexicon::{Key, Mask, present};
use crate::selection::Place;

/// What a demonstration says of one object, as far as one goal is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// It was made what the goal wants: the goal is about it.
    Changed,
    /// It was as the goal wants before: it says nothing.
    AlreadySo,
    /// It is not as the goal wants: the goal is not about it.
    LeftOut,
}

/// One object of a demonstration that a goal could be about.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Witness {
    pub(crate) key: Key,
    pub(crate) verdict: Verdict,
    pub(crate) place: Option<Place>,
}

/// A demonstration as hypotheses about one goal are tested on it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Case {
    pub(crate) witnesses: Vec<Witness>,
    /// The kinds of what was changed, and of what was left out; each once.
    pub(crate) changed: Vec<Kind>,
    pub(crate) left_out: Vec<Kind>,
    /// Whether it is what was answered about a single thing that is nowhere.
    pub(crate) is_answer: bool,
}

/// Objects that look the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Kind {
    pub(crate) key: Key,
    /// The features that they have.
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

    /// Whether the demonstration is consistent with a set of kinds: everything in it was changed
    /// or so before, and nothing else was changed.
    ///
    /// The paper asks that "the state change seen in the example is consistent with the goal
    /// representation"; without the second half a rule about fewer objects would always do.
    pub(crate) fn is_consistent(&self, covers: impl Fn(Kind) -> bool) -> bool {
        self.changed.iter().all(|&kind| covers(kind)) && !self.left_out.iter().any(|&kind| covers(kind))
    }
}
