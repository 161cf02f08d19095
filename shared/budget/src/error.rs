use std::fmt;
use std::io;

/// Reason why external input is not read (further).
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BudgetError {
    /// The text is too long.
    #[error("it is longer than {}, the most that Leo reads of {what}: is it the right file?", Bytes(*max_bytes))]
    Text {
        /// Description of the input.
        what: &'static str,
        /// The limit in bytes.
        max_bytes: u64,
    },
    /// A line is too long.
    #[error("line {line} is longer than {}: put one {what} in a line", Bytes(*max_bytes))]
    Line {
        /// The number of the line, from one.
        line: u64,
        /// Description of the content of a line.
        what: &'static str,
        /// The limit in bytes.
        max_bytes: u64,
    },
    /// Compressed data expands to too much.
    #[error(
        "its first {read_bytes} bytes expand to more than {}, the limit for so many bytes: it is damaged or was made \
         to exhaust the machine; create the file again from its source",
        Bytes(*max_bytes)
    )]
    Expansion {
        /// Bytes of the file read so far.
        read_bytes: u64,
        /// Limit of the expanded size for that many bytes.
        max_bytes: u64,
    },
    /// The data to keep in memory is too large.
    #[error("its contents need more than {} of memory: {advice}", Bytes(*max_bytes))]
    Memory {
        /// The limit in bytes.
        max_bytes: u64,
        /// Remedy for the user.
        advice: &'static str,
    },
}

impl From<BudgetError> for io::Error {
    fn from(error: BudgetError) -> Self {
        Self::new(io::ErrorKind::FileTooLarge, error)
    }
}

/// A number of bytes, formatted for people.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_messages_match_the_snapshot() {
        let errors = [
            BudgetError::Text { what: "a configuration file", max_bytes: 4 << 20 },
            BudgetError::Line { line: 3, what: "example", max_bytes: 1 << 10 },
            BudgetError::Expansion { read_bytes: 1000, max_bytes: 256 << 20 },
            BudgetError::Memory { max_bytes: 64 << 20, advice: "split it" },
        ];
        insta::assert_snapshot!(errors.map(|error| error.to_string()).join("\n"));
    }
}
