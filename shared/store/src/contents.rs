use std::collections::BTreeMap;

use serde_json::value::RawValue;

use crate::MigrationError;
use crate::record::Change;

/// The contents of a store, as raw JSON values.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Contents {
    /// The head of each entry.
    pub(crate) heads: BTreeMap<String, Vec<u8>>,
    /// The items of each entry, by their place.
    pub(crate) items: BTreeMap<String, BTreeMap<u64, Vec<u8>>>,
}

impl Contents {
    /// Applies a change.
    pub(crate) fn apply(&mut self, change: &Change) {
        let bytes = |value: &RawValue| value.get().as_bytes().to_vec();
        match change {
            Change::Begin { .. } | Change::Told => {}
            Change::Put { key, head, place, item } => {
                self.heads.insert(key.clone(), bytes(head));
                self.items.entry(key.clone()).or_default().insert(*place, bytes(item));
            }
            Change::Head { key, head } => {
                self.heads.insert(key.clone(), bytes(head));
            }
            Change::Forget { key } => {
                self.heads.remove(key);
                self.items.remove(key);
            }
        }
    }

    /// The number of heads and items.
    pub(crate) fn size(&self) -> u64 {
        let items = self.items.values().map(BTreeMap::len).sum::<usize>();
        u64::try_from(self.heads.len() + items).unwrap_or(u64::MAX)
    }

    /// The changes that build these contents from nothing. The items of an entry are renumbered without gaps, because a
    /// reader loads them as a list and appends at the list's length.
    pub(crate) fn changes(&self) -> Result<Vec<Change>, MigrationError> {
        let mut changes = Vec::new();
        for (key, head) in &self.heads {
            let head = value(key, head)?;
            let items = self.items.get(key).filter(|items| !items.is_empty());
            let Some(items) = items else {
                changes.push(Change::Head { key: key.clone(), head });
                continue;
            };
            for (place, item) in (0..).zip(items.values()) {
                let item = value(key, item)?;
                changes.push(Change::Put { key: key.clone(), head: head.clone(), place, item });
            }
        }
        Ok(changes)
    }

    /// Adds the contents of another store: unknown entries, and items that a known entry does not have.
    pub(crate) fn merge(&mut self, other: Self) {
        for (key, head) in other.heads {
            self.heads.entry(key).or_insert(head);
        }
        for (key, items) in other.items {
            let known = self.items.entry(key).or_default();
            // Equal items are matched one to one: an item that occurs twice stays twice.
            let mut unmatched: Vec<Vec<u8>> = known.values().cloned().collect();
            for item in items.into_values() {
                if let Some(place) = unmatched.iter().position(|other| *other == item) {
                    unmatched.swap_remove(place);
                } else {
                    let next = known.last_key_value().map_or(0, |(place, _)| place + 1);
                    known.insert(next, item);
                }
            }
        }
    }
}

/// A JSON value on a single line, otherwise unchanged.
fn value(key: &str, bytes: &[u8]) -> Result<Box<RawValue>, MigrationError> {
    let wrong = |reason: String| MigrationError { key: key.to_owned(), reason };
    let text = std::str::from_utf8(bytes).map_err(|error| wrong(error.to_string()))?;
    // JSON allows line breaks only between tokens, where a space is equivalent.
    RawValue::from_string(text.replace(['\n', '\r'], " ")).map_err(|error| wrong(error.to_string()))
}
