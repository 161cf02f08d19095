//! `leo manual`: writes manual pages and shell completions, generated from the command definitions.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use clap_complete::Shell;

use crate::failure::CommandError;
use crate::output::Force;

#[derive(Args, Clone, Debug)]
#[command(after_help = "Examples:\n  leo manual target/manual")]
pub(crate) struct Manual {
    /// The output folder; created if missing
    #[arg(value_name = "DIRECTORY")]
    directory: PathBuf,
    #[command(flatten)]
    force: Force,
}

impl Manual {
    /// Writes the pages and completions of `program`.
    pub(crate) fn run(&self, program: &clap::Command) -> Result<ExitCode, CommandError> {
        // The folders of new files are made.
        let made = ["man/leo.1", "completions/leo.bash", "completions/_leo", "completions/leo.fish"];
        for file in made.map(|made| self.directory.join(made)) {
            if file.symlink_metadata().is_ok() {
                self.force.named(&file)?;
            }
        }
        write(program, &self.directory).map_err(|error| {
            CommandError::runtime(format!("cannot write to {}: {error}", self.directory.display()))
        })?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Writes `man/leo.1` and a page for each command, and `completions/` for bash, zsh and fish.
fn write(program: &clap::Command, directory: &Path) -> io::Result<()> {
    let pages = directory.join("man");
    fs::create_dir_all(&pages)?;
    clap_mangen::generate_to(program.clone(), pages)?;
    let completions = directory.join("completions");
    fs::create_dir_all(&completions)?;
    for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
        clap_complete::generate_to(shell, &mut program.clone(), "leo", &completions)?;
    }
    Ok(())
}
