use std::fmt::Display;
use std::process::ExitCode;

use super::journal;

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

    /// The text for standard error.
    pub(crate) fn message(&self) -> String {
        let text = format!("leo: {}\n", self.text);
        if journal::is_listening() { journal::marked(&text, tracing::Level::ERROR) } else { text }
    }
}
