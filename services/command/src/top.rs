//! `leo top`: shows the counters of a running robot's processes.

use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use console_process::top::{About, Form, show};

use crate::configuration::SetValues;
use crate::domain::{running, state_directory};
use crate::failure::CommandError;

#[derive(Args, Clone, Debug)]
#[command(after_help = "Examples:\n  leo top --json")]
pub(crate) struct Top {
    /// Print the table once, as JSON
    #[arg(long)]
    json: bool,
    /// Print all metrics once, as OpenMetrics text
    #[arg(long, conflicts_with = "json")]
    openmetrics: bool,
    /// The robot's leo.toml, for the names of its joints [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: SetValues,
    /// The robot, if several run
    #[arg(long, value_name = "DIRECTORY")]
    domain: Option<PathBuf>,
}

impl Top {
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        let robot = self.set.robot(self.config.as_deref())?;
        let domain = running(self.domain.as_deref())?;
        let about = About {
            joint_names: robot.motor.joints.into_iter().map(|joint| joint.name).collect(),
            // Without a state directory there is no memory file to report on.
            store: state_directory().ok().map(|state| process::state::learned(&state)),
        };
        let mut out = std::io::stdout().lock();
        let form = match (self.json, self.openmetrics) {
            (true, _) => Form::Json,
            (false, true) => Form::OpenMetrics,
            (false, false) if out.is_terminal() => Form::Live,
            (false, false) => Form::Table,
        };
        show(domain, about, form, &mut out).map_err(CommandError::runtime)?;
        Ok(ExitCode::SUCCESS)
    }
}
