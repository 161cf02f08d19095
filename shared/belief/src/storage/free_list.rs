use invariant::require;

/// A free list that allocates the lowest slot first. So beliefs created in sequence are contiguous in memory, in
/// whatever order slots were freed. A vector of free slots would allocate the last freed one first.
#[derive(Clone, Debug)]
pub(crate) struct FreeList {
    /// A bit per slot, set if it is free.
    words: Box<[u64]>,
    /// No word before this one has a free slot.
    first: usize,
}

const BITS: usize = 64;

impl FreeList {
    /// Slots from 0 on, all free.
    pub(crate) fn all(slots: usize) -> Self {
        let mut words = vec![u64::MAX; slots.div_ceil(BITS)].into_boxed_slice();
        if let Some(last) = words.last_mut() {
            *last >>= slots.next_multiple_of(BITS) - slots;
        }
        Self { words, first: 0 }
    }

    /// Allocates the lowest free slot; `None` if all are in use.
    pub(crate) fn take(&mut self) -> Option<u32> {
        let rest = self.words.iter_mut().enumerate().skip(self.first);
        for (index, word) in rest {
            self.first = index;
            if *word != 0 {
                let bit = word.trailing_zeros();
                *word &= *word - 1;
                return u32::try_from(index * BITS).ok().map(|slot| slot + bit);
            }
        }
        None
    }

    /// Frees a slot.
    pub(crate) fn put(&mut self, slot: u32) {
        let index = slot as usize / BITS;
        if let Some(word) = require!(self.words.get_mut(index), "slot {slot} exists") {
            *word |= 1 << (slot as usize % BITS);
            self.first = self.first.min(index);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_lowest_vacant_slot_is_allocated_first(
            slots in 1..200_u32,
            back in prop::collection::vec(prop::option::of(0..200_u32), 1..400),
        ) {
            let mut free_list = FreeList::all(slots as usize);
            let mut vacant: BTreeSet<u32> = (0..slots).collect();
            for back in back {
                match back.filter(|slot| *slot < slots) {
                    Some(slot) => {
                        free_list.put(slot);
                        vacant.insert(slot);
                    }
                    None => prop_assert_eq!(free_list.take(), vacant.pop_first()),
                }
            }
        }
    }

    #[test]
    fn an_empty_slot_table_has_no_vacant_slot() {
        assert_eq!(FreeList::all(0).take(), None);
    }
}
