use rustc_hash::{FxHashMap, FxHashSet};

use crate::{Class, Object, Template};

/// Maximum number of class features for learning; the number of templates is two to this power.
pub const MAX_FEATURES: usize = 12;
/// Maximum number of distinct values of a class feature.
pub const MAX_VALUES: usize = (1 << BITS) - 2;

/// Bits of a key for each feature: twelve features fit 128 bits.
const BITS: u32 = 10;
const FIELD: u32 = (1 << BITS) - 1;

/// All class features of an object in one bit field each: the number of its value from 1, or 0 if it has none. A
/// key masked by a template is the class of the object.
pub(crate) type Key = u128;

/// A template as a bit mask: bit i stands for feature i of the lexicon.
pub(crate) type Mask = u16;

/// Maps features and values to numbers and back. Features are numbered in alphabetical order.
#[derive(Clone, Debug)]
pub(crate) struct Lexicon {
    features: Vec<FeatureValues>,
}

#[derive(Clone, Debug)]
struct FeatureValues {
    name: String,
    values: Vec<String>,
    numbers: FxHashMap<String, u32>,
}

impl Lexicon {
    /// A lexicon of the first [`MAX_FEATURES`] features.
    pub(crate) fn new<'a>(features: impl Iterator<Item = &'a str>) -> Self {
        let mut names: Vec<&str> = features.take(MAX_FEATURES).collect();
        names.sort_unstable();
        names.dedup();
        let words = |name: &str| FeatureValues {
            name: name.to_owned(),
            values: Vec::new(),
            numbers: FxHashMap::default(),
        };
        Self { features: names.into_iter().map(words).collect() }
    }

    pub(crate) fn features(&self) -> usize {
        self.features.len()
    }

    /// The key of an object; assigns numbers to new values. Values beyond [`MAX_VALUES`] count as missing.
    pub(crate) fn key(&mut self, object: &Object) -> Key {
        let mut key = 0;
        for (index, words) in self.features.iter_mut().enumerate() {
            let Some(value) = object.features.get(&words.name) else { continue };
            key |= Key::from(words.number(value)) << shift(index);
        }
        key
    }

    /// The key of an object without adding values. An unknown value gets a number that no known value has.
    pub(crate) fn key_of_known(&self, object: &Object) -> Key {
        let mut key = 0;
        for (index, words) in self.features.iter().enumerate() {
            let Some(value) = object.features.get(&words.name) else { continue };
            key |= Key::from(words.numbers.get(value).copied().unwrap_or(FIELD)) << shift(index);
        }
        key
    }

    pub(crate) fn template(&self, mask: Mask) -> Template {
        let chosen = self.features.iter().enumerate().filter(|(index, _)| has(mask, *index));
        chosen.map(|(_, words)| words.name.clone()).collect()
    }

    /// The names of the values of a key, for the features of a template.
    pub(crate) fn class(&self, mask: Mask, key: Key) -> Class {
        let chosen = self.features.iter().enumerate().filter(|(index, _)| has(mask, *index));
        chosen.map(|(index, words)| words.value(field(key, index)).to_owned()).collect()
    }

    pub(crate) fn feature(&self, index: usize) -> &str {
        self.features.get(index).map_or("", |words| &words.name)
    }

    pub(crate) fn value(&self, index: usize, number: u32) -> &str {
        self.features.get(index).map_or("", |words| words.value(number))
    }
}

impl FeatureValues {
    fn number(&mut self, value: &str) -> u32 {
        if let Some(&number) = self.numbers.get(value) {
            return number;
        }
        // The last number is reserved for unknown values.
        let number = u32::try_from(self.values.len() + 1).ok().filter(|&number| number < FIELD);
        let Some(number) = number else { return 0 };
        self.values.push(value.to_owned());
        self.numbers.insert(value.to_owned(), number);
        number
    }

    fn value(&self, number: u32) -> &str {
        let index = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
        index.and_then(|index| self.values.get(index)).map_or("", String::as_str)
    }
}

fn shift(feature: usize) -> u32 {
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

/// The kinds of objects that a goal could apply to, over all examples.
#[derive(Clone, Debug, Default)]
pub(crate) struct SeenKinds {
    kinds: FxHashSet<Key>,
    /// The values seen, by feature.
    values: Vec<Vec<u32>>,
    /// The features that some object lacked.
    lacking: Mask,
}

impl SeenKinds {
    pub(crate) fn new(features: usize) -> Self {
        Self { values: vec![Vec::new(); features], ..Self::default() }
    }

    /// Registers a kind of object. Returns `true` if it has a new value, or is the first to lack a feature.
    pub(crate) fn register(&mut self, key: Key) -> bool {
        if !self.kinds.insert(key) {
            return false;
        }
        let mut is_new = false;
        for (index, values) in self.values.iter_mut().enumerate() {
            match field(key, index) {
                0 if !has(self.lacking, index) => {
                    self.lacking |= 1 << index;
                    is_new = true;
                }
                0 => {}
                value if !values.contains(&value) => {
                    values.push(value);
                    is_new = true;
                }
                _ => {}
            }
        }
        is_new
    }

    /// Whether every object had every feature.
    pub(crate) const fn is_complete(&self) -> bool {
        self.lacking == 0
    }

    /// The values seen of a feature; `None` if some object lacked it, since then even a single value divides the
    /// objects.
    pub(crate) fn all_values(&self, feature: usize) -> Option<&[u32]> {
        if has(self.lacking, feature) { None } else { self.values.get(feature).map(Vec::as_slice) }
    }

    /// The values seen of every feature.
    pub(crate) fn values(&self) -> &[Vec<u32>] {
        &self.values
    }

    /// The kinds seen, in the order of their keys.
    pub(crate) fn kinds(&self) -> Vec<Key> {
        let mut kinds: Vec<Key> = self.kinds.iter().copied().collect();
        kinds.sort_unstable();
        kinds
    }

    /// The distinct classes seen under a template, sorted by key.
    pub(crate) fn classes(&self, mask: Mask) -> Vec<Key> {
        let bits = key_mask(mask);
        let complete = self.kinds.iter().filter(|&&key| present(key) & mask == mask);
        let mut classes: Vec<Key> = complete.map(|key| key & bits).collect();
        classes.sort_unstable();
        classes.dedup();
        classes
    }
}
