use std::fmt;

use serde::{Deserialize, Serialize};

/// A file of `/proc` or `/sys` that shall hold another text.
///
/// Nothing of this outlives the next start of the machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Change {
    /// The file.
    pub file: String,
    /// What it holds, and what is written to take the change back.
    pub from: String,
    /// What it shall hold.
    pub to: String,
}

impl Change {
    pub(super) fn new(file: impl Into<String>, from: impl Into<String>, to: impl Into<String>) -> Self {
        Self { file: file.into(), from: from.into(), to: to.into() }
    }

    /// What takes this change back.
    #[must_use]
    pub fn back(&self) -> Self {
        Self { file: self.file.clone(), from: self.to.clone(), to: self.from.clone() }
    }
}

impl fmt::Display for Change {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "echo {} > {}", self.to, self.file)
    }
}
