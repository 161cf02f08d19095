//! `leo check`: validates the configuration and measures what this machine can guarantee.

mod migrate;
mod versions;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anstream::{AutoStream, ColorChoice};
use clap::Args;
use supervisor_process::{CheckError, CheckOptions, MachineChange};

use crate::configuration::SetValues;
use crate::failure::CommandError;
use crate::preflight::{check_can_start, check_link};
use crate::progress::Progress;
use crate::{configuration, seconds};

#[derive(Args, Clone, Debug)]
#[command(after_help = "Examples:\n  leo check --config config/leo.toml --seconds 60")]
pub(crate) struct Check {
    /// The robot's leo.toml [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: SetValues,
    /// How long to measure wake-up latencies; 0 to skip
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds::parse_or_none,
        allow_hyphen_values = true)]
    seconds: Duration,
    /// Apply the changes that last until the next boot, and print how to revert them; as root
    #[arg(long, conflicts_with = "json")]
    apply: bool,
    /// Revert the changes of --apply; as root
    #[arg(long, conflicts_with_all = ["json", "apply"])]
    revert: bool,
    /// First migrate --config and the files beside it to this version, and keep a copy of each original
    #[arg(long, conflicts_with = "json", requires = "config")]
    migrate: bool,
    /// The state directory; /var/lib/leo for the service [default: $XDG_STATE_HOME/leo or ~/.local/state/leo]
    #[arg(long, value_name = "DIRECTORY")]
    state: Option<PathBuf>,
    /// The folder that stands for the root of the machine
    #[arg(long, hide = true, default_value = "/")]
    root: PathBuf,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

impl Check {
    pub(crate) fn run(self) -> Result<ExitCode, CommandError> {
        if let (Some(leo), true) = (&self.config, self.migrate) {
            migrate::migrate(leo)?;
        }
        let files = self.set.quiet_files(self.config.as_deref())?;
        let robot = configuration::robot(&files)?;
        check_can_start(&robot, self.config.as_deref())?;
        check_link(&robot.leo.link)?;
        let deed = match (self.apply, self.revert) {
            (true, _) => MachineChange::Apply,
            (false, true) => MachineChange::Revert,
            (false, false) => MachineChange::Inspect,
        };
        let mut out = std::io::stdout().lock();
        let inquiry = CheckOptions {
            colours: AutoStream::choice(&out) != ColorChoice::Never,
            versions: versions::all(self.state.as_deref()),
            files,
            json: self.json,
            measure: self.seconds,
            deed,
            root: self.root,
        };
        // The findings before the measurement are printed above the bar.
        let progress = Progress::of_steps(millis(self.seconds));
        let report = |passed| progress.set(millis(passed));
        let checked = supervisor_process::check(&inquiry, &mut out, report);
        drop(progress);
        let holds = checked.map_err(|error| match error {
            CheckError::Config(_) => CommandError::usage(error),
            CheckError::Write(error) => CommandError::output(&error),
            CheckError::Apply(_) => CommandError::runtime(error),
        })?;
        Ok(ExitCode::from(u8::from(!holds)))
    }
}

fn millis(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}
