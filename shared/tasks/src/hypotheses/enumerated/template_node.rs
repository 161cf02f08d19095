//! The classes of one template in the demonstrations, and the tallies of their disjunctions.

use rustc_hash::FxHashMap;

use super::bits::BitSet;
use crate::hypotheses::episode::{Episode, ObjectKind};
use crate::hypotheses::key::{Key, Mask, key_mask};

/// One template.
///
/// Sets of classes are bit sets in rows of `words` words, stored contiguously, since every demonstration and every
/// query scans them.
#[derive(Clone, Debug)]
pub(super) struct TemplateNode {
    pub(super) mask: Mask,
    pub(super) key_mask: Key,
    pub(super) features: usize,
    /// Number of demonstrations processed.
    taken: usize,
    pub(super) numbers: FxHashMap<Key, usize>,
    pub(super) classes: Vec<Key>,
    /// Words of a row.
    pub(super) words: usize,
    /// Distinct demonstrations under the template: a row of changed classes, then a row of left-out classes.
    patterns: Vec<u64>,
    pattern_counts: Vec<usize>,
    pattern_numbers: FxHashMap<(BitSet, BitSet), usize>,
    /// The classes of the changed objects of single demonstrations, distinct.
    pub(super) disjunctions: Vec<u64>,
    standings: Vec<DisjunctionStats>,
    disjunction_numbers: FxHashMap<BitSet, usize>,
    /// The classes of the changed objects of all demonstrations.
    pub(super) joined: BitSet,
    joined_standing: DisjunctionStats,
    pub(super) fewest_classes: usize,
}

/// The number of classes of a disjunction, and its tally.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DisjunctionStats {
    pub(super) size: usize,
    pub(super) tally: usize,
}

/// Whether a demonstration is consistent with a disjunction: it contains all changed classes and no left-out class.
fn is_consistent(classes: &[u64], changed: &[u64], left_out: &[u64]) -> bool {
    let words = classes.iter().zip(changed).zip(left_out);
    words.fold(0, |wrong, ((classes, changed), left_out)| wrong | (changed & !classes) | (left_out & classes))
        == 0
}

impl TemplateNode {
    pub(super) fn new(mask: Mask) -> Self {
        Self {
            mask,
            key_mask: key_mask(mask),
            features: usize::try_from(mask.count_ones()).unwrap_or(0),
            taken: 0,
            numbers: FxHashMap::default(),
            classes: Vec::new(),
            words: 1,
            patterns: Vec::new(),
            pattern_counts: Vec::new(),
            pattern_numbers: FxHashMap::default(),
            disjunctions: Vec::new(),
            standings: Vec::new(),
            disjunction_numbers: FxHashMap::default(),
            joined: BitSet::default(),
            joined_standing: DisjunctionStats::default(),
            fewest_classes: usize::MAX,
        }
    }

    /// The classes of some kinds, and whether every kind has one.
    fn classes_of(&mut self, kinds: &[ObjectKind]) -> (BitSet, bool) {
        let mut bits = BitSet::default();
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

    pub(super) fn take(&mut self, episodes: &[Episode]) {
        for episode in episodes.iter().skip(self.taken) {
            let (changed, is_complete) = self.classes_of(&episode.changed);
            let (left_out, _) = self.classes_of(&episode.left_out);
            self.widen_rows();
            // A sentence about a number is consistent with no disjunction.
            self.take_pattern(changed, left_out, is_complete && episode.count.is_none());
        }
        self.taken = episodes.len();
    }

    /// Extends the rows to hold all classes.
    fn widen_rows(&mut self) {
        let words = self.classes.len().div_ceil(64).max(1);
        if words > self.words {
            let wide = |rows: &[u64]| -> Vec<u64> {
                let pad = words - self.words;
                rows.chunks(self.words)
                    .flat_map(|row| row.iter().copied().chain((0..pad).map(|_| 0)))
                    .collect()
            };
            self.patterns = wide(&self.patterns);
            self.disjunctions = wide(&self.disjunctions);
            self.words = words;
        }
    }

    /// Adds a demonstration. If a changed object has no class, the demonstration is consistent with no disjunction, but
    /// its other classes are still a hypothesis.
    fn take_pattern(&mut self, changed: BitSet, left_out: BitSet, is_complete: bool) {
        let words = self.words;
        let (changed_row, left_row) = (changed.row(words), left_out.row(words));
        let grew = self.joined.union_with(&changed);
        if is_complete {
            let rows = self.disjunctions.chunks_exact(words);
            for (standing, row) in self.standings.iter_mut().zip(rows) {
                standing.tally += usize::from(is_consistent(row, &changed_row, &left_row));
            }
            if !grew && is_consistent(&self.joined.row(words), &changed_row, &left_row) {
                self.joined_standing.tally += 1;
            }
            let next = self.pattern_counts.len();
            let number = *self.pattern_numbers.entry((changed.clone(), left_out)).or_insert(next);
            match self.pattern_counts.get_mut(number) {
                Some(count) => *count += 1,
                None => {
                    self.pattern_counts.push(1);
                    self.patterns.extend_from_slice(&changed_row);
                    self.patterns.extend_from_slice(&left_row);
                }
            }
        }
        if grew {
            let tally = self.tally(&self.joined.row(words));
            self.joined_standing = DisjunctionStats { size: self.joined.len(), tally };
        }
        if !changed.is_empty() && !self.disjunction_numbers.contains_key(&changed) {
            let standing = DisjunctionStats { size: changed.len(), tally: self.tally(&changed_row) };
            self.fewest_classes = self.fewest_classes.min(standing.size);
            self.disjunction_numbers.insert(changed, self.standings.len());
            self.disjunctions.extend_from_slice(&changed_row);
            self.standings.push(standing);
        }
    }

    /// The number of demonstrations that are consistent with a disjunction.
    fn tally(&self, row: &[u64]) -> usize {
        let patterns = self.patterns.chunks_exact(2 * self.words).zip(&self.pattern_counts);
        let consistent = patterns.filter(|(pattern, _)| {
            let (changed, left_out) = pattern.split_at(self.words);
            is_consistent(row, changed, left_out)
        });
        consistent.map(|(_, count)| *count).sum()
    }

    /// The joined disjunction, unless it equals that of a single demonstration.
    pub(super) fn joined(&self) -> Option<DisjunctionStats> {
        let is_own = self.disjunction_numbers.contains_key(&self.joined);
        (!is_own && !self.joined.is_empty()).then_some(self.joined_standing)
    }

    /// All disjunctions, the joined one last.
    pub(super) fn all(&self) -> impl Iterator<Item = DisjunctionStats> {
        self.standings.iter().copied().chain(self.joined())
    }

    /// The classes of a disjunction, by its index in `all`.
    pub(super) fn row(&self, number: usize) -> Vec<u64> {
        let begin = number * self.words;
        let row = self.disjunctions.get(begin..begin + self.words).map(<[u64]>::to_vec);
        row.unwrap_or_else(|| self.joined.row(self.words))
    }
}
