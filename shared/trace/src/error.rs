use std::fmt;

use budget::BudgetError;

/// A position in a trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of a JSON lines file, from one.
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

/// Why a trace cannot be read, or not to its end.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// The bytes cannot be read.
    #[error("cannot read {name}: {source}")]
    Read {
        /// The trace.
        name: String,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The file is not a trace.
    #[error(
        "{name} is no trace: {found}; a trace begins with the line {{\"leo_trace\": 1}}, or is an MCAP file \
             of the profile `leo_trace/1`"
    )]
    NotATrace {
        /// The file.
        name: String,
        /// What was found instead.
        found: String,
    },
    /// The trace has an unsupported version.
    #[error(
        "{name} is a trace of version {found}: this Leo reads version 1; write it again as version 1, or use the Leo \
         that it was made for"
    )]
    Version {
        /// The file.
        name: String,
        /// Its version.
        found: String,
    },
    /// Its content is invalid.
    #[error("{name}: {place}, {field}{reason}")]
    Invalid {
        /// The file.
        name: String,
        /// The position.
        place: Place,
        /// The column, and the field with a colon, as far as they are known.
        field: String,
        /// What is wrong, and what would be valid.
        reason: String,
    },
    /// The records of an MCAP file are damaged.
    #[error("{name} is damaged after message {after}: {reason}; everything before it was read")]
    Damaged {
        /// The file.
        name: String,
        /// Number of messages read before the damage.
        after: u64,
        /// The damage.
        reason: String,
    },
    /// A size limit or the memory budget is exceeded.
    #[error("reading {name} stopped after {place}: {source}")]
    Budget {
        /// The file.
        name: String,
        /// The position that was read last.
        place: Place,
        /// The limit.
        source: BudgetError,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_messages_match_the_snapshot() {
        let name = || "a.jsonl".to_owned();
        let expansion = BudgetError::Expansion { read_bytes: 1000, max_bytes: 256 << 20 };
        let errors = [
            TraceError::Read { name: name(), source: std::io::ErrorKind::NotFound.into() },
            TraceError::NotATrace { name: name(), found: "it is empty".to_owned() },
            TraceError::Version { name: name(), found: "2".to_owned() },
            TraceError::Invalid {
                name: name(),
                place: Place::Line(2),
                field: "column 26, observation: ".to_owned(),
                reason: "unknown field `observation`".to_owned(),
            },
            TraceError::Damaged { name: name(), after: 7, reason: "its check sum is wrong".to_owned() },
            TraceError::Budget { name: name(), place: Place::Message(7), source: expansion },
        ];
        insta::assert_snapshot!(errors.map(|error| error.to_string()).join("\n"));
    }
}
