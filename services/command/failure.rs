use std::fmt::Display;
use std::process::ExitCode;

use super::journal;

/// What a command failed at, and the exit status that says so.
#[derive(Debug)]
pub(crate) struct Failed {
    /// What, where, and what to do.
    pub(crate) text: String,
    /// 1: the thing asked did not hold; 2: bad usage or configuration.
    pub(crate) code: ExitCode,
}

impl Failed {
    /// The thing asked did not hold.
    pub(crate) fn because(error: impl Display) -> Self {
        Self { text: error.to_string(), code: ExitCode::from(1) }
    }

    /// Bad usage or configuration.
    pub(crate) fn usage(error: impl Display) -> Self {
        Self { text: error.to_string(), code: ExitCode::from(2) }
    }

    /// What its user is told on standard error.
    pub(crate) fn told(&self) -> String {
        let text = format!("leo: {}\n", self.text);
        if journal::is_listening() { journal::marked(&text, tracing::Level::ERROR) } else { text }
    }
}
