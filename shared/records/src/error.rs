use std::fmt;

use budget::BudgetError;
use mcap::McapError;

/// Error while reading the records of a file.
#[derive(Debug, thiserror::Error)]
pub enum RecordsError {
    /// Reading failed.
    #[error(transparent)]
    Read(std::io::Error),
    /// The data expands to too much.
    #[error(transparent)]
    Budget(#[from] BudgetError),
    /// The data is damaged.
    #[error("{0}")]
    Damaged(String),
}

impl From<McapError> for RecordsError {
    fn from(error: McapError) -> Self {
        Self::Damaged(error.to_string())
    }
}

/// Parts of a file without a check sum, where damage is not detected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unchecked {
    /// Number of chunks without a check sum, and of messages outside of chunks.
    pub places: u64,
    /// Bytes of the file read when the first of them was found.
    pub first_bytes: u64,
}

impl fmt::Display for Unchecked {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { places, first_bytes } = *self;
        let have = if places == 1 { "chunk has" } else { "chunks have" };
        write!(out, "{places} {have} no check sum, the first within its first {first_bytes} bytes")
    }
}

/// Where a truncated file stops being readable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cut {
    /// Where the incomplete record begins, in bytes from the beginning of the file.
    pub record_at: u64,
    /// Bytes of the file from there to its end. They were not used.
    pub unread_bytes: u64,
}
