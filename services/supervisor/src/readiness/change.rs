use std::fmt;

use serde::{Deserialize, Serialize};

/// A new value for a file of `/proc` or `/sys`.
///
/// It does not survive a reboot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Change {
    /// The file.
    pub file: String,
    /// Old content, written to revert the change.
    pub from: String,
    /// New content.
    pub to: String,
}

impl Change {
    pub(super) fn new(file: impl Into<String>, from: impl Into<String>, to: impl Into<String>) -> Self {
        Self { file: file.into(), from: from.into(), to: to.into() }
    }

    /// The inverse change.
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
