use std::fmt;
use std::io;

/// Why something from outside is not read, or not read on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BudgetError {
    /// The whole is too long.
    #[error("it is longer than {}, the most that Leo reads of {what}: is it the right file?", Bytes(*max_bytes))]
    Text {
        /// What is read.
        what: &'static str,
        /// The longest that is read.
        max_bytes: u64,
    },
    /// A line is too long.
    #[error("line {line} is longer than {}: put one {what} in a line", Bytes(*max_bytes))]
    Line {
        /// The line, from one.
        line: u64,
        /// What a line holds.
        what: &'static str,
        /// The longest that is read.
        max_bytes: u64,
    },
    /// What is compressed expands to too much.
    #[error(
        "its first {read_bytes} bytes expand to more than {}, the most that Leo expands so many to: it is damaged or was \
         made to exhaust the machine; write it anew from what it was made of",
        Bytes(*max_bytes)
    )]
    Expansion {
        /// Bytes of the file up to there.
        read_bytes: u64,
        /// What they may expand to.
        max_bytes: u64,
    },
    /// What has to be kept in memory is too much.
    #[error("what is to be kept of it needs more than {} of memory: {advice}", Bytes(*max_bytes))]
    Memory {
        /// What may be kept.
        max_bytes: u64,
        /// What to do.
        advice: &'static str,
    },
}

impl From<BudgetError> for io::Error {
    fn from(error: BudgetError) -> Self {
        Self::new(io::ErrorKind::FileTooLarge, error)
    }
}

/// A number of bytes as people read it.
struct Bytes(u64);

impl fmt::Display for Bytes {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(bytes) = *self;
        if bytes >= 1 << 20 {
            write!(out, "{} MiB", bytes >> 20)
        } else if bytes >= 1 << 10 {
            write!(out, "{} KiB", bytes >> 10)
        } else {
            write!(out, "{bytes} bytes")
        }
    }
}
