//! The changes of one signature over all demonstrations, and the engine for the hypotheses about them.

use std::collections::{BTreeMap, BTreeSet};

use super::enumerated::EnumeratedDnf;
use super::episode::{Episode, Label, LabeledObject};
use super::extended::{Cost, Extended};
use super::hypothesis::Scored;
use super::key::Key;
use super::lexicon::Lexicon;
use super::log_sum::LogSum;
use super::marginalized::MarginalizedDisjunctions;
use super::prior::Weight;
use super::seen_kinds::SeenKinds;
use super::selection::Place;
use super::settings::{HypothesisLanguage, Settings};
use crate::demonstration::{Change, Object, Signature, has_percepts, is_achieved};
use crate::language::Language;

/// A demonstration as one perspective saw it.
#[derive(Clone, Debug)]
pub(crate) struct Demonstration {
    /// The objects at its end.
    pub(crate) objects: Vec<DemonstratedObject>,
    /// Whether its objects are hypothetical: those of an answer or of a sentence.
    pub(crate) is_hypothetical: bool,
    /// The number of objects that a sentence says the rule applies to.
    pub(crate) count: Option<usize>,
}

/// An object of a demonstration.
#[derive(Clone, Debug)]
pub(crate) struct DemonstratedObject {
    pub(crate) object: Object,
    pub(crate) key: Key,
    pub(crate) change: Option<Change>,
    /// Its position before the demonstration.
    pub(crate) place: Option<Place>,
}

/// A candidate goal belief: the changes of one signature over all demonstrations, and the hypotheses about them.
#[derive(Clone, Debug)]
pub(crate) struct GoalBelief {
    pub(crate) signature: Signature,
    /// Whether every object with this change was displaced as well.
    pub(crate) is_displaced: bool,
    /// The class features of the objects with this change.
    pub(crate) kinds: BTreeSet<BTreeMap<String, String>>,
    pub(crate) seen: SeenKinds,
    episodes: Vec<Episode>,
    engine: Engine,
}

#[derive(Clone, Debug)]
enum Engine {
    Paper(EnumeratedDnf),
    PaperWithNoise(MarginalizedDisjunctions),
    /// The enumerated short descriptions, and the longer disjunctions of the paper.
    Extended(Box<Extended>, EnumeratedDnf),
}

impl GoalBelief {
    pub(crate) fn new(signature: &Signature, lexicon: &Lexicon, settings: &Settings) -> Self {
        let seen = SeenKinds::new(lexicon.features());
        let engine = match (settings.language, settings.noise.logs()) {
            (HypothesisLanguage::Paper, None) => Engine::Paper(EnumeratedDnf::new(lexicon.features())),
            (HypothesisLanguage::Paper, Some(_)) => {
                Engine::PaperWithNoise(MarginalizedDisjunctions::default())
            }
            (HypothesisLanguage::Extended, _) => {
                let short = Extended::new(lexicon, &seen);
                Engine::Extended(Box::new(short), EnumeratedDnf::new(lexicon.features()))
            }
        };
        Self {
            signature: signature.clone(),
            is_displaced: true,
            kinds: BTreeSet::new(),
            seen,
            episodes: Vec::new(),
            engine,
        }
    }

    /// Adds a demonstration.
    pub(crate) fn add(&mut self, demonstration: &Demonstration, lexicon: &Lexicon) {
        let mut labeled_objects = Vec::new();
        let mut is_new = false;
        for DemonstratedObject { object, key, change, place } in &demonstration.objects {
            if !has_percepts(object, &self.signature) {
                continue;
            }
            let displaced = change.as_ref().is_some_and(|change| change.displaced);
            let label = if change.as_ref().is_some_and(|change| change.signature == self.signature) {
                // An answer or a sentence is about an object without a place.
                self.is_displaced &= displaced || demonstration.is_hypothetical;
                self.kinds.insert(object.features.clone());
                Label::Changed
            } else if is_achieved(object, &self.signature, displaced) {
                Label::AlreadyAchieved
            } else {
                Label::LeftOut
            };
            is_new |= self.seen.register(*key);
            labeled_objects.push(LabeledObject { key: *key, label, place: *place });
        }
        let Demonstration { is_hypothetical, count, .. } = *demonstration;
        self.episodes.push(Episode { is_hypothetical, count, ..Episode::new(labeled_objects) });
        if let Engine::Extended(short, _) = &mut self.engine
            && is_new
        {
            // New values allow new descriptions; they are tested on all examples again.
            **short = Extended::new(lexicon, &self.seen);
        }
    }

    /// The hypotheses at most `max_gap_nats` nats below the best one, or below the best one of the highest tally;
    /// limited to about `max_count`.
    pub(crate) fn hypotheses(
        &mut self,
        lexicon: &Lexicon,
        settings: &Settings,
        max_gap_nats: f64,
        max_count: usize,
    ) -> Scored {
        let Self { episodes, seen, engine, signature, .. } = self;
        let (prior, label_errors, expected) = (settings.prior, settings.noise.logs(), signature.len());
        match engine {
            Engine::Paper(all) => {
                all.hypotheses(episodes, seen, &Weight::Prior { prior, expected }, max_gap_nats, max_count)
            }
            Engine::PaperWithNoise(all) => {
                let label_errors = label_errors.unwrap_or_default();
                all.hypotheses(episodes, lexicon.features(), &prior, expected, label_errors, max_gap_nats)
            }
            Engine::Extended(short, long) => {
                let cost = Cost { selection_nats: settings.selection_nats, label_errors };
                short.take(episodes, &cost);
                let mut scored = short.hypotheses(seen, &cost, max_gap_nats, max_count);
                if label_errors.is_none() {
                    let weight = Weight::Length { beyond: short.longest() };
                    let more = long.hypotheses(episodes, seen, &weight, max_gap_nats, max_count);
                    let mut total = LogSum::default();
                    total.add(scored.log_total);
                    total.add(more.log_total);
                    scored.log_total = total.value();
                    scored.hypotheses.extend(more.hypotheses);
                }
                scored
            }
        }
    }

    /// The words of a description of the extended language. Empty for the other languages, which have none.
    pub(crate) fn phrase(&self, set: usize, language: &Language, lexicon: &Lexicon) -> String {
        match &self.engine {
            Engine::Extended(short, _) => {
                short.phrase(set, lexicon, |feature| language.feature_order(feature))
            }
            Engine::Paper(_) | Engine::PaperWithNoise(_) => String::new(),
        }
    }

    /// Log-likelihood of the labels without a rule, if all changes were mistakes; `None` without label noise.
    pub(crate) fn log_likelihood_of_noise(&self, settings: &Settings) -> Option<f64> {
        let (log_error, log_correct) = settings.noise.logs()?;
        let labeled_objects = self.episodes.iter().flat_map(|episode| &episode.labeled_objects);
        let log = |label: Label| match label {
            Label::Changed => log_error,
            Label::LeftOut => log_correct,
            Label::AlreadyAchieved => 0.0,
        };
        Some(labeled_objects.map(|labeled| log(labeled.label)).sum())
    }

    /// The probability that the rule applies to each of some objects.
    pub(crate) fn probabilities(
        &mut self,
        lexicon: &Lexicon,
        settings: &Settings,
        asked: &[(Key, Option<Place>)],
    ) -> Vec<f64> {
        let label_errors = settings.noise.logs();
        let keys: Vec<Key> = asked.iter().map(|(key, _)| *key).collect();
        match &mut self.engine {
            Engine::PaperWithNoise(all) => {
                let label_errors = label_errors.unwrap_or_default();
                all.probabilities(&self.episodes, lexicon.features(), &settings.prior, label_errors, &keys)
            }
            Engine::Extended(short, long) => {
                let cost = Cost { selection_nats: settings.selection_nats, label_errors };
                short.take(&self.episodes, &cost);
                let (log_total, answers) = short.probabilities(&cost, asked);
                if label_errors.is_some() {
                    return answers;
                }
                let weight = Weight::Length { beyond: short.longest() };
                let (log_long, long) = long.probabilities(&self.episodes, &self.seen, &weight, &keys);
                let mut total = LogSum::default();
                total.add(log_total);
                total.add(log_long);
                let (short, long_share) = (share(log_total, total.value()), share(log_long, total.value()));
                let both = answers.into_iter().zip(long);
                both.map(|(answer, long)| short.mul_add(answer, long_share * long).clamp(0.0, 1.0)).collect()
            }
            Engine::Paper(all) => {
                let weight = Weight::Prior { prior: settings.prior, expected: self.signature.len() };
                let (_, about) = all.probabilities(&self.episodes, &self.seen, &weight, &keys);
                about.into_iter().map(|share| share.clamp(0.0, 1.0)).collect()
            }
        }
    }
}

/// e^(log - total), or 0 for a log of -∞.
fn share(log: f64, log_total: f64) -> f64 {
    if log > f64::NEG_INFINITY { (log - log_total).exp() } else { 0.0 }
}
