use std::fmt::Display;
use std::io::{self, ErrorKind};
use std::process::ExitCode;

use crate::journal;

/// The error of a command, with its exit status.
#[derive(Debug)]
pub(crate) struct CommandError {
    /// The error, its place, and the remedy.
    pub(crate) text: String,
    /// 1: the requested thing did not succeed; 2: bad usage or configuration.
    pub(crate) code: ExitCode,
}

impl CommandError {
    /// A failure at run time: exit status 1.
    pub(crate) fn runtime(error: impl Display) -> Self {
        Self { text: error.to_string(), code: ExitCode::from(1) }
    }

    /// Bad usage or configuration: exit status 2.
    pub(crate) fn usage(error: impl Display) -> Self {
        Self { text: error.to_string(), code: ExitCode::from(2) }
    }

    /// Standard output cannot be written. If the reader of a pipe has closed it, it has seen enough: the command ends, in
    /// silence and with exit status 0.
    pub(crate) fn output(error: &io::Error) -> Self {
        if error.kind() == ErrorKind::BrokenPipe {
            return Self { text: String::new(), code: ExitCode::SUCCESS };
        }
        Self::runtime(format!("cannot write to standard output: {error}"))
    }

    /// The text for standard error.
    pub(crate) fn message(&self) -> String {
        if self.text.is_empty() {
            return String::new();
        }
        let text = format!("leo: {}\n", self.text);
        if journal::is_listening() { journal::marked(&text, tracing::Level::ERROR) } else { text }
    }
}
