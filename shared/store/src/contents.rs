use std::collections::BTreeMap;

use serde_json::value::RawValue;

use crate::record::Change;

/// The contents of a store, as raw JSON values.
#[derive(Debug, Default)]
pub(crate) struct Contents {
    /// The head of each entry.
    pub(crate) heads: BTreeMap<String, Box<RawValue>>,
    /// The items of each entry, by their place.
    pub(crate) items: BTreeMap<String, BTreeMap<u64, Box<RawValue>>>,
}

impl Contents {
    /// Applies a change.
    pub(crate) fn apply(&mut self, change: &Change) {
        match change {
            Change::Begin { .. } | Change::Told => {}
            Change::Put { key, head, place, item } => {
                self.heads.insert(key.clone(), head.clone());
                self.items.entry(key.clone()).or_default().insert(*place, item.clone());
            }
            Change::Head { key, head } => {
                self.heads.insert(key.clone(), head.clone());
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
    pub(crate) fn changes(&self) -> Vec<Change> {
        let mut changes = Vec::new();
        for (key, head) in &self.heads {
            let items = self.items.get(key).filter(|items| !items.is_empty());
            let Some(items) = items else {
                changes.push(Change::Head { key: key.clone(), head: head.clone() });
                continue;
            };
            for (place, item) in (0..).zip(items.values()) {
                let (key, head, item) = (key.clone(), head.clone(), item.clone());
                changes.push(Change::Put { key, head, place, item });
            }
        }
        changes
    }
}
