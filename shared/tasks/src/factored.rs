//! The hypotheses of the paper where teachers slip: every simple disjunction of the classes seen.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use quantity::number::{float, float_of_count};
use rustc_hash::FxHashMap;

use crate::Selection;
use crate::case::{Case, Verdict};
use crate::hypothesis::{Hypothesis, Prior, Scored};
use crate::lexicon::{Key, Mask, key_mask, present};
use crate::log_sum::LogSum;

/// Hypotheses given at most.
const MOST: usize = 1024;
/// Tallies remembered at most.
const TALLIES: usize = 4096;

/// All simple disjunctions C of the classes seen, under every template T, in closed form.
///
/// With slips of probability ε, P(D|h) is a product over the objects, and so over the classes.
/// With p(c) changed and q(c) left out of a class, its odds of being in C are
///
/// ln g(c) = (p(c) - q(c)) ln((1 - ε) / ε) - λ,
///
/// and the sum of P(D|h) P(h) over all C ≠ ∅ of a template is a constant times
/// Π (1 + g(c)) - 1. Nothing is enumerated but the best.
#[derive(Clone, Debug, Default)]
pub(crate) struct Factored {
    /// By kind, how many were changed and left out.
    counts: FxHashMap<Key, (u64, u64)>,
    taken: usize,
    tallies: FxHashMap<(Mask, Vec<Key>), (usize, usize)>,
}

/// The classes of one template, by ln g.
struct Table {
    mask: Mask,
    /// In ascending order of |ln g|: what it costs to change one's mind about a class.
    classes: Vec<(Key, f64)>,
    /// The logarithm of the weight of the empty disjunction, which is none.
    log_empty: f64,
    /// Σ ln(1 + g).
    softplus: f64,
}

impl Table {
    /// The log weight of its best disjunction, the empty one counted.
    fn log_root(&self) -> f64 {
        self.log_empty + self.classes.iter().map(|(_, gain)| gain.max(0.0)).sum::<f64>()
    }

    /// The log weight of its best disjunction.
    fn log_best(&self) -> f64 {
        // In order of what a class costs: where none is worth it, the first is the least loss.
        let least = self.classes.first().map_or(f64::NEG_INFINITY, |(_, gain)| *gain);
        let is_empty = self.classes.iter().all(|(_, gain)| *gain <= 0.0);
        if is_empty { self.log_empty + least } else { self.log_root() }
    }

    /// The logarithm of the sum over its disjunctions.
    fn log_total(&self) -> f64 {
        if self.classes.is_empty() {
            return f64::NEG_INFINITY;
        }
        self.log_empty + self.softplus + (-(-self.softplus).exp()).ln_1p()
    }

    /// The classes of the best disjunction but for those of which one changes one's mind.
    fn chosen(&self, changed: &[usize]) -> Vec<Key> {
        let chosen = self.classes.iter().enumerate();
        let chosen = chosen.filter(|(index, (_, gain))| (*gain > 0.0) != changed.contains(index));
        let mut classes: Vec<Key> = chosen.map(|(_, (class, _))| *class).collect();
        classes.sort_unstable();
        classes
    }
}

/// A disjunction in the order of weight.
#[derive(Clone, Debug, PartialEq)]
struct Candidate {
    log_weight: f64,
    table: usize,
    /// Classes of which one changes one's mind, in ascending order.
    changed: Vec<usize>,
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

impl Factored {
    fn take(&mut self, cases: &[Case]) {
        for witness in cases.iter().skip(self.taken).flat_map(|case| &case.witnesses) {
            let count = self.counts.entry(witness.key).or_default();
            match witness.verdict {
                Verdict::Changed => count.0 += 1,
                Verdict::LeftOut => count.1 += 1,
                Verdict::AlreadySo => {}
            }
        }
        self.taken = cases.len();
    }

    fn table(&self, mask: Mask, prior: &Prior, expected: usize, slips: (f64, f64)) -> Table {
        let (slip, right) = slips;
        let bits = key_mask(mask);
        let mut classes: FxHashMap<Key, (u64, u64)> = FxHashMap::default();
        let (mut changed, mut left_out) = (0, 0);
        for (&key, &(p, q)) in &self.counts {
            changed += p;
            left_out += q;
            if present(key) & mask == mask {
                let count = classes.entry(key & bits).or_default();
                count.0 += p;
                count.1 += q;
            }
        }
        let mut classes: Vec<(Key, f64)> = classes
            .into_iter()
            .map(|(class, (p, q))| (class, (float(p) - float(q)).mul_add(right - slip, -prior.lambda)))
            .collect();
        classes.sort_unstable_by(|a, b| a.1.abs().total_cmp(&b.1.abs()).then(a.0.cmp(&b.0)));
        let features = usize::try_from(mask.count_ones()).unwrap_or(0) + expected;
        let nothing = float(changed).mul_add(slip, float(left_out) * right);
        Table {
            mask,
            softplus: classes.iter().map(|&(_, gain)| softplus(gain)).sum(),
            classes,
            log_empty: nothing + prior.mu.mul_add(float_of_count(features), prior.lambda),
        }
    }

    /// The best hypotheses, those within so many nats of the best.
    pub(crate) fn hypotheses(
        &mut self,
        cases: &[Case],
        features: usize,
        prior: &Prior,
        expected: usize,
        slips: (f64, f64),
        within: f64,
    ) -> Scored {
        self.take(cases);
        let mut total = LogSum::default();
        let mut best = f64::NEG_INFINITY;
        let mut tables: Vec<Table> = Vec::new();
        for mask in masks(features) {
            let table = self.table(mask, prior, expected, slips);
            total.add(table.log_total());
            let log_best = table.log_best();
            if log_best >= best - within {
                best = best.max(log_best);
                tables.push(table);
            }
        }
        let mut queue: BinaryHeap<Candidate> = BinaryHeap::new();
        for (index, table) in tables.iter().enumerate() {
            queue.push(Candidate { log_weight: table.log_root(), table: index, changed: Vec::new() });
        }
        let mut hypotheses = Vec::new();
        let mut best_given: Option<f64> = None;
        while let Some(candidate) = queue.pop() {
            let is_far = best_given.is_some_and(|best| candidate.log_weight < best - within);
            let Some(table) = tables.get(candidate.table).filter(|_| !is_far && hypotheses.len() < MOST)
            else {
                break;
            };
            queue.extend(candidate.next(table));
            let classes = table.chosen(&candidate.changed);
            if !classes.is_empty() {
                best_given.get_or_insert(candidate.log_weight);
                hypotheses.push(Hypothesis {
                    mask: table.mask,
                    tally: self.tally(cases, table.mask, &classes),
                    classes,
                    selection: Selection::All,
                    log_score: candidate.log_weight,
                    description: None,
                });
            }
        }
        Scored { hypotheses, log_total: total.value() }
    }

    /// The probability that the rule is about each of some kinds: the sum over all templates and
    /// disjunctions. No class is about what nobody has seen.
    pub(crate) fn probabilities(
        &mut self,
        cases: &[Case],
        features: usize,
        prior: &Prior,
        slips: (f64, f64),
        asked: &[Key],
    ) -> Vec<f64> {
        self.take(cases);
        let mut total = LogSum::default();
        let mut about = vec![LogSum::default(); asked.len()];
        for mask in masks(features) {
            let table = self.table(mask, prior, 0, slips);
            let log_total = table.log_total();
            total.add(log_total);
            let bits = key_mask(mask);
            for (sum, &key) in about.iter_mut().zip(asked) {
                let class = table.classes.iter().find(|(class, _)| *class == key & bits);
                if let Some((_, gain)) = class.filter(|_| present(key) & mask == mask) {
                    // The disjunctions with this class: g Π' (1 + g'), none of them empty.
                    sum.add(table.log_empty + table.softplus - softplus(-gain));
                }
            }
        }
        about.iter().map(|sum| (sum.value() - total.value()).exp().clamp(0.0, 1.0)).collect()
    }

    fn tally(&mut self, cases: &[Case], mask: Mask, classes: &[Key]) -> usize {
        if self.tallies.len() > TALLIES {
            self.tallies.clear();
        }
        let bits = key_mask(mask);
        let known = self.tallies.entry((mask, classes.to_vec())).or_default();
        let consistent = |case: &&Case| {
            case.is_consistent(|kind| {
                kind.present & mask == mask && classes.binary_search(&(kind.key & bits)).is_ok()
            })
        };
        known.1 += cases.iter().skip(known.0).filter(consistent).count();
        known.0 = cases.len();
        known.1
    }
}

impl Candidate {
    /// The two candidates that come of it: with one change of mind more, and with the last one in
    /// place of the next. Every disjunction comes of exactly one other, and none before it.
    fn next(&self, table: &Table) -> impl Iterator<Item = Self> {
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

/// All templates over so many features.
fn masks(features: usize) -> impl Iterator<Item = Mask> {
    let count: u32 = 1 << features.min(crate::lexicon::FEATURES_MOST);
    (0..count).filter_map(|mask| Mask::try_from(mask).ok())
}

/// ln(1 + e^x).
fn softplus(x: f64) -> f64 {
    x.max(0.0) + (-x.abs()).exp().ln_1p()
}
