//! The class features of an object as one number, and the bits of it that a template selects.

/// Maximum number of class features for learning; the number of templates is two to this power.
pub const MAX_FEATURES: usize = 12;
/// Maximum number of distinct values of a class feature.
pub const MAX_VALUES: usize = (1 << BITS) - 2;

/// Bits of a key for each feature: twelve features fit 128 bits.
const BITS: u32 = 10;
/// The largest number of a value: the bits of one feature.
pub(super) const FIELD: u32 = (1 << BITS) - 1;

/// All class features of an object in one bit field each: the number of its value from 1, or 0 if it has none. A
/// key masked by a template is the class of the object.
pub(crate) type Key = u128;

/// A template as a bit mask: bit i stands for feature i of the lexicon.
pub(crate) type Mask = u16;

/// The lowest bit of a feature in a key.
pub(super) fn shift(feature: usize) -> u32 {
    u32::try_from(feature).unwrap_or(0) * BITS
}

/// Whether a template has a feature.
pub(crate) const fn has(mask: Mask, feature: usize) -> bool {
    mask >> feature & 1 == 1
}

/// The value number of a feature in a key; 0 if it has none.
pub(crate) fn field(key: Key, feature: usize) -> u32 {
    u32::try_from(key >> shift(feature) & Key::from(FIELD)).unwrap_or(0)
}

/// The key with another value of one feature.
pub(crate) fn with_field(key: Key, feature: usize, value: u32) -> Key {
    key & !field_mask(feature) | Key::from(value) << shift(feature)
}

fn field_mask(feature: usize) -> Key {
    Key::from(FIELD) << shift(feature)
}

/// The bits of a key that a template selects.
pub(crate) fn key_mask(mask: Mask) -> Key {
    (0..MAX_FEATURES)
        .filter(|&feature| has(mask, feature))
        .fold(0, |bits, feature| bits | field_mask(feature))
}

/// The features that have a value in a key.
pub(crate) fn present(key: Key) -> Mask {
    (0..MAX_FEATURES).filter(|&feature| field(key, feature) != 0).fold(0, |mask, feature| mask | 1 << feature)
}
