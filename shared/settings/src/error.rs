use std::io::{self, ErrorKind};
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::Spanned;

/// Why a file was rejected.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The file cannot be read.
    #[error("cannot read {}: {}", file.display(), read_fault(source))]
    Read {
        /// The file.
        file: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The file was read, but its content is invalid.
    #[error("{}:{line}:{column}: {reason}", file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// Line, from one.
        line: usize,
        /// Column, from one.
        column: usize,
        /// What is wrong, and what would be valid.
        reason: String,
    },
    /// A value that was set on the command line is invalid.
    #[error("--set {set}: {reason}")]
    Set {
        /// The key and the value, as they were written.
        set: String,
        /// What is wrong, and what would be valid.
        reason: String,
    },
}

/// Why a file cannot be read; for a mistaken path, what to name instead.
fn read_fault(source: &io::Error) -> String {
    if source.kind() == ErrorKind::IsADirectory {
        "it is a directory; name the file in it".to_owned()
    } else if source.kind() == ErrorKind::NotADirectory {
        "a part of its path is a file, and not a directory".to_owned()
    } else {
        source.to_string()
    }
}

/// What is wrong at a place of a text, for checks after parsing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SpannedError {
    span: Range<usize>,
    reason: String,
}

impl SpannedError {
    /// The error at a value of the text.
    pub fn at<T>(value: &Spanned<T>, reason: impl Into<String>) -> Self {
        Self::within(value.span(), reason)
    }

    /// The error at a range of the text's bytes.
    pub fn within(span: Range<usize>, reason: impl Into<String>) -> Self {
        Self { span, reason: reason.into() }
    }

    /// As an error about a file with this text.
    #[must_use]
    pub fn of(self, text: &str, file: &Path) -> SettingsError {
        crate::error_at(text, file, self.span, self.reason)
    }
}
