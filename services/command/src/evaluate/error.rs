use std::io::BufRead;

use budget::{BudgetError, Lines};

/// Maximum length of a line, in bytes. A frame of a thousand objects needs a hundredth of it.
const MAX_LINE_BYTES: usize = 16 << 20;

/// Why a file of true objects or of detections cannot be read, or not be used.
#[derive(Debug, thiserror::Error)]
pub(super) enum InputError {
    #[error("cannot read {name}: {source}")]
    File { name: String, source: std::io::Error },
    #[error("{name}: line {line}, {field}{reason}")]
    Line { name: String, line: u64, field: String, reason: String },
    #[error("{name}: line {line}: {source}")]
    Budget { name: String, line: u64, source: BudgetError },
    #[error("{name}: {reason}: docs/evaluation.md describes the formats")]
    Content { name: String, reason: String },
}

/// What is wrong with a field of a line.
pub(super) struct FieldError {
    /// The field with a colon.
    pub(super) field: String,
    pub(super) reason: String,
}

impl FieldError {
    pub(super) fn new(field: &str, reason: impl Into<String>) -> Self {
        Self { field: format!("{field}: "), reason: reason.into() }
    }
}

/// Passes each line that is not blank to `read`, with its number. `read` returns the bytes of memory that it keeps.
pub(super) fn read_lines(
    from: impl BufRead,
    name: &str,
    mut read: impl FnMut(&[u8], u64) -> Result<u64, FieldError>,
) -> Result<(), InputError> {
    let mut lines = Lines::new(from, "frame", MAX_LINE_BYTES);
    let mut memory =
        budget::Budget::memory("the whole file is kept in memory: evaluate a part of the sequence");
    let file = |source| InputError::File { name: name.to_owned(), source };
    while lines.next_line().map_err(file)?.is_some() {
        let line = lines.number();
        let text = lines.line().trim_ascii();
        if text.is_empty() {
            continue;
        }
        let wrong =
            |FieldError { field, reason }| InputError::Line { name: name.to_owned(), line, field, reason };
        let bytes = read(text, line).map_err(wrong)?;
        memory.set_read_bytes(lines.read_bytes());
        memory.spend(bytes).map_err(|source| InputError::Budget { name: name.to_owned(), line, source })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_messages_match_the_snapshot() {
        let name = || "gt.txt".to_owned();
        let errors = [
            InputError::File { name: name(), source: std::io::ErrorKind::NotFound.into() },
            InputError::Line {
                name: name(),
                line: 3,
                field: "w: ".to_owned(),
                reason: "it is -1".to_owned(),
            },
            InputError::Budget {
                name: name(),
                line: 3,
                source: BudgetError::Memory { max_bytes: 64 << 20, advice: "use less" },
            },
            InputError::Content { name: name(), reason: "there is no object in it".to_owned() },
        ];
        insta::assert_snapshot!(errors.map(|error| error.to_string()).join("\n"));
    }
}
