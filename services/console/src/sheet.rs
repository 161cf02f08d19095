//! The state shown on the pages: a versioned key-value store with delta synchronisation.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt::Write as _;

/// Maximum number of removed keys kept for deltas. A page that is further behind gets the full state.
const GONE_MOST: usize = 512;

/// The newest value of every key as JSON, with the version in which it changed.
#[derive(Clone, Debug)]
pub struct Sheet {
    version: u64,
    cells: BTreeMap<String, Cell>,
    gone: VecDeque<(u64, String)>,
    /// Removals before this version are no longer kept.
    known_since: u64,
}

#[derive(Clone, Debug)]
struct Cell {
    version: u64,
    value: String,
}

impl Default for Sheet {
    fn default() -> Self {
        Self { version: 1, cells: BTreeMap::new(), gone: VecDeque::new(), known_since: 0 }
    }
}

impl Sheet {
    /// The version of the store; it grows with every change.
    #[must_use]
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Sets a value. An unchanged value does not change the version.
    pub fn put(&mut self, key: &str, value: &impl serde::Serialize) {
        // Serialisation of our numbers and texts does not fail; NaN and infinities become null.
        let Ok(value) = serde_json::to_string(value) else { return };
        match self.cells.get_mut(key) {
            Some(cell) if cell.value == value => {}
            Some(cell) => {
                self.version += 1;
                *cell = Cell { version: self.version, value };
            }
            None => {
                self.version += 1;
                self.cells.insert(key.to_owned(), Cell { version: self.version, value });
            }
        }
    }

    /// Removes a key.
    pub fn remove(&mut self, key: &str) {
        if self.cells.remove(key).is_some() {
            self.version += 1;
            self.gone.push_back((self.version, key.to_owned()));
            if self.gone.len() > GONE_MOST
                && let Some((version, _)) = self.gone.pop_front()
            {
                self.known_since = version;
            }
        }
    }

    /// Removes all keys with the prefix that are not in `stay`.
    pub fn keep_only(&mut self, prefix: &str, stay: &BTreeSet<String>) {
        let under = self.cells.range(prefix.to_owned()..).map(|(key, _)| key);
        let under = under.take_while(|key| key.starts_with(prefix));
        let going: Vec<String> = under.filter(|key| !stay.contains(*key)).cloned().collect();
        for key in going {
            self.remove(&key);
        }
    }

    /// An empty delta, for a page that is up to date.
    #[must_use]
    pub(crate) fn nothing_since(version: u64) -> String {
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
        for (_, key) in self.gone.iter().filter(|(at, key)| !fresh && *at > version && !is_back(key)) {
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
        fn a_page_that_looks_now_and_then_holds_what_the_sheet_holds(
            acts in proptest::collection::vec((0_u8..12, 0_u32..5, any::<bool>()), 0..2000),
        ) {
            let mut sheet = Sheet::default();
            let (mut page, mut version) = (BTreeMap::new(), 0);
            for (cell, value, looks) in acts {
                let key = format!("cell/{cell}");
                if value == 0 { sheet.remove(&key) } else { sheet.put(&key, &value) }
                if looks && let Some(message) = sheet.since(version) {
                    version = taken(&mut page, &message);
                }
            }
            if let Some(message) = sheet.since(version) {
                version = taken(&mut page, &message);
            }
            prop_assert_eq!(version, sheet.version());
            let held: BTreeMap<String, Value> =
                sheet.cells.iter().map(|(key, cell)| (key.clone(), serde_json::from_str(&cell.value).unwrap())).collect();
            prop_assert_eq!(page, held);
        }
    }

    #[test]
    fn a_page_that_slept_too_long_begins_anew() {
        let mut sheet = Sheet::default();
        sheet.put("stays", &1);
        let version = sheet.version();
        for cell in 0..2 * GONE_MOST {
            sheet.put(&format!("cell/{cell}"), &cell);
            sheet.remove(&format!("cell/{cell}"));
        }
        assert!(sheet.since(version).unwrap().contains("\"fresh\":true"));
        assert!(sheet.since(sheet.version()).is_none());
        assert!(sheet.since(u64::MAX).unwrap().contains("\"fresh\":true"));
    }

    #[test]
    fn only_what_begins_so_and_does_not_stay_goes() {
        let mut sheet = Sheet::default();
        for key in ["a/1", "a/2", "b/1"] {
            sheet.put(key, &0);
        }
        sheet.keep_only("a/", &BTreeSet::from(["a/2".to_owned()]));
        assert_eq!(sheet.cells.keys().collect::<Vec<_>>(), ["a/2", "b/1"]);
    }
}
