use std::fmt;

use budget::BudgetError;
use mcap::McapError;

/// Why the records of a file cannot be read on.
#[derive(Debug, thiserror::Error)]
pub enum RecordsError {
    /// The bytes could not be read.
    #[error(transparent)]
    Read(std::io::Error),
    /// They expand to too much.
    #[error(transparent)]
    Budget(#[from] BudgetError),
    /// They are damaged.
    #[error("{0}")]
    Damaged(String),
}

impl From<McapError> for RecordsError {
    fn from(error: McapError) -> Self {
        Self::Damaged(error.to_string())
    }
}

/// What has no check sum, so that damage in it goes unnoticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unchecked {
    /// Chunks without one, and messages that lie in no chunk.
    pub places: u64,
    /// Bytes of the file that were read when the first of them was found.
    pub first_bytes: u64,
}

impl fmt::Display for Unchecked {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { places, first_bytes } = *self;
        let have = if places == 1 { "chunk has" } else { "chunks have" };
        write!(out, "{places} {have} no check sum, the first within its first {first_bytes} bytes")
    }
}
