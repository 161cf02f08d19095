//! The results of learning from examples.

use std::collections::BTreeMap;

use tasks::{Inquiry, Learned, OpenQuestion, Signature};

use super::examples::InputExample;

/// The results for an example.
pub(super) struct ExampleResult<'a> {
    pub(super) shown: &'a InputExample,
    /// Its number, from 1.
    pub(super) number: usize,
    /// What each perspective that saw it has learned from all examples so far.
    pub(super) learned: BTreeMap<u16, Learned>,
    pub(super) answers: Vec<Answer>,
}

/// A perspective's probabilities that its rule about a goal holds, one for each object asked about.
pub(super) struct Answer {
    pub(super) perspective: u16,
    pub(super) goal: Signature,
    pub(super) probabilities: Vec<Option<f64>>,
}

/// The final results.
pub(super) struct Conclusion {
    /// The perspective whose rules Leo would follow, and the rules.
    pub(super) followed: Option<(u16, Learned)>,
    /// The question to ask before any rules are followed.
    pub(super) open_question: Option<OpenQuestion>,
    /// Per goal, the question and the demonstration to ask the teacher for.
    pub(super) inquiries: Vec<(Signature, Option<Inquiry>, Option<Inquiry>)>,
}
