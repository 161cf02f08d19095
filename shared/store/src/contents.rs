use std::collections::BTreeMap;

use serde_json::value::RawValue;

use crate::MigrationError;
use crate::record::Change;

/// All that a store holds, as the JSON values that it holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Contents {
    /// The head of each entry.
    pub(crate) heads: BTreeMap<String, Vec<u8>>,
    /// The items of each entry, by their places.
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

    /// How many heads and items there are.
    pub(crate) fn size(&self) -> u64 {
        let items = self.items.values().map(BTreeMap::len).sum::<usize>();
        u64::try_from(self.heads.len() + items).unwrap_or(u64::MAX)
    }

    /// The changes that make these contents out of nothing. The places of the items of an entry have no gap there:
    /// whoever reads them as a list, and appends to it, uses the numbers of the list.
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

    /// Takes in what another store holds: entries that are not known, and items that a known entry does not have.
    pub(crate) fn merge(&mut self, other: Self) {
        for (key, head) in other.heads {
            self.heads.entry(key).or_insert(head);
        }
        for (key, items) in other.items {
            let known = self.items.entry(key).or_default();
            // Who shows the same twice gives two examples.
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

/// A JSON value in one line, as it was written.
fn value(key: &str, bytes: &[u8]) -> Result<Box<RawValue>, MigrationError> {
    let wrong = |reason: String| MigrationError { key: key.to_owned(), reason };
    let text = std::str::from_utf8(bytes).map_err(|error| wrong(error.to_string()))?;
    // Within a word of JSON there is no end of a line.
    RawValue::from_string(text.replace(['\n', '\r'], " ")).map_err(|error| wrong(error.to_string()))
}
