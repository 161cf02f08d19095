use std::fmt;

use budget::BudgetError;

/// Where in a trace something stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of a file of JSON lines, from one.
    Line(u64),
    /// A message of an MCAP file, from one.
    Message(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(number) => write!(out, "line {number}"),
            Self::Message(number) => write!(out, "message {number}"),
        }
    }
}

/// Why a trace cannot be read, or not read on.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// The bytes could not be read.
    #[error("cannot read {name}: {source}")]
    Read {
        /// The trace.
        name: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// It is something else.
    #[error(
        "{name} is no trace: {found}; a trace begins with the line {{\"leo_trace\": 1}}, or is an MCAP file \
             of the profile `leo_trace/1`"
    )]
    Foreign {
        /// The file.
        name: String,
        /// What it is instead.
        found: String,
    },
    /// It is a trace of a version that this program does not know.
    #[error(
        "{name} is a trace of version {found}: this Leo reads version 1; write it anew as version 1, or use the \
             Leo that it was made for"
    )]
    Version {
        /// The file.
        name: String,
        /// The version that it claims.
        found: String,
    },
    /// Something in it is wrong.
    #[error("{name}: {place}, {field}{reason}")]
    Wrong {
        /// The file.
        name: String,
        /// Where in it.
        place: Place,
        /// The column, and the field with a colon, as far as they are known.
        field: String,
        /// What is wrong, and what would be right.
        reason: String,
    },
    /// The records of an MCAP file are damaged.
    #[error("{name} is damaged after message {after}: {reason}; what stands before it was read")]
    Damaged {
        /// The file.
        name: String,
        /// Messages read before.
        after: u64,
        /// What is wrong.
        reason: String,
    },
    /// It expands to too much, or too much of it would have to be kept.
    #[error("{name} is not read on after {place}: {source}")]
    Budget {
        /// The file.
        name: String,
        /// What was read last.
        place: Place,
        /// What is too much.
        source: BudgetError,
    },
}
