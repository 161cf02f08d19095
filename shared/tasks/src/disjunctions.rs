//! The hypotheses of the paper, expanded from the demonstrations: a template and a simple
//! disjunction of its classes.

use rustc_hash::FxHashMap;

use crate::Selection;
use crate::bits::Bits;
use crate::case::{Case, Kind};
use crate::hypothesis::{Hypothesis, Scored};
use crate::lexicon::{Key, Mask, Seen, key_mask};
use crate::log_sum::LogSum;
use crate::weight::Weight;

/// For every template T ⊆ F the classes of the changed objects, of each demonstration by itself
/// and joined over all of them, with their tallies.
///
/// Every hypothesis of the language that is consistent with every demonstration is among them: it
/// must cover all that changed, and may cover nothing else.
///
/// A template takes in demonstrations when somebody asks what it makes of them, and only those
/// that are new to it. One that divides the changed objects into so many classes that neither it
/// nor any larger template can matter is not asked: that is the bound of a search through the
/// templates by size, in which adding a feature never joins two classes.
#[derive(Clone, Debug)]
pub(crate) struct Disjunctions {
    templates: Vec<Node>,
    /// Logarithms of whole numbers.
    logs: Vec<f64>,
}

/// One template.
#[derive(Clone, Debug)]
struct Node {
    mask: Mask,
    key_mask: Key,
    features: usize,
    /// Demonstrations taken in.
    taken: usize,
    numbers: FxHashMap<Key, usize>,
    classes: Vec<Key>,
    patterns: Vec<Pattern>,
    pattern_numbers: FxHashMap<(Bits, Bits, bool), usize>,
    disjunctions: Vec<Disjunction>,
    disjunction_numbers: FxHashMap<Bits, usize>,
    joined: Disjunction,
    /// By the number of classes: the sum of the tallies.
    tallies: Vec<u64>,
    fewest_classes: usize,
}

/// Demonstrations that are alike under a template.
#[derive(Clone, Debug)]
struct Pattern {
    changed: Bits,
    left_out: Bits,
    /// Whether every changed object has a class.
    is_complete: bool,
    count: usize,
}

#[derive(Clone, Debug, Default)]
struct Disjunction {
    classes: Bits,
    size: usize,
    tally: usize,
}

impl Disjunction {
    fn is_consistent(&self, pattern: &Pattern) -> bool {
        pattern.is_complete
            && pattern.changed.is_subset(&self.classes)
            && pattern.left_out.is_disjoint(&self.classes)
    }
}

impl Node {
    fn new(mask: Mask) -> Self {
        Self {
            mask,
            key_mask: key_mask(mask),
            features: usize::try_from(mask.count_ones()).unwrap_or(0),
            taken: 0,
            numbers: FxHashMap::default(),
            classes: Vec::new(),
            patterns: Vec::new(),
            pattern_numbers: FxHashMap::default(),
            disjunctions: Vec::new(),
            disjunction_numbers: FxHashMap::default(),
            joined: Disjunction::default(),
            tallies: Vec::new(),
            fewest_classes: usize::MAX,
        }
    }

    /// The classes of some kinds, and whether every kind has one.
    fn classes_of(&mut self, kinds: &[Kind]) -> (Bits, bool) {
        let mut bits = Bits::default();
        let mut is_complete = true;
        for kind in kinds {
            if kind.present & self.mask != self.mask {
                is_complete = false;
                continue;
            }
            let class = kind.key & self.key_mask;
            let next = self.classes.len();
            let number = *self.numbers.entry(class).or_insert(next);
            if number == next {
                self.classes.push(class);
            }
            bits.insert(number);
        }
        (bits, is_complete)
    }

    fn take(&mut self, cases: &[Case]) {
        for case in cases.iter().skip(self.taken) {
            let (changed, is_complete) = self.classes_of(&case.changed);
            let (left_out, _) = self.classes_of(&case.left_out);
            self.take_pattern(&Pattern { changed, left_out, is_complete, count: 1 });
        }
        self.taken = cases.len();
    }

    fn take_pattern(&mut self, pattern: &Pattern) {
        let named = (pattern.changed.clone(), pattern.left_out.clone(), pattern.is_complete);
        let next = self.patterns.len();
        match self.patterns.get_mut(*self.pattern_numbers.entry(named).or_insert(next)) {
            Some(known) => known.count += 1,
            None => self.patterns.push(pattern.clone()),
        }
        let Self { disjunctions, tallies, .. } = self;
        for disjunction in disjunctions.iter_mut() {
            if disjunction.is_consistent(pattern) {
                disjunction.tally += 1;
                count(tallies, disjunction.size, 1);
            }
        }
        let grew = self.joined.classes.unite(&pattern.changed);
        if grew {
            self.joined.size = self.joined.classes.len();
            self.joined.tally = tally(&self.joined, &self.patterns);
        } else if self.joined.is_consistent(pattern) {
            self.joined.tally += 1;
        }
        if !pattern.changed.is_empty() && !self.disjunction_numbers.contains_key(&pattern.changed) {
            let classes = pattern.changed.clone();
            let mut new = Disjunction { size: classes.len(), classes, tally: 0 };
            new.tally = tally(&new, &self.patterns);
            count(&mut self.tallies, new.size, new.tally);
            self.fewest_classes = self.fewest_classes.min(new.size);
            self.disjunction_numbers.insert(new.classes.clone(), self.disjunctions.len());
            self.disjunctions.push(new);
        }
    }

    /// All disjunctions, the joined one last unless it is one demonstration's own.
    fn all(&self) -> impl Iterator<Item = &Disjunction> {
        let is_own = self.disjunction_numbers.contains_key(&self.joined.classes);
        let joined = (!is_own && !self.joined.classes.is_empty()).then_some(&self.joined);
        self.disjunctions.iter().chain(joined)
    }
}

fn tally(disjunction: &Disjunction, patterns: &[Pattern]) -> usize {
    patterns.iter().filter(|one| disjunction.is_consistent(one)).map(|one| one.count).sum()
}

fn count(tallies: &mut Vec<u64>, size: usize, more: usize) {
    if tallies.len() <= size {
        tallies.resize(size + 1, 0);
    }
    if let Some(sum) = tallies.get_mut(size) {
        *sum += u64::try_from(more).unwrap_or(0);
    }
}

/// How well the best hypotheses do: the best score, and the best score among those of the highest
/// tally.
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

impl Disjunctions {
    pub(crate) fn new(features: usize) -> Self {
        let mut masks: Vec<Mask> = (0..=Mask::MAX >> (16 - features.min(12))).collect();
        masks.sort_by_key(|mask| (mask.count_ones(), *mask));
        Self { templates: masks.into_iter().map(Node::new).collect(), logs: vec![f64::NEG_INFINITY] }
    }

    /// The hypotheses whose score is within so many nats of the best, or of the best one of the
    /// highest tally.
    pub(crate) fn hypotheses(&mut self, cases: &[Case], seen: &Seen, weight: &Weight, within: f64) -> Scored {
        while self.logs.len() <= cases.len() {
            self.logs.push(quantity::number::float_of_count(self.logs.len()).ln());
        }
        let log = |logs: &[f64], tally: usize| logs.get(tally).copied().unwrap_or(f64::NEG_INFINITY);
        let examples = log(&self.logs, cases.len());
        let mut best = Best { score: f64::NEG_INFINITY, tally: 0, score_of_tally: f64::NEG_INFINITY };
        let mut pruned: Vec<Mask> = Vec::new();
        let mut asked = Vec::new();
        let mut total = LogSum::default();
        for (index, node) in self.templates.iter_mut().enumerate() {
            // A larger template than one that is out of the question is out of it, too.
            if pruned.iter().any(|smaller| node.mask & smaller == *smaller) {
                continue;
            }
            node.take(cases);
            for one in node.all() {
                let score = log(&self.logs, one.tally) - examples + weight.log(one.size, node.features);
                if one.tally > 0 {
                    best.take(score, one.tally);
                }
            }
            for (size, &sum) in node.tallies.iter().enumerate().filter(|(_, sum)| **sum > 0) {
                total.add(quantity::number::float(sum).ln() - examples + weight.log(size, node.features));
            }
            if !node.disjunction_numbers.contains_key(&node.joined.classes) && node.joined.tally > 0 {
                let joined = log(&self.logs, node.joined.tally) - examples;
                total.add(joined + weight.log(node.joined.size, node.features));
            }
            // Where every object has every feature, a larger template has no fewer classes.
            let bound = weight.bound(node.fewest_classes, node.features, seen.values().len());
            let hopeless = best.tally == cases.len() && bound < best.score_of_tally - within.max(NATS);
            if hopeless && seen.is_complete() {
                pruned.push(node.mask);
            }
            asked.push(index);
        }
        let mut hypotheses = Vec::new();
        for node in asked.into_iter().filter_map(|index| self.templates.get(index)) {
            for one in node.all().filter(|one| one.tally > 0) {
                let score = log(&self.logs, one.tally) - examples + weight.log(one.size, node.features);
                if best.admits(score, one.tally, within) {
                    let classes = one.classes.iter().filter_map(|number| node.classes.get(number));
                    let mut classes: Vec<Key> = classes.copied().collect();
                    classes.sort_unstable();
                    hypotheses.push(Hypothesis {
                        mask: node.mask,
                        classes,
                        selection: Selection::All,
                        tally: one.tally,
                        log_score: score,
                        phrase: None,
                    });
                }
            }
        }
        Scored { log_total: total.value(), hypotheses }
    }
}

/// What is further below the best than this is lost in the rounding of a sum.
const NATS: f64 = 40.0;
