/// Up to four gate keys of a member. A mismatch in any of them excludes a merge. Packed into one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GateKeys(u64);

/// A set of key positions, as a mask of the highest bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct KeyPositions(u64);

/// Number of keys in the word, and bits per key.
const MAX_GATE_KEYS: usize = 4;
const KEY_BITS: usize = 16;
/// The highest bit of each key; set if a symbol could not be represented.
const HIGHEST: u64 = 0x8000_8000_8000_8000;
const INCOMPLETE: u16 = 0x8000;
/// Value of an absent key, or of one that cannot be represented.
const NO_KEY: u16 = 0x7FFF;

impl GateKeys {
    /// No keys.
    pub const NONE: Self = Self(0x7FFF_7FFF_7FFF_7FFF);

    /// Sets the key at `place`. Keys beyond the fourth, and symbols from 0x7FFF on, are not represented.
    #[inline]
    pub fn set(&mut self, place: usize, symbol: u16) {
        if place >= MAX_GATE_KEYS {
            // More keys than the word holds.
            self.0 |= HIGHEST;
        } else if symbol < NO_KEY {
            let shift = place * KEY_BITS;
            self.0 = self.0 & !(u64::from(NO_KEY) << shift) | u64::from(symbol) << shift;
        } else {
            self.0 |= u64::from(INCOMPLETE) << (place * KEY_BITS);
        }
    }

    /// Whether all keys that were set are represented. If so, two members without a mismatch ([`Self::mismatches`])
    /// have no differing keys.
    #[must_use]
    #[inline]
    pub const fn are_complete(self) -> bool {
        self.0 & HIGHEST == 0
    }

    /// The set of the first `count` positions; `None` if the word has fewer.
    pub(crate) const fn first(count: usize) -> Option<KeyPositions> {
        match count {
            0..MAX_GATE_KEYS => Some(KeyPositions(HIGHEST & !(u64::MAX << (count * KEY_BITS)))),
            MAX_GATE_KEYS => Some(KeyPositions(HIGHEST)),
            _ => None,
        }
    }

    /// Whether exactly the keys at these positions are present, and all keys that were set are represented.
    #[must_use]
    #[inline]
    pub(crate) const fn are_exactly(self, places: KeyPositions) -> bool {
        self.are_complete() && self.has() == places.0
    }

    /// Whether the other has a key at every position where this one has; `false` unless all keys of both are
    /// represented.
    #[must_use]
    #[inline]
    pub fn is_subset_of(self, other: Self) -> bool {
        self.are_complete() && other.are_complete() && self.has() & !other.has() == 0
    }

    /// Mask of the keys that are present.
    #[inline]
    const fn has(self) -> u64 {
        some(self.0 ^ Self::NONE.0)
    }

    /// Whether a key that both have differs. Their distance is then not below the threshold.
    #[must_use]
    #[inline]
    pub fn mismatches(self, other: Self) -> bool {
        some(self.0 ^ other.0) & self.has() & other.has() != 0
    }
}

/// Mask of the positions whose lower 15 bits are not all zero.
#[inline]
const fn some(bits: u64) -> u64 {
    // With the highest bits cleared, no carry leaves its position. The sum sets the highest bit exactly where the lower
    // bits were not zero.
    ((bits & !HIGHEST) + !HIGHEST) & HIGHEST
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn gate_keys(set: &[Option<u16>]) -> GateKeys {
        let mut gate_keys = GateKeys::NONE;
        for (place, symbol) in set.iter().enumerate() {
            if let Some(symbol) = symbol {
                gate_keys.set(place, *symbol);
            }
        }
        gate_keys
    }

    fn drawn() -> impl Strategy<Value = Vec<Option<u16>>> {
        let symbol = prop_oneof![0..3_u16, 0x7FFC..0x8002_u16, 0xFFFE..=u16::MAX];
        prop::collection::vec(prop::option::of(symbol), 6)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4_000))]

        #[test]
        fn gate_keys_agree_with_the_full_distance(
            a in drawn(), b in drawn(), places in 1..=6_usize,
        ) {
            let (a, b) = (&a[..places], &b[..places]);
            let differ = a.iter().zip(b).any(|pair| matches!(pair, (Some(a), Some(b)) if a != b));
            let (of_a, of_b) = (gate_keys(a), gate_keys(b));
            let is_subset_of = a.iter().zip(b).all(|(a, b)| a.is_none() || b.is_some());
            prop_assert_eq!(of_a.is_subset_of(of_b), is_subset_of && of_a.are_complete() && of_b.are_complete());
            if of_a.mismatches(of_b) {
                prop_assert!(differ);
            } else if of_a.are_complete() && of_b.are_complete() {
                prop_assert!(!differ);
            }
            let fits = |set: &[Option<u16>]| {
                set.iter().enumerate().all(|(place, symbol)| symbol.is_none_or(|it| place < 4 && it < 0x7FFF))
            };
            prop_assert_eq!(of_a.are_complete(), fits(a));
            let has_all = GateKeys::first(places).is_some_and(|all| of_a.are_exactly(all));
            prop_assert_eq!(has_all, fits(a) && places <= MAX_GATE_KEYS && a.iter().all(Option::is_some));
        }
    }
}
