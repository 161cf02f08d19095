//! Selects the next question or request for a demonstration, by expected information gain.

use std::collections::BTreeMap;

use invariant::require;

use crate::demonstration::{Effect, Signature};
use crate::hypotheses::{
    Hypothesis, Key, Lexicon, MAX_FEATURES, Mask, Noise, Scored, SeenKinds, Selection, field, has, key_mask,
    present, reduce, with_field,
};
use crate::language::{Language, listed, with_article};

/// Maximum number of objects in an inquiry.
const MAX_OBJECTS: usize = 6;
/// Maximum number of candidate kinds.
const MAX_KINDS: usize = 4096;
/// Minimum expected information gain of an object, in bits.
const MIN_GAIN_BITS: f64 = 1e-3;

/// A query: the objects whose treatment by the teacher discriminates best among the hypotheses.
#[derive(Clone, Debug, PartialEq)]
pub struct Inquiry {
    /// Their class features.
    pub objects: Vec<BTreeMap<String, String>>,
    /// The probability, for each object, that the rule applies to it, among the hypotheses about all objects of
    /// their classes.
    pub probabilities: Vec<f64>,
    /// The expected information gain: the expected decrease of the posterior's entropy.
    pub bits: f64,
    /// The question: "Should a blue one be filled, too?"
    pub text: String,
}

/// The context of a query.
pub(crate) struct QueryContext<'a> {
    pub(crate) language: &'a Language,
    pub(crate) lexicon: &'a Lexicon,
    pub(crate) signature: &'a Signature,
    pub(crate) seen: &'a SeenKinds,
    pub(crate) noise: Noise,
}

/// A hypothesis with its normalised weight.
struct Weighed<'a> {
    hypothesis: &'a Hypothesis,
    key_mask: Key,
    weight: f64,
}

impl Weighed<'_> {
    fn covers(&self, key: Key) -> bool {
        present(key) & self.hypothesis.mask == self.hypothesis.mask
            && self.hypothesis.classes.binary_search(&(key & self.key_mask)).is_ok()
    }
}

/// Greedily selects the most informative objects, at most `max`; `None` if no object is informative.
///
/// Hypotheses about numbers and relations make no prediction for a single object. The gain is computed over the other
/// hypotheses and scaled by their share of the posterior.
pub(crate) fn inquire(asking: &QueryContext<'_>, scored: &Scored, max: usize) -> Option<Inquiry> {
    let best = scored.hypotheses.iter().map(|one| one.log_score).fold(f64::NEG_INFINITY, f64::max);
    let all: f64 = scored.hypotheses.iter().map(|one| (one.log_score - best).exp()).sum();
    let about_all = scored.hypotheses.iter().filter(|one| one.selection == Selection::All);
    let mut weighed: Vec<Weighed<'_>> = about_all
        .map(|one| Weighed {
            hypothesis: one,
            key_mask: key_mask(one.mask),
            weight: (one.log_score - best).exp(),
        })
        .collect();
    let sum: f64 = weighed.iter().map(|one| one.weight).sum();
    if !(sum > 0.0 && all > 0.0) {
        return None;
    }
    weighed.iter_mut().for_each(|one| one.weight /= sum);
    let kinds = kinds(asking.seen);
    let mut chosen: Vec<Key> = Vec::new();
    // For each hypothesis, a bit mask of the chosen objects that it applies to.
    let mut labels = vec![0_usize; weighed.len()];
    let mut bits = 0.0;
    while chosen.len() < max.min(MAX_OBJECTS) {
        let bit = 1_usize << chosen.len();
        let with = |key: Key| -> Vec<usize> {
            let label = |(one, label): (&Weighed<'_>, &usize)| label | if one.covers(key) { bit } else { 0 };
            weighed.iter().zip(&labels).map(label).collect()
        };
        let mut found: Option<(f64, Key)> = None;
        for &key in kinds.iter().filter(|key| !chosen.contains(key)) {
            let gain = gain(&weighed, &with(key), bit << 1, asking.noise);
            // Among equal gains the first one wins, independent of rounding.
            if found.is_none_or(|(max, _)| gain > max + MIN_GAIN_BITS) {
                found = Some((gain, key));
            }
        }
        let Some((gain, key)) = found.filter(|(gain, _)| *gain > bits + MIN_GAIN_BITS) else { break };
        labels = with(key);
        bits = gain;
        chosen.push(key);
    }
    if chosen.is_empty() {
        return None;
    }
    let probability =
        |key: &Key| -> f64 { weighed.iter().filter(|one| one.covers(*key)).map(|one| one.weight).sum() };
    Some(Inquiry {
        objects: chosen.iter().map(|&key| features(asking.lexicon, key)).collect(),
        probabilities: chosen.iter().map(|key| probability(key).clamp(0.0, 1.0)).collect(),
        bits: bits * sum / all,
        text: text(asking, &weighed, &chosen),
    })
}

/// The mutual information, in bits, between the hypotheses and the teacher's treatment of the objects:
/// H(done) - H(done | hypothesis). The teacher mislabels each object independently.
fn gain(weighed: &[Weighed<'_>], labels: &[usize], outcomes: usize, noise: Noise) -> f64 {
    let mut done = vec![0.0; outcomes];
    for (one, &label) in weighed.iter().zip(labels) {
        if let Some(probability) = require!(done.get_mut(label), "outcome {label} exists") {
            *probability += one.weight;
        }
    }
    let slip = noise.get();
    let mut bit = 1;
    let mut certain = 0.0;
    while bit < outcomes {
        let flipped = |index: usize| done.get(index ^ bit).copied().unwrap_or(0.0);
        done = done
            .iter()
            .enumerate()
            .map(|(index, p)| (1.0 - slip).mul_add(*p, slip * flipped(index)))
            .collect();
        certain += entropy(&[slip, 1.0 - slip]);
        bit <<= 1;
    }
    (entropy(&done) - certain).max(0.0)
}

/// The entropy in bits.
fn entropy(probabilities: &[f64]) -> f64 {
    -probabilities.iter().filter(|p| **p > 0.0).map(|p| p * p.log2()).sum::<f64>()
}

/// All kinds of objects made of the values seen, or only the kinds seen if there are too many; in the order of the
/// values' first appearance.
fn kinds(seen: &SeenKinds) -> Vec<Key> {
    let count =
        seen.values().iter().try_fold(1_usize, |count, values| count.checked_mul(values.len().max(1)));
    if count.is_none_or(|count| count > MAX_KINDS) {
        let mut kinds = seen.kinds();
        kinds.truncate(MAX_KINDS);
        return kinds;
    }
    let mut kinds: Vec<Key> = vec![0];
    for (feature, values) in seen.values().iter().enumerate().filter(|(_, values)| !values.is_empty()) {
        let with = |key: Key| values.iter().map(move |&value| with_field(key, feature, value));
        kinds = kinds.into_iter().flat_map(with).collect();
    }
    kinds
}

fn features(lexicon: &Lexicon, key: Key) -> BTreeMap<String, String> {
    let held = (0..lexicon.features()).filter(|&feature| field(key, feature) != 0);
    held.map(|feature| {
        (lexicon.feature(feature).to_owned(), lexicon.value(feature, field(key, feature)).to_owned())
    })
    .collect()
}

fn text(asking: &QueryContext<'_>, weighed: &[Weighed<'_>], chosen: &[Key]) -> String {
    // The name contains only features that a plausible hypothesis tests.
    let max = weighed.iter().map(|one| one.weight).fold(0.0, f64::max);
    let heavy = weighed.iter().filter(|one| one.weight >= max * 0.05);
    let mask = heavy
        .map(|one| reduce(one.hypothesis.mask, one.hypothesis.classes.clone(), asking.seen).0)
        .fold(0, |mask, more| mask | more);
    let names: Vec<String> = chosen.iter().map(|&key| name(asking, mask, key)).collect();
    match names.as_slice() {
        [only] => ask_about(only, asking.signature),
        several => format!("Which should {} of {}?", verb_phrase(asking.signature), listed(several)),
    }
}

/// The question whether an object should be in the state of a goal: "Should a blue one be filled, too?" `name` is
/// the object with its article, "a blue one".
#[must_use]
pub fn ask_about(name: &str, goal: &Signature) -> String {
    format!("Should {name} {}, too?", verb_phrase(goal))
}

fn verb_phrase(goal: &Signature) -> String {
    let effects = goal.iter().map(|effect| match effect {
        Effect::State { name, on: true } => format!("be {name}"),
        Effect::State { name, on: false } => format!("not be {name}"),
        Effect::Moved => "be moved".to_owned(),
    });
    listed(&effects.collect::<Vec<_>>())
}

/// "a blue one", "an old square".
fn name(asking: &QueryContext<'_>, mask: Mask, key: Key) -> String {
    let last = asking.language.features.len().saturating_sub(1);
    let mut words: Vec<&str> = Vec::new();
    let mut has_noun = false;
    for (index, feature) in asking.language.features.iter().enumerate() {
        let number = (0..MAX_FEATURES).find(|&number| asking.lexicon.feature(number) == feature.name);
        let Some(number) = number.filter(|&number| has(mask, number) && field(key, number) != 0) else {
            continue;
        };
        words.push(asking.lexicon.value(number, field(key, number)));
        has_noun |= index == last;
    }
    if words.is_empty() {
        return "another one".to_owned();
    }
    if !has_noun {
        words.push("one");
    }
    with_article(&words.join(" "))
}
