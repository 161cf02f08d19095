//! Sets of small numbers.

/// A set of small numbers. Equality depends on the members alone, not on the order of insertion.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct BitSet(Vec<u64>);

const WORD: usize = 64;

impl BitSet {
    pub(crate) fn insert(&mut self, number: usize) {
        let index = number / WORD;
        if self.0.len() <= index {
            self.0.resize(index + 1, 0);
        }
        if let Some(word) = self.0.get_mut(index) {
            *word |= 1 << (number % WORD);
        }
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn len(&self) -> usize {
        self.0.iter().map(|word| usize::try_from(word.count_ones()).unwrap_or(0)).sum()
    }

    /// The set as a row of exactly `words` words; `words` must be large enough to hold it.
    pub(crate) fn row(&self, words: usize) -> Vec<u64> {
        self.0.iter().copied().chain(std::iter::repeat(0)).take(words).collect()
    }

    /// Adds all numbers of another set; `true` if any of them is new.
    pub(crate) fn union_with(&mut self, other: &Self) -> bool {
        if self.0.len() < other.0.len() {
            self.0.resize(other.0.len(), 0);
        }
        let mut grew = false;
        for (word, more) in self.0.iter_mut().zip(&other.0) {
            grew |= more & !*word != 0;
            *word |= more;
        }
        grew
    }
}

/// The numbers whose bits are set in a row of words.
pub(crate) fn numbers(row: &[u64]) -> Vec<usize> {
    let of_word = |(index, &word): (usize, &u64)| {
        let bits = (0..WORD).filter(move |bit| word >> bit & 1 == 1);
        bits.map(move |bit| index * WORD + bit)
    };
    row.iter().enumerate().flat_map(of_word).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(numbers: &[usize]) -> BitSet {
        let mut bits = BitSet::default();
        numbers.iter().for_each(|&number| bits.insert(number));
        bits
    }

    #[test]
    fn bit_sets_work_across_word_boundaries() {
        let (few, many) = (bits(&[3, 70]), bits(&[3, 5, 70, 200]));
        assert_eq!((many.len(), numbers(&many.row(4))), (4, vec![3, 5, 70, 200]));
        assert_eq!(numbers(&few.row(9)), [3, 70]);
        let mut united = few.clone();
        assert!(united.union_with(&many) && !united.union_with(&few));
        assert_eq!(united, many);
    }
}
