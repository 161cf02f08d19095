//! The kinds of objects seen in the examples.

use rustc_hash::FxHashSet;

use super::key::{Key, MAX_FEATURES, Mask, field, has, key_mask, present, with_field};

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

/// Removes the features that make no difference: those for which the classes contain every value seen, whatever
/// the other features.
pub(crate) fn reduce(template: Mask, mut classes: Vec<Key>, seen: &SeenKinds) -> (Mask, Vec<Key>) {
    let mut mask = template;
    for feature in (0..MAX_FEATURES).filter(|&feature| has(template, feature)) {
        let Some(values) = seen.all_values(feature).filter(|values| !values.is_empty()) else { continue };
        // The feature can only be redundant if the classes form whole rows of its values.
        if !classes.len().is_multiple_of(values.len()) {
            continue;
        }
        let set: FxHashSet<Key> = classes.iter().copied().collect();
        let has_row =
            |&class: &Key| values.iter().all(|&value| set.contains(&with_field(class, feature, value)));
        if classes.iter().all(has_row) {
            mask &= !(1 << feature);
            let bits = key_mask(mask);
            for class in &mut classes {
                *class &= bits;
            }
            classes.sort_unstable();
            classes.dedup();
        }
    }
    (mask, classes)
}
