//! The numbers of features and values, and their names.

use rustc_hash::FxHashMap;

use super::key::{FIELD, Key, MAX_FEATURES, Mask, field, has, shift};
use crate::demonstration::Object;

/// The class features that a hypothesis tests, T ⊆ F, in alphabetical order.
pub type Template = Vec<String>;

/// A class of objects: the values of the features of a template, in the template's order.
pub type Class = Vec<String>;

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

    /// The key of an object; assigns numbers to new values. Values beyond [`MAX_VALUES`](super::key::MAX_VALUES) count
    /// as missing.
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
