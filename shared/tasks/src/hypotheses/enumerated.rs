//! The paper's hypotheses without label noise, expanded from the demonstrations: a template and a simple disjunction
//! of its classes.

mod bits;
mod template_node;

use bits::numbers;
use invariant::require;
use template_node::TemplateNode;

use super::episode::Episode;
use super::hypothesis::{Hypothesis, Scored};
use super::key::{Key, MAX_FEATURES, Mask, present};
use super::log_sum::{LogSum, ROUNDING_NATS};
use super::prior::Weight;
use super::seen_kinds::SeenKinds;
use super::selection::Selection;

/// For every template T ⊆ F the classes of the changed objects, of each demonstration and of all joined, with their
/// tallies.
///
/// It contains every hypothesis that is consistent with all demonstrations: such a hypothesis covers all changed
/// objects and nothing else.
///
/// A template processes new demonstrations lazily, when it is queried. A search by template size prunes: adding a
/// feature never joins two classes. So a template with too many classes to matter excludes all its extensions.
#[derive(Clone, Debug)]
pub(crate) struct EnumeratedDnf {
    templates: Vec<TemplateNode>,
    /// Logarithms of whole numbers, by number.
    logs: Vec<f64>,
}

/// The best score, and the best score among the hypotheses of the highest tally.
#[derive(Clone, Copy, Debug)]
struct Best {
    score: f64,
    tally: usize,
    score_of_tally: f64,
}

impl Best {
    fn take(&mut self, score: f64, tally: usize) {
        self.score = self.score.max(score);
        if tally > self.tally {
            (self.tally, self.score_of_tally) = (tally, score);
        } else if tally == self.tally {
            self.score_of_tally = self.score_of_tally.max(score);
        }
    }

    fn admits(&self, score: f64, tally: usize, within: f64) -> bool {
        score >= self.score - within || (tally == self.tally && score >= self.score_of_tally - within)
    }
}

impl EnumeratedDnf {
    pub(crate) fn new(features: usize) -> Self {
        let mut masks: Vec<Mask> = (0..1 << features.min(MAX_FEATURES)).collect();
        masks.sort_by_key(|mask| (mask.count_ones(), *mask));
        Self { templates: masks.into_iter().map(TemplateNode::new).collect(), logs: vec![f64::NEG_INFINITY] }
    }

    /// Processes the new demonstrations. Returns the templates that were not pruned, the best scores, and the logarithm
    /// of the sum over all hypotheses.
    fn take(
        &mut self,
        episodes: &[Episode],
        seen: &SeenKinds,
        weight: &Weight,
        within: f64,
    ) -> (Vec<usize>, Best, f64) {
        while self.logs.len() <= episodes.len() {
            self.logs.push(quantity::number::float_of_count(self.logs.len()).ln());
        }
        let Self { templates, logs } = self;
        let mut best = Best { score: f64::NEG_INFINITY, tally: 0, score_of_tally: f64::NEG_INFINITY };
        let mut pruned: Vec<Mask> = Vec::new();
        let mut asked = Vec::new();
        let mut total = LogSum::default();
        for (index, node) in templates.iter_mut().enumerate() {
            // Every extension of a pruned template is pruned.
            if pruned.iter().any(|smaller| node.mask & smaller == *smaller) {
                continue;
            }
            node.take(episodes);
            // Sums of integers by number of classes, so the result does not depend on the order.
            let mut tallies: Vec<(usize, usize)> = Vec::new();
            for one in node.all().filter(|one| one.tally > 0) {
                if tallies.len() <= one.size {
                    tallies.resize(one.size + 1, (0, 0));
                }
                if let Some((sum, max)) = tallies.get_mut(one.size) {
                    *sum += one.tally;
                    *max = one.tally.max(*max);
                }
            }
            for (size, &(sum, max)) in tallies.iter().enumerate().filter(|(_, (sum, _))| *sum > 0) {
                let log = weight.log(size, node.features) - log_of(logs, episodes.len());
                if log == f64::NEG_INFINITY {
                    continue;
                }
                total.add(quantity::number::float_of_count(sum).ln() + log);
                best.take(log_of(logs, max) + log, max);
            }
            // If every object has every feature, an extension has at least as many classes.
            let bound = weight.bound(node.fewest_classes, node.features, seen.values().len());
            let hopeless =
                best.tally == episodes.len() && bound < best.score_of_tally - within.max(ROUNDING_NATS);
            if hopeless && seen.is_complete() {
                pruned.push(node.mask);
            }
            asked.push(index);
        }
        (asked, best, total.value())
    }

    /// The hypotheses at most `within` nats below the best one, or below the best one of the highest tally. They cover
    /// the best `max` meanings by tally, and at least as many by score.
    pub(crate) fn hypotheses(
        &mut self,
        episodes: &[Episode],
        seen: &SeenKinds,
        weight: &Weight,
        within: f64,
        max: usize,
    ) -> Scored {
        let (asked, best, log_total) = self.take(episodes, seen, weight, within);
        let mut admitted: Vec<Admitted> = Vec::new();
        for (template, node) in
            asked.into_iter().filter_map(|index| Some((index, template(&self.templates, index)?)))
        {
            for (number, one) in node.all().enumerate().filter(|(_, one)| one.tally > 0) {
                let share = log_of(&self.logs, one.tally) - log_of(&self.logs, episodes.len());
                let score = share + weight.log(one.size, node.features);
                if score > f64::NEG_INFINITY && best.admits(score, one.tally, within) {
                    admitted.push(Admitted { template, number, tally: one.tally, score });
                }
            }
        }
        // Equivalent hypotheses have the same tally, and a template contains at most one of them.
        keep_best(&mut admitted, max.saturating_mul(self.templates.len()));
        let hypothesis = |one: Admitted| {
            let node = template(&self.templates, one.template)?;
            let chosen = numbers(&node.row(one.number)).into_iter();
            let class = |number| require!(node.classes.get(number), "class {number} exists").copied();
            let mut classes: Vec<Key> = chosen.filter_map(class).collect();
            classes.sort_unstable();
            Some(Hypothesis {
                mask: node.mask,
                classes,
                selection: Selection::All,
                tally: one.tally,
                log_score: one.score,
                description: None,
            })
        };
        Scored { log_total, hypotheses: admitted.into_iter().filter_map(hypothesis).collect() }
    }

    /// The logarithm of the sum over all hypotheses, and for each kind the share of those that apply to it.
    pub(crate) fn probabilities(
        &mut self,
        episodes: &[Episode],
        seen: &SeenKinds,
        weight: &Weight,
        asked: &[Key],
    ) -> (f64, Vec<f64>) {
        let (templates, _, log_total) = self.take(episodes, seen, weight, ROUNDING_NATS);
        let log_none = log_total + log_of(&self.logs, episodes.len());
        let mut about = vec![0.0; asked.len()];
        if log_total == f64::NEG_INFINITY {
            return (log_total, about);
        }
        for node in templates.into_iter().filter_map(|index| template(&self.templates, index)) {
            let class = |key: &Key| {
                let has_class = present(*key) & node.mask == node.mask;
                node.numbers.get(&(key & node.key_mask)).copied().filter(|_| has_class)
            };
            let joined = node.joined().map(|_| node.joined.row(node.words));
            let rows = node.disjunctions.chunks_exact(node.words).chain(joined.as_deref());
            let mut shares: Vec<f64> = Vec::new();
            for (standing, row) in node.all().zip(rows).filter(|(standing, _)| standing.tally > 0) {
                for size in shares.len()..=standing.size {
                    shares.push((weight.log(size, node.features) - log_none).exp());
                }
                let share = require!(shares.get(standing.size), "there is a share of {}", standing.size);
                let share = share.copied().unwrap_or(0.0);
                for (sum, key) in about.iter_mut().zip(asked) {
                    let word = class(key).and_then(|class| Some(row.get(class / 64)? >> (class % 64) & 1));
                    if word == Some(1) {
                        *sum += share * quantity::number::float_of_count(standing.tally);
                    }
                }
            }
        }
        (log_total, about)
    }
}

/// A hypothesis within the score limit: indices of its template and of its disjunction.
#[derive(Clone, Copy, Debug)]
struct Admitted {
    template: usize,
    number: usize,
    tally: usize,
    score: f64,
}

/// Keeps the best `max` by either measure, and those that tie with the last of them.
fn keep_best(admitted: &mut Vec<Admitted>, max: usize) {
    let Some(last) = max.checked_sub(1).filter(|last| *last < admitted.len()) else { return };
    let min_tally = admitted.select_nth_unstable_by(last, |a, b| b.tally.cmp(&a.tally)).1.tally;
    let min_score = admitted.select_nth_unstable_by(last, |a, b| b.score.total_cmp(&a.score)).1.score;
    admitted.retain(|one| one.tally >= min_tally || one.score >= min_score);
    // Restores the order, so that the result does not depend on the selection algorithm.
    admitted.sort_unstable_by_key(|one| (one.template, one.number));
}

/// A template by its index.
fn template(templates: &[TemplateNode], index: usize) -> Option<&TemplateNode> {
    require!(templates.get(index), "template {index} exists")
}

/// The logarithm of a whole number.
fn log_of(logs: &[f64], number: usize) -> f64 {
    require!(logs.get(number), "the logarithm of {number} is known").copied().unwrap_or(f64::NEG_INFINITY)
}
