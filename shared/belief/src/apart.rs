/// Which beliefs cannot be of one thing, because they hold observations of the same source and
/// instant: what one sensor sees at once as two is two.
///
/// Within a step each new belief belongs to the group of its source and instant, and merging
/// joins groups. When the step ends, every two beliefs that share a group are apart for good; a
/// bit matrix over the slots remembers it.
#[derive(Clone, Debug)]
pub(crate) struct Apart {
    groups: Box<[u64]>,
    rows: Box<[u64]>,
    words: usize,
    members: Box<[u64]>,
}

/// Groups that one step can tell apart.
pub(crate) const GROUPS: usize = 64;

impl Apart {
    pub(crate) fn new(slots: usize) -> Self {
        let words = slots.div_ceil(64);
        let zeros = |count: usize| vec![0; count].into_boxed_slice();
        Self { groups: zeros(slots), rows: zeros(slots * words), words, members: zeros(words) }
    }

    /// A new belief belongs to a group.
    pub(crate) fn join(&mut self, slot: usize, group: usize) {
        if let Some(groups) = self.groups.get_mut(slot) {
            *groups |= 1 << (group % GROUPS);
        }
    }

    /// Whether two beliefs cannot be of one thing.
    pub(crate) fn are(&self, a: usize, b: usize) -> bool {
        let groups = |slot: usize| self.groups.get(slot).copied().unwrap_or(0);
        groups(a) & groups(b) != 0
            || self.rows.get(a * self.words + b / 64).is_some_and(|row| row >> (b % 64) & 1 == 1)
    }

    /// The belief in `gone` is merged into the one in `kept`: whatever was apart from one is
    /// apart from both.
    pub(crate) fn merge(&mut self, kept: usize, gone: usize) {
        let groups = self.groups.get(gone).copied().unwrap_or(0);
        if let Some(joined) = self.groups.get_mut(kept) {
            *joined |= groups;
        }
        for word in 0..self.words {
            let mut others = self.rows.get(gone * self.words + word).copied().unwrap_or(0);
            while others != 0 {
                let other = word * 64 + usize::try_from(others.trailing_zeros()).unwrap_or(0);
                others &= others - 1;
                self.set(kept, other);
                self.set(other, kept);
            }
        }
        self.forget(gone);
    }

    /// The slot holds no belief any more.
    pub(crate) fn forget(&mut self, slot: usize) {
        if let Some(groups) = self.groups.get_mut(slot) {
            *groups = 0;
        }
        for word in 0..self.words {
            let Some(row) = self.rows.get_mut(slot * self.words + word) else { return };
            let mut others = std::mem::take(row);
            while others != 0 {
                let other = word * 64 + usize::try_from(others.trailing_zeros()).unwrap_or(0);
                others &= others - 1;
                if let Some(row) = self.rows.get_mut(other * self.words + slot / 64) {
                    *row &= !(1 << (slot % 64));
                }
            }
        }
    }

    /// The step ends: remembers for good which of the `live` beliefs share one of its `groups`.
    pub(crate) fn settle(&mut self, live: &[usize], groups: usize) {
        for group in 0..groups.min(GROUPS) {
            self.members.fill(0);
            let belongs =
                |groups: &[u64], slot: usize| groups.get(slot).is_some_and(|groups| groups >> group & 1 == 1);
            for &slot in live.iter().filter(|&&slot| belongs(&self.groups, slot)) {
                if let Some(word) = self.members.get_mut(slot / 64) {
                    *word |= 1 << (slot % 64);
                }
            }
            for &slot in live.iter().filter(|&&slot| belongs(&self.groups, slot)) {
                let rows = self.rows.iter_mut().skip(slot * self.words);
                for (word, (row, members)) in rows.zip(&self.members).enumerate() {
                    let itself = if word == slot / 64 { 1 << (slot % 64) } else { 0 };
                    *row |= members & !itself;
                }
            }
        }
        for &slot in live {
            if let Some(groups) = self.groups.get_mut(slot) {
                *groups = 0;
            }
        }
    }

    fn set(&mut self, slot: usize, other: usize) {
        if let Some(row) = self.rows.get_mut(slot * self.words + other / 64) {
            *row |= 1 << (other % 64);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The matrix against sets of all that every belief ever held.
        #[test]
        fn two_are_apart_exactly_when_they_hold_observations_of_one_source_and_instant(
            steps in prop::collection::vec(
                (prop::collection::vec(0..3_usize, 0..6), prop::collection::vec((0..64_usize, 0..64_usize, any::<bool>()), 0..8)),
                1..6,
            ),
        ) {
            let mut apart = Apart::new(70);
            let mut held: Vec<(usize, BTreeSet<(usize, usize)>)> = Vec::new();
            let mut free: Vec<usize> = (0..70).collect();
            for (step, (new, ends)) in steps.iter().enumerate() {
                for &group in new {
                    let slot = free.pop().unwrap();
                    apart.join(slot, group);
                    held.push((slot, BTreeSet::from([(step, group)])));
                }
                for &(one, other, merge) in ends {
                    if held.len() < 2 {
                        continue;
                    }
                    let gone = held.remove(one % held.len());
                    if merge {
                        let index = other % held.len();
                        apart.merge(held[index].0, gone.0);
                        held[index].1.extend(gone.1);
                    } else {
                        apart.forget(gone.0);
                    }
                    // Not before the step ends is a slot used again.
                }
                apart.settle(&held.iter().map(|(slot, _)| *slot).collect::<Vec<_>>(), 3);
                free = (0..70).filter(|slot| held.iter().all(|(held, _)| held != slot)).collect();
                for (a, of_a) in &held {
                    for (b, of_b) in held.iter().filter(|(b, _)| b != a) {
                        prop_assert_eq!(apart.are(*a, *b), !of_a.is_disjoint(of_b));
                    }
                }
            }
        }
    }

    #[test]
    fn what_was_seen_at_once_is_apart_now_and_later() {
        let mut apart = Apart::new(200);
        apart.join(3, 0);
        apart.join(150, 0);
        apart.join(7, 1);
        assert!(apart.are(3, 150) && !apart.are(3, 7));
        apart.settle(&[3, 7, 150], 2);
        assert!(apart.are(3, 150) && apart.are(150, 3) && !apart.are(3, 7) && !apart.are(3, 3));
    }

    #[test]
    fn a_merged_belief_inherits_what_its_parts_were_apart_from() {
        let mut apart = Apart::new(200);
        apart.join(3, 0);
        apart.join(150, 0);
        apart.settle(&[3, 7, 150], 1);
        apart.merge(7, 150);
        assert!(apart.are(7, 3) && apart.are(3, 7) && !apart.are(3, 150));
        apart.forget(3);
        assert!(!apart.are(7, 3) && !apart.are(3, 7));
    }

    #[test]
    fn within_a_step_a_merged_belief_is_of_both_groups() {
        let mut apart = Apart::new(10);
        apart.join(1, 0);
        apart.join(2, 1);
        apart.join(3, 1);
        apart.merge(1, 2);
        assert!(apart.are(1, 3));
        apart.settle(&[1, 3], 2);
        assert!(apart.are(1, 3) && apart.are(3, 1));
    }
}
