//! The paper's hypotheses with label noise: every simple disjunction of the classes seen, marginalized in closed form.

mod candidate;
mod partition;
mod scale;

use std::collections::{BTreeMap, BinaryHeap};

use candidate::{Candidate, TemplateClasses};
use invariant::require;
use partition::{Classes, EvidenceCount, Member, each_template};
use rustc_hash::FxHashMap;
use scale::{ClassTotals, NEGLIGIBLE_NATS, PriorScale, net, softplus};

use super::episode::{Episode, Label};
use super::hypothesis::{Hypothesis, Scored, TIE};
use super::key::{Key, Mask, key_mask, present};
use super::log_sum::LogSum;
use super::prior::Prior;
use super::selection::Selection;

/// Templates with at most this many features are visited first.
const FIRST_PASS_FEATURES: u32 = 2;
/// Maximum number of hypotheses returned.
const MAX_HYPOTHESES: usize = 1024;
/// Maximum number of cached tallies.
const MAX_CACHED_TALLIES: usize = 4096;

/// All simple disjunctions C of the classes seen, under every template T, in closed form.
///
/// With label noise ε, P(D|h) is a product over the objects, and hence over the classes. For a class with p(c)
/// changed and q(c) left-out objects, the log-odds of being in C are
///
/// ln g(c) = (p(c) - q(c)) ln((1 - ε) / ε) - λ,
///
/// and the sum of P(D|h) P(h) over all C ≠ ∅ of a template is a constant times
/// Π (1 + g(c)) - 1. Only the best hypotheses are enumerated.
///
/// A template with more features refines the classes. A refinement never has fewer classes with a changed object. Each
/// contributes at most the log-odds of its changed objects minus κ. Here κ = ln((1 - ε) / ε) - ln(1 + g), with g of a
/// class with one changed object. This bounds all refinements of a template. Refinements below the rounding error
/// of the sum are pruned.
#[derive(Clone, Debug, Default)]
pub(crate) struct MarginalizedDisjunctions {
    /// By kind, the numbers of changed and left-out objects.
    counts: BTreeMap<Key, (u64, u64)>,
    taken: usize,
    tallies: FxHashMap<(Mask, Vec<Key>), (usize, usize)>,
}

impl MarginalizedDisjunctions {
    fn take(&mut self, episodes: &[Episode]) {
        for labeled in episodes.iter().skip(self.taken).flat_map(|episode| &episode.labeled_objects) {
            let count = self.counts.entry(labeled.key).or_default();
            match labeled.label {
                Label::Changed => count.0 += 1,
                Label::LeftOut => count.1 += 1,
                Label::AlreadyAchieved => {}
            }
        }
        self.taken = episodes.len();
    }

    fn table(&self, mask: Mask, scale: &PriorScale) -> TemplateClasses {
        let bits = key_mask(mask);
        let mut nets: FxHashMap<Key, i64> = FxHashMap::default();
        for (&key, &count) in self.counts.iter().filter(|(key, _)| present(**key) & mask == mask) {
            *nets.entry(key & bits).or_default() += net(count);
        }
        let mut classes: Vec<(Key, f64)> =
            nets.into_iter().map(|(class, net)| (class, scale.gain(net).0)).collect();
        classes.sort_unstable_by(|a, b| a.1.abs().total_cmp(&b.1.abs()).then(a.0.cmp(&b.0)));
        let above: f64 = classes.iter().map(|(_, gain)| gain.max(0.0)).sum();
        TemplateClasses { mask, classes, log_root: scale.log_empty(mask) + above }
    }

    /// Visits the templates, except those that are `within` nats below the best and lost in the rounding of the sum.
    /// Returns the log weight of the best. In the classes, queried kinds come after the kinds seen.
    fn each<'a>(
        &self,
        scale: &'a PriorScale,
        asked: &[Key],
        within: f64,
        mut visit: impl FnMut(Mask, &ClassTotals<'a>, &Classes),
    ) -> f64 {
        let mut members: Vec<Member> = self
            .counts
            .iter()
            .map(|(&key, &count)| {
                let count = EvidenceCount { net: net(count), is_changed: count.0 > 0 };
                Member { key, count, is_seen: true }
            })
            .collect();
        let mut best = f64::NEG_INFINITY;
        let mut improve = |mask: Mask, total: &ClassTotals<'_>| {
            best = best.max(scale.log_empty(mask) + total.log_best());
            best
        };
        // The best is nearly always a small template; it is found first to make the bound effective.
        each_template(&members, scale.features, ClassTotals::nothing(scale), |mask, total, _| {
            improve(mask, &total);
            mask.count_ones() < FIRST_PASS_FEATURES
        });
        members.extend(asked.iter().map(|&key| Member {
            key,
            count: EvidenceCount::default(),
            is_seen: false,
        }));
        each_template(&members, scale.features, ClassTotals::nothing(scale), |mask, total, classes| {
            visit(mask, &total, classes);
            scale.bound(mask, &total) >= improve(mask, &total) - within.max(NEGLIGIBLE_NATS)
        });
        best
    }

    /// The hypotheses at most `within` nats below the best, at most `MAX_HYPOTHESES`.
    pub(crate) fn hypotheses(
        &mut self,
        episodes: &[Episode],
        features: usize,
        prior: &Prior,
        expected: usize,
        label_errors: (f64, f64),
        within: f64,
    ) -> Scored {
        self.take(episodes);
        let scale = PriorScale::new(&self.counts, features, prior, expected, label_errors);
        let mut sum = LogSum::default();
        let mut bests: Vec<(Mask, f64)> = Vec::new();
        let best = self.each(&scale, &[], within, |mask, total, _| {
            let log_empty = scale.log_empty(mask);
            sum.add(log_empty + total.log_sum());
            bests.push((mask, log_empty + total.log_best()));
        });
        bests.retain(|(_, log_best)| *log_best >= best - within);
        bests.sort_unstable_by_key(|(mask, _)| *mask);
        let tables: Vec<TemplateClasses> = bests.iter().map(|(mask, _)| self.table(*mask, &scale)).collect();
        let mut queue: BinaryHeap<Candidate> = BinaryHeap::new();
        for (index, table) in tables.iter().enumerate() {
            queue.push(Candidate { log_weight: table.log_root, table: index, changed: Vec::new() });
        }
        let mut hypotheses = Vec::new();
        let mut best_given: Option<f64> = None;
        while let Some(candidate) = queue.pop() {
            let is_far = best_given.is_some_and(|best| candidate.log_weight < best - within);
            if is_far {
                break;
            }
            if hypotheses.len() >= MAX_HYPOTHESES {
                leave_out_ties(&mut hypotheses, candidate.log_weight);
                break;
            }
            let table = require!(tables.get(candidate.table), "table {} exists", candidate.table);
            let Some(table) = table else { break };
            queue.extend(candidate.next(table));
            let classes = table.chosen(&candidate.changed);
            if !classes.is_empty() {
                best_given.get_or_insert(candidate.log_weight);
                hypotheses.push(Hypothesis {
                    mask: table.mask,
                    tally: self.tally(episodes, table.mask, &classes),
                    classes,
                    selection: Selection::All,
                    log_score: candidate.log_weight,
                    description: None,
                });
            }
        }
        Scored { hypotheses, log_total: sum.value() }
    }

    /// The probability, for each of some kinds, that the rule applies: the sum over all templates and disjunctions. No
    /// class contains a kind of unseen values.
    pub(crate) fn probabilities(
        &mut self,
        episodes: &[Episode],
        features: usize,
        prior: &Prior,
        label_errors: (f64, f64),
        asked: &[Key],
    ) -> Vec<f64> {
        self.take(episodes);
        let scale = PriorScale::new(&self.counts, features, prior, 0, label_errors);
        let seen = self.counts.len();
        let mut sum = LogSum::default();
        let mut about = vec![LogSum::default(); asked.len()];
        self.each(&scale, asked, 0.0, |mask, total, classes| {
            let log_empty = scale.log_empty(mask);
            sum.add(log_empty + total.log_sum());
            for (members, count) in classes.iter() {
                let asked = members.iter().filter_map(|&member| (member as usize).checked_sub(seen));
                for one in asked {
                    if let Some(about) = require!(about.get_mut(one), "kind {one} was asked about") {
                        // The disjunctions with this class: g Π' (1 + g'), none of which is empty.
                        about.add(log_empty + total.softplus - softplus(-scale.gain(count.net).0));
                    }
                }
            }
        });
        about.iter().map(|about| (about.value() - sum.value()).exp().clamp(0.0, 1.0)).collect()
    }

    fn tally(&mut self, episodes: &[Episode], mask: Mask, classes: &[Key]) -> usize {
        if self.tallies.len() > MAX_CACHED_TALLIES {
            self.tallies.clear();
        }
        let bits = key_mask(mask);
        let known = self.tallies.entry((mask, classes.to_vec())).or_default();
        let consistent = |episode: &&Episode| {
            episode.is_consistent(|kind| {
                kind.present & mask == mask && classes.binary_search(&(kind.key & bits)).is_ok()
            })
        };
        known.1 += episodes.iter().skip(known.0).filter(consistent).count();
        known.0 = episodes.len();
        known.1
    }
}

/// Removes the hypotheses that tie with the first one beyond the limit: which of them are inside depends on the
/// order of the values' first appearance, and the result must not. At least half of the limit is kept.
fn leave_out_ties(hypotheses: &mut Vec<Hypothesis>, log_weight: f64) {
    let heavier = hypotheses.partition_point(|one| one.log_score > log_weight + TIE);
    if heavier >= MAX_HYPOTHESES / 2 {
        hypotheses.truncate(heavier);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;
    use crate::hypotheses::episode::LabeledObject;
    use crate::hypotheses::key::{field, with_field};

    const FEATURES: usize = 6;
    const SLIPS: f64 = 0.05;

    fn logs() -> (f64, f64) {
        (SLIPS.ln(), (1.0 - SLIPS).ln())
    }

    /// Objects with up to three values for every feature; rarely a feature is missing.
    fn episode(objects: usize) -> impl Strategy<Value = Episode> {
        let value = prop_oneof![1 => 0..1_u32, 60 => 1..4_u32];
        let object = (prop::collection::vec(value, FEATURES), 0..3_u8);
        prop::collection::vec(object, 1..objects).prop_map(|objects| {
            let labeled = |(values, label): (Vec<u32>, u8)| {
                let key =
                    (0..).zip(&values).fold(0, |key, (feature, value)| with_field(key, feature, *value));
                let about = values[0] == 1;
                let label = match (label, about) {
                    (0, _) if values[1] == 2 => Label::AlreadyAchieved,
                    (_, true) => Label::Changed,
                    (_, false) => Label::LeftOut,
                };
                LabeledObject { key, label, place: None }
            };
            Episode::new(objects.into_iter().map(labeled).collect())
        })
    }

    /// ln of the sum over all disjunctions of all templates, and over those that contain a kind, by brute force without
    /// pruning.
    fn log_totals(episodes: &[Episode], prior: &Prior, asked: Key) -> (f64, f64) {
        let (log_error, log_correct) = logs();
        let labeled_objects: Vec<&LabeledObject> =
            episodes.iter().flat_map(|episode| &episode.labeled_objects).collect();
        let (mut total, mut about) = (LogSum::default(), LogSum::default());
        for mask in 0..1_u16 << FEATURES {
            let class = |key: Key| (present(key) & mask == mask).then_some(key & key_mask(mask));
            let classes: BTreeSet<Key> = labeled_objects.iter().filter_map(|one| class(one.key)).collect();
            let log = |one: &&&LabeledObject, is_about: bool| match one.label {
                Label::AlreadyAchieved => 0.0,
                Label::Changed if is_about => log_correct,
                Label::LeftOut if !is_about => log_correct,
                Label::Changed | Label::LeftOut => log_error,
            };
            let base: f64 = labeled_objects.iter().map(|one| log(&one, false)).sum();
            let gain = |wanted: Key| -> f64 {
                let of_class = labeled_objects.iter().filter(|one| class(one.key) == Some(wanted));
                of_class.map(|one| log(&one, true) - log(&one, false)).sum::<f64>() - prior.lambda
            };
            let weight = base + prior.mu * f64::from(mask.count_ones()) + prior.lambda;
            let sum: f64 = classes.iter().map(|class| softplus(gain(*class))).sum();
            if !classes.is_empty() {
                total.add(weight + sum.exp_m1().ln().min(sum));
            }
            if let Some(wanted) = class(asked).filter(|class| classes.contains(class)) {
                about.add(weight + sum - softplus(-gain(wanted)));
            }
        }
        (total.value(), about.value())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn omitted_hypotheses_are_below_the_rounding_of_the_total(episodes in prop::collection::vec(episode(60), 1..4), lambda in -1.0..6.0_f64) {
            let prior = Prior { lambda, ..Prior::default() };
            let asked = episodes[0].labeled_objects[0].key;
            let (log_total, log_about) = log_totals(&episodes, &prior, asked);
            let mut factored = MarginalizedDisjunctions::default();
            let scored = factored.hypotheses(&episodes, FEATURES, &prior, 0, logs(), 10.0);
            prop_assert!((scored.log_total - log_total).abs() < 1e-6, "{} {log_total}", scored.log_total);
            let best = scored.hypotheses.first().map(|one| one.log_score);
            prop_assert!(best.is_some_and(|best| best <= scored.log_total));
            let about = factored.probabilities(&episodes, FEATURES, &prior, logs(), &[asked])[0];
            prop_assert!((about - (log_about - log_total).exp()).abs() < 1e-6, "{about}");
        }
    }

    #[test]
    fn few_templates_of_many_classes_are_evaluated() {
        let mut state = 1_u64;
        let mut value = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            1 + u32::try_from(state >> 62).unwrap()
        };
        let labeled_objects = (0..300).map(|_| {
            let key = (0..12).fold(0, |key, feature| with_field(key, feature, value()));
            let label = if field(key, 0) < 3 { Label::Changed } else { Label::LeftOut };
            LabeledObject { key, label, place: None }
        });
        let mut factored = MarginalizedDisjunctions::default();
        factored.take(&[Episode::new(labeled_objects.collect())]);
        let scale = PriorScale::new(&factored.counts, 12, &Prior::default(), 1, logs());
        let mut asked = 0;
        factored.each(&scale, &[], 10.0, |_, _, _| asked += 1);
        assert!(asked < 1_000, "{asked} of 4096");
    }
}
