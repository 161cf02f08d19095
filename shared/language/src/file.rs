//! The raw form of a language file.

use std::collections::BTreeMap;

use serde::Deserialize;
use settings::Spanned;

use crate::act::ActKind;
use crate::replies::Replies;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// The number words from 0 on, separated by spaces.
    pub(crate) numbers: String,
    /// Words that say nothing, anywhere.
    pub(crate) fillers: Vec<String>,
    /// Phrases that say nothing at the beginning of a sentence.
    pub(crate) openers: Vec<String>,
    /// Phrases that say nothing at the end of a sentence.
    pub(crate) closers: Vec<String>,
    /// Words that negate: a sentence with one of them starts no movement.
    pub(crate) negations: Vec<String>,
    /// First words of questions and conditions: a sentence that begins with one of them starts no movement.
    pub(crate) questions: Vec<String>,
    /// First words of a question that is a polite request.
    pub(crate) requests: Vec<String>,
    /// Endings of the words for features, such as that of the plural.
    pub(crate) endings: Vec<String>,
    /// Phrases, and the phrases that they stand for: contractions, tenses, spellings.
    pub(crate) replace: BTreeMap<String, String>,
    pub(crate) stop: Stop,
    /// The words for features, by the name of the feature in the percepts.
    pub(crate) features: BTreeMap<String, Vec<String>>,
    /// Lists of phrases; each is a rule.
    pub(crate) lexicon: BTreeMap<Spanned<String>, Vec<String>>,
    pub(crate) rules: BTreeMap<Spanned<String>, Spanned<String>>,
    pub(crate) act: Vec<RawAct>,
    pub(crate) replies: Replies,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Stop {
    /// Words that stop always.
    pub(crate) words: Vec<String>,
    /// Phrases that stop always.
    pub(crate) phrases: Vec<String>,
    /// Words and phrases that stop a robot that moves.
    pub(crate) moving: Vec<String>,
    /// Phrases that negate a stop directly behind them.
    pub(crate) negated: Vec<String>,
    /// Words before a negated stop that make it a stop all the same: "if you do not stop".
    pub(crate) demands: Vec<String>,
    /// Words that resemble a stop word and are none.
    pub(crate) unlike: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawAct {
    pub(crate) kind: ActKind,
    /// What the whole sentence is like.
    pub(crate) rule: Spanned<String>,
    /// A sentence of this act, with `{task}`, `{name}` and `{object}`.
    pub(crate) say: Spanned<String>,
    /// Words that hint at this act in a sentence that is not understood.
    #[serde(default)]
    pub(crate) keys: String,
}
