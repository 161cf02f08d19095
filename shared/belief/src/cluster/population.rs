/// What is clustered: members in numbered slots, merged pair by pair.
///
/// It says what the distance D of two members is and what merging (M) does to them; the clustering
/// says which are merged, in which order. A belief system is one; so are points under the linkage
/// of one's choice.
pub trait Population {
    /// Slots of the members that were there before, in the order of their identities; some may
    /// live no more.
    fn old(&self) -> &[u32];

    /// Slots of the members that have come since, in the order of their identities, which are all
    /// higher than those of the old; some may live no more.
    fn fresh(&self) -> &[u32];

    /// Whether the slot holds a member.
    fn lives(&self, slot: u32) -> bool;

    /// The identity of a member: of a pair, the lower one is kept.
    fn id(&self, slot: u32) -> u64;

    /// A number that is another whenever the member in the slot has changed or ended.
    fn version(&self, slot: u32) -> u32;

    /// Where a member is, in metres; without a place, it is within reach of everybody.
    fn place(&self, slot: u32) -> Option<[f32; 3]>;

    /// The symbols that tell a member from others at a glance.
    fn symbols(&self, _slot: u32) -> Symbols {
        Symbols::NONE
    }

    /// D of two members, where it is below the threshold and they may be merged: not NaN, and the
    /// same whichever is named first.
    fn distance(&self, a: u32, b: u32) -> Option<f64>;

    /// The same of two of whom it is known what is seen of them at a glance, and whom that does not tell apart: it
    /// may say all there is to say.
    fn distance_seen(&self, (a, _): (u32, &Seen), (b, _): (u32, &Seen)) -> Option<f64> {
        self.distance(a, b)
    }

    /// How far apart two members are at most, in metres, whose D is no larger than this.
    fn reach_m(&self, _distance: f64) -> f64 {
        f64::INFINITY
    }

    /// Whether the old member, should it take in the fresh one, is then between the places of the two,
    /// and no symbol that tells it from others is lost.
    fn takes_in(&self, _old: u32, _fresh: u32) -> bool {
        false
    }

    /// Whether an old member is one of those of which no two are ever merged, whatever fresh member
    /// each takes in.
    fn is_companion(&self, _old: u32) -> bool {
        false
    }

    /// Whether two members are never merged, whatever fresh ones each takes in, at most one of each frame.
    fn stay_apart(&self, _a: u32, _b: u32) -> bool {
        false
    }

    /// The source and the instant of the frame that a fresh member is of: no two of one frame are ever
    /// merged, nor who takes in one with another or with who takes in another. `None` where frames do not
    /// keep members apart.
    fn frame(&self, _fresh: u32) -> Option<(u16, u64)> {
        None
    }

    /// What no D between any two of these members will exceed, nor between what becomes of them when some
    /// are merged, in whichever order: the first is the oldest, each of the others a fresh one of
    /// another frame. `None` where that cannot be told or is not below the threshold, where what
    /// they become may not be between their places or may lose a symbol that tells it from others, or where
    /// it may forget of which frames it has members.
    fn spread(&self, _members: &[u32]) -> Option<f64> {
        None
    }

    /// Whether it is of use to be told who is [expected](Self::expect).
    fn are_expected(&self) -> bool {
        true
    }

    /// The two are about to be merged, so that their memory may be fetched; `soon` says that it is the second
    /// time of saying so, and few others come before them.
    fn expect(&self, _kept: u32, _gone: u32, _soon: bool) {}

    /// Merges the member in `gone` into the one in `kept`; `gone` ends.
    fn merge(&mut self, kept: u32, gone: u32);
}

/// What is seen of a member at a glance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Its [place](Population::place), in metres.
    pub place_m: [f32; 3],
    /// Its [symbols](Population::symbols).
    pub symbols: Symbols,
}

/// Up to four symbols of a member, each of which alone tells it from a member with another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Symbols(u64);

/// Places of symbols, of those that are glanced at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Places(u64);

/// Symbols that are compared at a glance, and the bits of each.
const GLANCED_AT: usize = 4;
const SYMBOL_BITS: usize = 16;
/// The highest bit of each, set where a symbol was set that is not looked at.
const HIGHEST: u64 = 0x8000_8000_8000_8000;
const NOT_ALL: u16 = 0x8000;
/// In the place of a symbol that a belief has not, or that needs the highest bit.
const NO_SYMBOL: u16 = 0x7FFF;

impl Symbols {
    /// Of a belief without any.
    pub const NONE: Self = Self(0x7FFF_7FFF_7FFF_7FFF);

    /// Sets the symbol at `place`; those beyond the fourth, and the highest, are not glanced at.
    #[inline]
    pub fn set(&mut self, place: usize, symbol: u16) {
        if place >= GLANCED_AT {
            // There are more than are looked at.
            self.0 |= HIGHEST;
        } else if symbol < NO_SYMBOL {
            let shift = place * SYMBOL_BITS;
            self.0 = self.0 & !(u64::from(NO_SYMBOL) << shift) | u64::from(symbol) << shift;
        } else {
            self.0 |= u64::from(NOT_ALL) << (place * SYMBOL_BITS);
        }
    }

    /// Whether they are all that were set: two that are not [told apart](Self::tell_apart) have then no two
    /// different ones.
    #[must_use]
    #[inline]
    pub const fn are_all(self) -> bool {
        self.0 & HIGHEST == 0
    }

    /// What says that the first so many are all there: nothing does where there are more than are glanced at.
    pub(crate) const fn first(count: usize) -> Option<Places> {
        match count {
            0..GLANCED_AT => Some(Places(HIGHEST & !(u64::MAX << (count * SYMBOL_BITS)))),
            GLANCED_AT => Some(Places(HIGHEST)),
            _ => None,
        }
    }

    /// Whether it has a symbol at these places and no other, and they are all that were set.
    #[must_use]
    #[inline]
    pub(crate) const fn are_at(self, places: Places) -> bool {
        self.are_all() && self.has() == places.0
    }

    /// Whether the other has a symbol wherever this one has, as far as all are glanced at.
    #[must_use]
    #[inline]
    pub fn are_among(self, other: Self) -> bool {
        self.are_all() && other.are_all() && self.has() & !other.has() == 0
    }

    /// The highest bit of each symbol that it has, of those that are glanced at.
    #[inline]
    const fn has(self) -> u64 {
        some(self.0 ^ Self::NONE.0)
    }

    /// Whether a symbol that both have differs: their distance is then not below the threshold.
    #[must_use]
    #[inline]
    pub fn tell_apart(self, other: Self) -> bool {
        some(self.0 ^ other.0) & self.has() & other.has() != 0
    }
}

/// The highest bit of each place whose other bits are not all zero.
#[inline]
const fn some(bits: u64) -> u64 {
    // Without their highest bits no carry leaves its place: a sum has the bit where the number added to all ones
    // but the highest was not zero.
    ((bits & !HIGHEST) + !HIGHEST) & HIGHEST
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn symbols(set: &[Option<u16>]) -> Symbols {
        let mut symbols = Symbols::NONE;
        for (place, symbol) in set.iter().enumerate() {
            if let Some(symbol) = symbol {
                symbols.set(place, *symbol);
            }
        }
        symbols
    }

    fn drawn() -> impl Strategy<Value = Vec<Option<u16>>> {
        let symbol = prop_oneof![0..3_u16, 0x7FFC..0x8002_u16, 0xFFFE..=u16::MAX];
        prop::collection::vec(prop::option::of(symbol), 6)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4_000))]

        #[test]
        fn who_is_told_apart_differs_and_who_is_not_does_not_where_all_are_glanced_at(
            a in drawn(), b in drawn(), places in 1..=6_usize,
        ) {
            let (a, b) = (&a[..places], &b[..places]);
            let differ = a.iter().zip(b).any(|pair| matches!(pair, (Some(a), Some(b)) if a != b));
            let (of_a, of_b) = (symbols(a), symbols(b));
            let are_among = a.iter().zip(b).all(|(a, b)| a.is_none() || b.is_some());
            prop_assert_eq!(of_a.are_among(of_b), are_among && of_a.are_all() && of_b.are_all());
            if of_a.tell_apart(of_b) {
                prop_assert!(differ);
            } else if of_a.are_all() && of_b.are_all() {
                prop_assert!(!differ);
            }
            let fits = |set: &[Option<u16>]| {
                set.iter().enumerate().all(|(place, symbol)| symbol.is_none_or(|it| place < 4 && it < 0x7FFF))
            };
            prop_assert_eq!(of_a.are_all(), fits(a));
            let has_all = Symbols::first(places).is_some_and(|all| of_a.are_at(all));
            prop_assert_eq!(has_all, fits(a) && places <= GLANCED_AT && a.iter().all(Option::is_some));
        }
    }
}
