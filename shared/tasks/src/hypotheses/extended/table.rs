//! The objects of one demonstration as bit sets, and the evaluation of hypotheses on them.

use invariant::require;
use quantity::number::{float, float_of_count};

use super::descriptions::{Description, Descriptions};
use crate::hypotheses::episode::{Label, LabeledObject};
use crate::hypotheses::log_sum::LogSum;
use crate::hypotheses::selection::{Extent, Place, Relation, Selection};

/// A set of objects of a demonstration, as a bit set.
pub(crate) type Members<'a> = &'a [u64];

/// The objects of a demonstration, with a bit set for each property.
pub(crate) struct ObjectBitSets {
    pub(crate) words: usize,
    changed: Vec<u64>,
    left_out: Vec<u64>,
    places: Vec<Option<Place>>,
    /// A bit set for each term, concatenated.
    terms: Vec<u64>,
}

impl ObjectBitSets {
    pub(crate) fn new(descriptions: &Descriptions, labeled_objects: &[LabeledObject]) -> Self {
        let words = labeled_objects.len().div_ceil(64).max(1);
        let set = |holds: &dyn Fn(&LabeledObject) -> bool| {
            let mut bits = vec![0_u64; words];
            for (chunk, word) in labeled_objects.chunks(64).zip(&mut bits) {
                for (bit, labeled) in chunk.iter().enumerate() {
                    *word |= u64::from(holds(labeled)) << bit;
                }
            }
            bits
        };
        let literals: Vec<Vec<u64>> = descriptions
            .literals
            .iter()
            .map(|literal| set(&|labeled: &LabeledObject| literal.holds(labeled.key)))
            .collect();
        let everything = set(&|_| true);
        let mut terms = Vec::with_capacity(descriptions.terms.len() * words);
        for term in &descriptions.terms {
            let begin = terms.len();
            terms.extend_from_slice(&everything);
            let bits = terms.get_mut(begin..).unwrap_or(&mut []);
            for literal in term.literals.iter().filter_map(|&literal| literals.get(literal)) {
                bits.iter_mut().zip(literal).for_each(|(word, also)| *word &= also);
            }
        }
        Self {
            words,
            changed: set(&|labeled| labeled.label == Label::Changed),
            left_out: set(&|labeled| labeled.label == Label::LeftOut),
            places: labeled_objects.iter().map(|labeled| labeled.place).collect(),
            terms,
        }
    }

    /// A bit set for each description, concatenated.
    pub(crate) fn members(&self, sets: &[Description]) -> Vec<u64> {
        let words = self.words;
        let mut members: Vec<u64> = Vec::with_capacity(sets.len() * words);
        members.resize(words, 0);
        for set in sets.iter().skip(1) {
            for word in 0..words {
                let parent = require!(members.get(set.parent * words + word), "the parent precedes its set");
                let term = require!(self.terms.get(set.term * words + word), "term {} exists", set.term);
                members.push(parent.copied().unwrap_or(0) | term.copied().unwrap_or(0));
            }
        }
        members
    }

    /// The number of objects that contradict a rule about all objects of a set.
    pub(crate) fn label_errors(&self, members: Members<'_>) -> u64 {
        let words = members.iter().zip(&self.changed).zip(&self.left_out);
        words
            .map(|((members, changed), left_out)| {
                u64::from(((members ^ changed) & (changed | left_out)).count_ones())
            })
            .sum()
    }

    /// The members of a set among those of all.
    pub(crate) fn row<'a>(&self, members: Members<'a>, set: usize) -> Members<'a> {
        let begin = set * self.words;
        require!(members.get(begin..begin + self.words), "set {set} has members").unwrap_or(&[])
    }

    fn each<'a>(&'a self, members: Members<'a>) -> impl Iterator<Item = (usize, Option<Place>)> + 'a {
        let is_member =
            |index: usize| members.get(index / 64).is_some_and(|word| word >> (index % 64) & 1 == 1);
        self.places.iter().copied().enumerate().filter(move |(index, _)| is_member(*index))
    }

    pub(crate) fn extent(&self, members: Members<'_>) -> Extent {
        Extent::of(self.each(members).filter_map(|(_, place)| place))
    }

    /// The members of a set that have this relation within it.
    fn standing(&self, relation: Relation, members: Members<'_>, extent: &Extent) -> Vec<u64> {
        let mut bits = vec![0_u64; self.words];
        for (index, place) in self.each(members) {
            if place.is_some_and(|place| relation.holds(place, extent))
                && let Some(word) = bits.get_mut(index / 64)
            {
                *word |= 1 << (index % 64);
            }
        }
        bits
    }

    /// Whether the demonstration is consistent with a selection, and log P(demonstration|h).
    pub(crate) fn evaluate(
        &self,
        selection: Selection,
        members: Members<'_>,
        extent: &Extent,
        label_errors: Option<(f64, f64)>,
    ) -> (bool, f64) {
        if let Selection::Relation(relation) = selection {
            let standing = self.standing(relation, members, extent);
            let wrong = self.label_errors(&standing);
            let log = label_errors.map_or(0.0, |(log_error, log_correct)| {
                let both = self.changed.iter().chain(&self.left_out).map(|word| u64::from(word.count_ones()));
                let all = both.sum::<u64>();
                float(wrong).mul_add(log_error, float(all - wrong) * log_correct)
            });
            return (wrong == 0, log);
        }
        let count = |of: &[u64], inside: bool| -> usize {
            let words =
                of.iter().zip(members).map(|(of, members)| of & if inside { *members } else { !members });
            words.map(|word| usize::try_from(word.count_ones()).unwrap_or(0)).sum()
        };
        let all: usize = members.iter().map(|word| usize::try_from(word.count_ones()).unwrap_or(0)).sum();
        let Some(wanted) = selection.wanted(all) else { return (false, f64::NEG_INFINITY) };
        let (changed, left_out) = (count(&self.changed, true), count(&self.left_out, true));
        let already = all - changed - left_out;
        let need = wanted.saturating_sub(already).min(changed + left_out);
        let (strays, others) = (count(&self.changed, false), count(&self.left_out, false));
        let is_consistent = strays == 0 && changed == need;
        let log = label_errors.map_or(0.0, |label_errors| {
            log_random_choice(changed, left_out, need, strays, others, label_errors)
        });
        (is_consistent, log)
    }

    /// Adds `weight`, times the probability that the selection includes the object, to the entry of each object.
    pub(crate) fn add_shares(
        &self,
        selection: Selection,
        members: Members<'_>,
        weight: f64,
        about: &mut [f64],
    ) {
        let standing;
        let kept = match selection {
            Selection::Relation(relation) => {
                standing = self.standing(relation, members, &self.extent(members));
                &standing
            }
            Selection::All | Selection::Exactly(_) | Selection::AllBut(_) => members,
        };
        let all = self.each(members).count();
        let share = match selection {
            Selection::Exactly(_) | Selection::AllBut(_) => {
                let wanted = match selection.wanted(all) {
                    Some(wanted) => wanted,
                    None if matches!(selection, Selection::Exactly(_)) => all,
                    None => 0,
                };
                float_of_count(wanted) / float_of_count(all.max(1))
            }
            Selection::All | Selection::Relation(_) => 1.0,
        };
        for (index, _) in self.each(kept) {
            if let Some(sum) = about.get_mut(index) {
                *sum += weight * share;
            }
        }
    }
}

/// log P of a demonstration whose teacher chooses `need` objects uniformly out of `changed` + `left_out`, and then
/// mislabels each object independently. `strays` and `others` are the changed and left-out objects outside the set.
///
/// Σk C(changed, k) C(left out, need - k) / C(all, need) · ε^slips (1 - ε)^others
fn log_random_choice(
    changed: usize,
    left_out: usize,
    need: usize,
    strays: usize,
    others: usize,
    (log_error, log_correct): (f64, f64),
) -> f64 {
    let all = changed + left_out;
    let mut sum = LogSum::default();
    for selected in need.saturating_sub(left_out)..=need.min(changed) {
        // Chosen but not changed, plus changed but not chosen.
        let label_errors = need - selected + changed - selected + strays;
        let log_choices =
            log_choose(changed, selected) + log_choose(left_out, need - selected) - log_choose(all, need);
        let right_ones = float_of_count(all + strays + others - label_errors);
        sum.add(
            float_of_count(label_errors).mul_add(log_error, right_ones.mul_add(log_correct, log_choices)),
        );
    }
    sum.value()
}

/// ln C(n, k).
fn log_choose(n: usize, k: usize) -> f64 {
    (1..=k.min(n)).map(|i| (float_of_count(n + 1 - i) / float_of_count(i)).ln()).sum()
}
