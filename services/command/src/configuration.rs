//! The configuration of a command: the files of `--config`, and the values of `--set`.

use std::path::Path;

use clap::Args;
use config::{Files, Robot};

use crate::failure::CommandError;

/// Values set on the command line.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct SetValues {
    /// Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// The same for a command with subcommands.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct GlobalSetValues {
    /// Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", global = true)]
    set: Vec<String>,
}

impl SetValues {
    /// The files of a `leo.toml` with the values set. Warns of files beside it that nothing reads.
    pub(crate) fn files(&self, leo: Option<&Path>) -> Result<Files, CommandError> {
        files(leo, &self.set)
    }

    /// The same without the warning, for a command that reports the files itself.
    pub(crate) fn quiet_files(&self, leo: Option<&Path>) -> Result<Files, CommandError> {
        self.apply(&Files::read(leo).map_err(CommandError::usage)?)
    }

    /// The robot that they describe.
    pub(crate) fn robot(&self, leo: Option<&Path>) -> Result<Robot, CommandError> {
        robot(&self.files(leo)?)
    }

    /// Files that were read elsewhere, with the values set.
    pub(crate) fn apply(&self, files: &Files) -> Result<Files, CommandError> {
        if self.set.is_empty() {
            return Ok(files.clone());
        }
        files.with_values(&self.set).map_err(CommandError::usage)
    }

    /// The arguments that set the same in another command.
    pub(crate) fn arguments(&self) -> impl Iterator<Item = String> {
        self.set.iter().map(|set| format!("--set={set}"))
    }
}

impl GlobalSetValues {
    /// As [`SetValues::robot`].
    pub(crate) fn robot(&self, leo: Option<&Path>) -> Result<Robot, CommandError> {
        robot(&files(leo, &self.set)?)
    }
}

/// The robot that the files describe.
pub(crate) fn robot(files: &Files) -> Result<Robot, CommandError> {
    Robot::of(files).map_err(CommandError::usage)
}

fn files(leo: Option<&Path>, set: &[String]) -> Result<Files, CommandError> {
    let files = Files::read(leo).map_err(CommandError::usage)?;
    for unread in files.unread() {
        tracing::warn!("{unread}");
    }
    if set.is_empty() { Ok(files) } else { files.with_values(set).map_err(CommandError::usage) }
}
