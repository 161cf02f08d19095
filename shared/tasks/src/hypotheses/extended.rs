//! The extended hypothesis language: short descriptions of object sets with a selection, weighted by description
//! length.

mod descriptions;
mod table;

use descriptions::Descriptions;
use invariant::require;
use quantity::number::{float, float_of_count};
use rustc_hash::{FxBuildHasher, FxHashMap};
use table::ObjectBitSets;

use super::episode::{Episode, Label, LabeledObject};
use super::hypothesis::{Hypothesis, Scored, TIE};
use super::key::{Key, Mask};
use super::lexicon::Lexicon;
use super::log_sum::{LogSum, ROUNDING_NATS};
use super::seen_kinds::SeenKinds;
use super::selection::{Extent, Place, Relation, Selection};

/// Selections are only made from sets with at most this description cost.
const MAX_SELECTED_COST: usize = 2;
/// Maximum number in "exactly n" (subitizing range of people).
pub const MAX_COUNT: usize = 7;
/// Maximum number in "all but n".
const MAX_ALL_BUT: usize = 3;

/// All hypotheses of the extended language over the values seen, with their evidence.
#[derive(Clone, Debug)]
pub(crate) struct Extended {
    descriptions: Descriptions,
    /// By description.
    sets: Vec<Standing>,
    selected: Vec<Selected>,
    /// By description, the index into `distinct` once computed.
    meanings: Vec<Option<usize>>,
    distinct: Vec<(Mask, Vec<Key>)>,
    numbers: FxHashMap<(Mask, Vec<Key>), usize>,
    taken: usize,
    /// Number of objects that were changed or left out.
    labeled_objects: u64,
}

/// The evidence about a description.
#[derive(Clone, Copy, Debug, Default)]
struct Standing {
    tally: usize,
    /// Number of objects that contradict it.
    label_errors: u64,
}

/// A selection from a described set, with its evidence.
#[derive(Clone, Copy, Debug)]
struct Selected {
    set: usize,
    selection: Selection,
    tally: usize,
    log_likelihood: f64,
}

/// The weights of the extended language.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost {
    /// The cost of a number or a relation, in nats.
    pub(crate) selection_nats: f64,
    /// ln ε and ln(1 - ε); `None` without label noise.
    pub(crate) label_errors: Option<(f64, f64)>,
}

impl Extended {
    pub(crate) fn new(lexicon: &Lexicon, seen: &SeenKinds) -> Self {
        let descriptions = Descriptions::new(lexicon, seen);
        let selected = descriptions
            .sets
            .iter()
            .enumerate()
            .skip(1)
            .filter(|(_, set)| set.cost <= MAX_SELECTED_COST)
            .flat_map(|(set, _)| {
                selections().map(move |selection| Selected { set, selection, tally: 0, log_likelihood: 0.0 })
            })
            .collect();
        Self {
            sets: vec![Standing::default(); descriptions.sets.len()],
            meanings: vec![None; descriptions.sets.len()],
            descriptions,
            selected,
            distinct: Vec::new(),
            numbers: FxHashMap::default(),
            taken: 0,
            labeled_objects: 0,
        }
    }

    /// The maximum cost of a description.
    pub(crate) const fn longest(&self) -> usize {
        self.descriptions.longest
    }

    /// Adds the evidence of new demonstrations.
    pub(crate) fn take(&mut self, episodes: &[Episode], cost: &Cost) {
        for episode in episodes.iter().skip(self.taken) {
            if let Some(count) = episode.count {
                self.take_count(count, cost);
                continue;
            }
            let table = ObjectBitSets::new(&self.descriptions, &episode.labeled_objects);
            let bore =
                episode.labeled_objects.iter().filter(|labeled| labeled.label != Label::AlreadyAchieved);
            self.labeled_objects += u64::try_from(bore.count()).unwrap_or(0);
            let members = table.members(&self.descriptions.sets);
            for (standing, members) in self.sets.iter_mut().zip(members.chunks(table.words)).skip(1) {
                let label_errors = table.label_errors(members);
                standing.label_errors += label_errors;
                standing.tally += usize::from(label_errors == 0);
            }
            if episode.is_hypothetical {
                // An object without a position may or may not be among a number, or have a relation. Both answers are
                // consistent and equally probable.
                for one in &mut self.selected {
                    one.tally += 1;
                    one.log_likelihood -= std::f64::consts::LN_2;
                }
                continue;
            }
            let mut extents: Option<(usize, Extent)> = None;
            for one in &mut self.selected {
                let members = table.row(&members, one.set);
                let extent = match extents {
                    Some((set, extent)) if set == one.set => extent,
                    _ => table.extent(members),
                };
                extents = Some((one.set, extent));
                let (is_consistent, log_likelihood) =
                    table.evaluate(one.selection, members, &extent, cost.label_errors);
                one.tally += usize::from(is_consistent);
                one.log_likelihood += log_likelihood;
            }
        }
        self.taken = episodes.len();
    }

    /// Adds a sentence about a number: it speaks for the selections of this number, whatever they are made from.
    fn take_count(&mut self, count: usize, cost: &Cost) {
        self.labeled_objects += 1;
        self.sets.iter_mut().for_each(|standing| standing.label_errors += 1);
        for one in &mut self.selected {
            let is_consistent = one.selection == Selection::Exactly(count);
            one.tally += usize::from(is_consistent);
            if let Some((log_error, log_correct)) = cost.label_errors {
                one.log_likelihood += if is_consistent { log_correct } else { log_error };
            }
        }
    }

    /// log P(D|h) P(h) of every hypothesis with its description, selection and tally; hypotheses of probability 0 are
    /// left out.
    fn scores(&self, cost: &Cost) -> Vec<Score> {
        // By tally, the logarithm of the share of the examples.
        let examples = float_of_count(self.taken);
        let shares: Vec<f64> =
            (0..=self.taken).map(|tally| (float_of_count(tally) / examples).ln()).collect();
        let share = |tally: usize| {
            require!(shares.get(tally), "a tally of {tally}").copied().unwrap_or(f64::NEG_INFINITY)
        };
        let mut scores = Vec::with_capacity(self.sets.len() + self.selected.len());
        for (number, (set, standing)) in self.descriptions.sets.iter().zip(&self.sets).enumerate().skip(1) {
            let log_likelihood = match cost.label_errors {
                None => share(standing.tally),
                Some((log_error, log_correct)) => float(standing.label_errors).mul_add(
                    log_error,
                    float(self.labeled_objects.saturating_sub(standing.label_errors)) * log_correct,
                ),
            };
            let log = log_likelihood - float_of_count(set.cost);
            scores.push(Score { set: number, selection: Selection::All, tally: standing.tally, log });
        }
        for one in &self.selected {
            let described = self.descriptions.cost(one.set);
            let log_likelihood =
                if cost.label_errors.is_none() { share(one.tally) } else { one.log_likelihood };
            let log = log_likelihood - float_of_count(described) - cost.selection_nats;
            scores.push(Score { set: one.set, selection: one.selection, tally: one.tally, log });
        }
        scores.retain(|score| score.log > f64::NEG_INFINITY);
        scores
    }

    /// The hypotheses, with equivalent ones merged. It keeps those at most `within` nats below the best one, or below
    /// the best one of the highest tally. Of these it keeps the best `max_count` by tally and the best `max_count` by
    /// score.
    pub(crate) fn hypotheses(
        &mut self,
        seen: &SeenKinds,
        cost: &Cost,
        within: f64,
        max_count: usize,
    ) -> Scored {
        let scores = self.scores(cost);
        let best_of = |of: &dyn Fn(&&Score) -> bool| {
            scores.iter().filter(of).map(|score| score.log).fold(f64::NEG_INFINITY, f64::max)
        };
        let max_tally = scores.iter().map(|score| score.tally).max().unwrap_or(0);
        let best = best_of(&|_| true);
        let best_of_max_tally = best_of(&|score| score.tally == max_tally);
        let is_within = |log: f64, tally: usize, nats: f64| {
            log >= best - nats || (tally == max_tally && log >= best_of_max_tally - nats)
        };
        let mut total = LogSum::default();
        // Most hypotheses have the selection `All`; they are indexed by number instead of a hash.
        let mut whole: Vec<Merged> = Vec::new();
        let mut merged: FxHashMap<(usize, Selection), Merged> =
            FxHashMap::with_capacity_and_hasher(self.selected.len(), FxBuildHasher);
        for Score { set, selection, tally, log } in scores {
            total.add(log);
            // Terms that are lost in the rounding of the sum are skipped.
            if is_within(log, tally, within.max(ROUNDING_NATS)) {
                let meaning = self.meaning(set, seen);
                if selection != Selection::All {
                    merged.entry((meaning, selection)).or_default().take(log, tally, set);
                    continue;
                }
                if whole.len() <= meaning {
                    whole.resize(meaning + 1, Merged::default());
                }
                if let Some(one) = whole.get_mut(meaning) {
                    one.take(log, tally, set);
                }
            }
        }
        let whole = whole.into_iter().enumerate().filter(|(_, one)| one.set > 0);
        let whole = whole.map(|(meaning, one)| ((meaning, Selection::All), one));
        let mut merged: Vec<((usize, Selection), Merged)> =
            whole.chain(merged).filter(|(_, one)| is_within(one.sum.value(), one.tally, within)).collect();
        // Keeps the best ones by either measure; ties with the last one stay.
        let kept = [
            last_kept(&merged, max_count, Merged::by_score),
            last_kept(&merged, max_count, Merged::by_tally),
        ];
        merged.retain(|(_, one)| one.by_score() >= kept[0] || one.by_tally() >= kept[1]);
        let hypotheses = merged.into_iter().filter_map(|((meaning, selection), merged)| {
            // A description that covers nothing is not a hypothesis.
            let (mask, classes) = self.distinct.get(meaning).filter(|(_, classes)| !classes.is_empty())?;
            Some(Hypothesis {
                mask: *mask,
                classes: classes.clone(),
                selection,
                tally: merged.tally,
                log_score: merged.sum.value(),
                description: Some(self.descriptions.described(merged.set)),
            })
        });
        Scored { hypotheses: hypotheses.collect(), log_total: total.value() }
    }

    /// The description in words.
    pub(crate) fn phrase(&self, set: usize, lexicon: &Lexicon, order: impl Fn(&str) -> usize) -> String {
        self.descriptions.phrase(set, lexicon, order)
    }

    /// The index of the distinct set that a description denotes.
    fn meaning(&mut self, set: usize, seen: &SeenKinds) -> usize {
        let next = self.distinct.len();
        let slot = require!(self.meanings.get_mut(set), "description {set} exists");
        let Some(slot) = slot else { return next };
        if let Some(known) = *slot {
            return known;
        }
        let classes = self.descriptions.classes(set, seen);
        let number = *self.numbers.entry(classes.clone()).or_insert(next);
        if number == next {
            self.distinct.push(classes);
        }
        *slot = Some(number);
        number
    }

    /// The logarithm of the sum of P(D|h) P(h), and the probability for each object of a scene that the rule applies to
    /// it. With a number, every choice of objects is equally probable.
    pub(crate) fn probabilities(&self, cost: &Cost, asked: &[(Key, Option<Place>)]) -> (f64, Vec<f64>) {
        let labeled_objects: Vec<LabeledObject> =
            asked.iter().map(|&(key, place)| LabeledObject { key, label: Label::LeftOut, place }).collect();
        let table = ObjectBitSets::new(&self.descriptions, &labeled_objects);
        let members = table.members(&self.descriptions.sets);
        let scores = self.scores(cost);
        let best = scores.iter().map(|score| score.log).fold(f64::NEG_INFINITY, f64::max);
        let mut total = 0.0;
        let mut about = vec![0.0; asked.len()];
        for score in scores.iter().filter(|score| score.log >= best - ROUNDING_NATS) {
            let weight = (score.log - best).exp();
            total += weight;
            let members = table.row(&members, score.set);
            table.add_shares(score.selection, members, weight, &mut about);
        }
        if total > 0.0 {
            about.iter_mut().for_each(|sum: &mut f64| *sum = (*sum / total).clamp(0.0, 1.0));
            (best + total.ln(), about)
        } else {
            (f64::NEG_INFINITY, about)
        }
    }
}

/// The score of a hypothesis.
#[derive(Clone, Copy, Debug)]
struct Score {
    set: usize,
    selection: Selection,
    tally: usize,
    log: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Merged {
    sum: LogSum,
    tally: usize,
    /// The first description in the order of `sets`; 0 for none.
    set: usize,
}

impl Merged {
    fn by_score(&self) -> (usize, f64) {
        (0, self.sum.value())
    }

    fn by_tally(&self) -> (usize, f64) {
        (self.tally, self.sum.value())
    }

    fn take(&mut self, score: f64, tally: usize, set: usize) {
        self.sum.add(score);
        self.tally = self.tally.max(tally);
        if self.set == 0 || set < self.set {
            self.set = set;
        }
    }
}

/// The measure of the `max_count`-th best, less the tolerance of a tie.
fn last_kept<K>(
    merged: &[(K, Merged)],
    max_count: usize,
    measure: impl Fn(&Merged) -> (usize, f64),
) -> (usize, f64) {
    let mut measures: Vec<(usize, f64)> = merged.iter().map(|(_, one)| measure(one)).collect();
    let downwards = |a: &(usize, f64), b: &(usize, f64)| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1));
    // Only the cut is needed, not the order on either side of it.
    let last = max_count.checked_sub(1).filter(|last| *last < measures.len());
    let last = last.map(|last| *measures.select_nth_unstable_by(last, downwards).1);
    last.map_or((0, f64::NEG_INFINITY), |(tally, score)| (tally, score - TIE))
}

fn selections() -> impl Iterator<Item = Selection> {
    let exactly = (1..=MAX_COUNT).map(Selection::Exactly);
    let all_but = (1..=MAX_ALL_BUT).map(Selection::AllBut);
    exactly.chain(all_but).chain(Relation::ALL.map(Selection::Relation))
}
