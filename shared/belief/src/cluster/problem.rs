/// The input of the clustering: members in numbered slots that are merged pair by pair.
///
/// An implementation defines the distance D of two members and the merge operation (M). The clustering decides which
/// pairs are merged, and in which order. A belief system is one implementation; points under any linkage are another.
pub trait AssociationProblem {
    /// Slots of the members of earlier steps (tracks), in order of their identities. Some may no longer be live.
    fn old(&self) -> &[u32];

    /// Slots of the members added since (detections), in order of their identities, which are all higher than those of
    /// the old members. Some may no longer be live.
    fn fresh(&self) -> &[u32];

    /// Whether the slot holds a member.
    fn is_live(&self, slot: u32) -> bool;

    /// The identity of a member. A merged pair keeps the lower one.
    fn id(&self, slot: u32) -> u64;

    /// A number that changes whenever the member in the slot is changed or removed.
    fn version(&self, slot: u32) -> u32;

    /// Position of a member, in metres. A member without a position is in the gate of every other.
    fn place(&self, slot: u32) -> Option<[f32; 3]>;

    /// The gate keys of a member: symbols whose mismatch excludes a merge.
    fn gate_keys(&self, _slot: u32) -> GateKeys {
        GateKeys::NONE
    }

    /// D of two members if it is below the threshold and they may be merged, else `None`. Never NaN, and symmetric.
    fn distance(&self, a: u32, b: u32) -> Option<f64>;

    /// Like `distance`, for a pair that already passed the gate; implementations may answer from the cached gate keys
    /// alone.
    fn gated_distance(&self, (a, _): (u32, &MemberSummary), (b, _): (u32, &MemberSummary)) -> Option<f64> {
        self.distance(a, b)
    }

    /// Upper bound on the distance in metres between two members whose D is at most `distance`.
    fn gate_radius_m(&self, _distance: f64) -> f64 {
        f64::INFINITY
    }

    /// Whether a merge of the two leaves the old member's position between the two positions, and loses none of its
    /// gate keys.
    fn is_convex_merge(&self, _old: u32, _fresh: u32) -> bool {
        false
    }

    /// Whether an old member belongs to the set whose members cannot be linked with each other, whichever new members
    /// they merge with.
    fn co_detected(&self, _old: u32) -> bool {
        false
    }

    /// Whether two members cannot be linked, even after each has merged with new members, at most one of each frame.
    fn remains_cannot_link(&self, _a: u32, _b: u32) -> bool {
        false
    }

    /// Source and instant of the frame of a new member. Two members of one frame cannot be linked, and neither can
    /// members that merged with them. `None` if frames impose no cannot-link constraints.
    fn frame(&self, _fresh: u32) -> Option<(u16, u64)> {
        None
    }

    /// Upper bound on the pairwise distance within a group, valid under any merge order. The first member is the
    /// oldest; the others are new members of different frames.
    ///
    /// `None` if there is no bound below the threshold, or if a merge might do one of the following:
    ///
    /// - move a member outside the positions of its parts;
    /// - lose a gate key;
    /// - evict a cannot-link constraint.
    fn diameter_bound(&self, _members: &[u32]) -> Option<f64> {
        None
    }

    /// Whether calls of [`Self::expect`] are useful.
    fn wants_prefetch(&self) -> bool {
        true
    }

    /// Announces the merge of a pair so that its memory can be prefetched. Each pair is announced twice; `soon` marks
    /// the second time, shortly before the merge.
    fn expect(&self, _kept: u32, _gone: u32, _soon: bool) {}

    /// Merges the member in `gone` into the one in `kept`; `gone` is removed.
    fn merge(&mut self, kept: u32, gone: u32);
}

/// The cached data of a member that the gate tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MemberSummary {
    /// Its position ([`AssociationProblem::place`]), in metres.
    pub place_m: [f32; 3],
    /// Its gate keys ([`AssociationProblem::gate_keys`]).
    pub gate_keys: GateKeys,
}

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
