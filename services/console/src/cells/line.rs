use std::collections::VecDeque;

use serde_json::json;

use super::rounded;
use crate::narrator::Line;
use crate::state_store::StateStore;

/// Maximum number of lines shown.
const MAX_LINES: usize = 300;

/// The dialogue and the events, as lines.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    last: u64,
    shown: VecDeque<u64>,
}

impl Lines {
    /// Appends a line and removes the oldest surplus one.
    pub(crate) fn add(&mut self, state_store: &mut StateStore, t: f64, line: &Line) {
        self.last += 1;
        let value =
            json!({ "t": rounded(t, 100.0), "who": line.who, "kind": line.kind.word(), "text": line.text });
        state_store.put(&key(self.last), &value);
        self.shown.push_back(self.last);
        if self.shown.len() > MAX_LINES
            && let Some(oldest) = self.shown.pop_front()
        {
            state_store.remove(&key(oldest));
        }
    }
}

fn key(serial: u64) -> String {
    format!("line/{serial}")
}
