//! The state shown on the pages: a versioned key-value store with delta synchronisation.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt::Write as _;

use invariant::require;

/// Maximum number of removed keys kept for deltas. A page that is further behind gets the full state.
const MAX_REMOVED_KEYS: usize = 512;

/// The newest value of every key as JSON, with the version in which it changed.
#[derive(Clone, Debug)]
pub struct StateStore {
    version: u64,
    cells: BTreeMap<String, Entry>,
    removed: VecDeque<(u64, String)>,
    /// Removals before this version are no longer kept.
    known_since: u64,
}

#[derive(Clone, Debug)]
struct Entry {
    version: u64,
    value: String,
}

impl Default for StateStore {
    fn default() -> Self {
        Self { version: 1, cells: BTreeMap::new(), removed: VecDeque::new(), known_since: 0 }
    }
}

impl StateStore {
    /// The version of the store; it grows with every change.
    #[must_use]
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Sets a value. An unchanged value does not change the version.
    pub fn put(&mut self, key: &str, value: &impl serde::Serialize) {
        // NaN and infinities become null.
        let value = serde_json::to_string(value).ok();
        let Some(value) = require!(value, "numbers and texts can be written: `{key}`") else { return };
        match self.cells.get_mut(key) {
            Some(cell) if cell.value == value => {}
            Some(cell) => {
                self.version += 1;
                *cell = Entry { version: self.version, value };
            }
            None => {
                self.version += 1;
                self.cells.insert(key.to_owned(), Entry { version: self.version, value });
            }
        }
    }

    /// Removes a key.
    pub fn remove(&mut self, key: &str) {
        if self.cells.remove(key).is_some() {
            self.version += 1;
            self.removed.push_back((self.version, key.to_owned()));
            if self.removed.len() > MAX_REMOVED_KEYS
                && let Some((version, _)) = self.removed.pop_front()
            {
                self.known_since = version;
            }
        }
    }

    /// Stores the cells of a list under keys that begin with `prefix`, and removes all others that begin so.
    pub fn put_all<V: serde::Serialize>(
        &mut self,
        prefix: &str,
        cells: impl IntoIterator<Item = (String, V)>,
    ) {
        let mut stay = BTreeSet::new();
        for (name, value) in cells {
            let key = format!("{prefix}{name}");
            self.put(&key, &value);
            stay.insert(key);
        }
        let under = self.cells.range(prefix.to_owned()..).map(|(key, _)| key);
        let under = under.take_while(|key| key.starts_with(prefix));
        let going: Vec<String> = under.filter(|key| !stay.contains(*key)).cloned().collect();
        for key in going {
            self.remove(&key);
        }
    }

    /// An empty delta, for a page that is up to date.
    #[must_use]
    pub(crate) fn empty_delta(version: u64) -> String {
        format!("{{\"version\":{version},\"fresh\":false,\"cells\":{{}}}}")
    }

    /// The changes since a version as a message for a page; `None` if there are none.
    #[must_use]
    pub fn since(&self, version: u64) -> Option<String> {
        if version == self.version {
            return None;
        }
        let fresh = version < self.known_since || version > self.version || version == 0;
        let mut message = String::new();
        // Writing to a string cannot fail.
        let _ = write!(message, "{{\"version\":{},\"fresh\":{fresh},\"cells\":{{", self.version);
        let mut comma = "";
        for (key, cell) in self.cells.iter().filter(|(_, cell)| fresh || cell.version > version) {
            let _ = write!(message, "{comma}{}:{}", serde_json::Value::from(key.as_str()), cell.value);
            comma = ",";
        }
        let is_back = |key: &String| self.cells.contains_key(key);
        for (_, key) in self.removed.iter().filter(|(at, key)| !fresh && *at > version && !is_back(key)) {
            let _ = write!(message, "{comma}{}:null", serde_json::Value::from(key.as_str()));
            comma = ",";
        }
        message.push_str("}}");
        Some(message)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::Value;

    use super::*;

    /// Applies a message to a page's state, and returns its version.
    fn taken(page: &mut BTreeMap<String, Value>, message: &str) -> u64 {
        let message: Value = serde_json::from_str(message).unwrap();
        if message["fresh"] == Value::Bool(true) {
            page.clear();
        }
        for (key, value) in message["cells"].as_object().unwrap() {
            if value.is_null() {
                page.remove(key);
            } else {
                page.insert(key.clone(), value.clone());
            }
        }
        message["version"].as_u64().unwrap()
    }

    proptest! {
        #[test]
        fn a_page_that_polls_rarely_has_the_same_state_as_the_store(
            acts in proptest::collection::vec((0_u8..12, 0_u32..5, any::<bool>()), 0..2000),
        ) {
            let mut state_store = StateStore::default();
            let (mut page, mut version) = (BTreeMap::new(), 0);
            for (cell, value, looks) in acts {
                let key = format!("cell/{cell}");
                if value == 0 { state_store.remove(&key) } else { state_store.put(&key, &value) }
                if looks && let Some(message) = state_store.since(version) {
                    version = taken(&mut page, &message);
                }
            }
            if let Some(message) = state_store.since(version) {
                version = taken(&mut page, &message);
            }
            prop_assert_eq!(version, state_store.version());
            let held: BTreeMap<String, Value> =
                state_store.cells.iter().map(|(key, cell)| (key.clone(), serde_json::from_str(&cell.value).unwrap())).collect();
            prop_assert_eq!(page, held);
        }
    }

    #[test]
    fn a_page_that_is_too_far_behind_gets_the_full_state() {
        let mut state_store = StateStore::default();
        state_store.put("stays", &1);
        let version = state_store.version();
        for cell in 0..2 * MAX_REMOVED_KEYS {
            state_store.put(&format!("cell/{cell}"), &cell);
            state_store.remove(&format!("cell/{cell}"));
        }
        assert!(state_store.since(version).unwrap().contains("\"fresh\":true"));
        assert!(state_store.since(state_store.version()).is_none());
        assert!(state_store.since(u64::MAX).unwrap().contains("\"fresh\":true"));
    }

    #[test]
    fn only_keys_with_the_prefix_are_removed() {
        let mut state_store = StateStore::default();
        for key in ["a/1", "a/2", "b/1"] {
            state_store.put(key, &0);
        }
        state_store.put_all("a/", [("2".to_owned(), 0)]);
        assert_eq!(state_store.cells.keys().collect::<Vec<_>>(), ["a/2", "b/1"]);
    }
}
