//! `leo mock-bus`: mock servo buses as a stand-alone program, and as a process of the robot.

use std::io::stdout;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use config::Robot;
use mock_bus_process::{Faults, StandaloneError, StandaloneOptions, parse};
use process::Launch;
use servo::mock::FollowerBehaviour;

use crate::configuration::SetValues;
use crate::failure::CommandError;
use links::LinkFolder;

mod links;

#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo mock-bus --seed 7 --fault \"drop bus=torso id=5 p=0.01 from=2s for=10s\"\n\n\
    It prints where each bus is; any Dynamixel master can open it there. It runs until Ctrl-C.\n\
    Meanwhile it takes commands on standard input: `fault SPEC`, `clear` and `list`.\n\
    docs/servo-bus.md says which faults there are."
)]
pub(crate) struct MockBus {
    /// Domain folder; set by the supervisor alone.
    #[arg(long, hide = true)]
    domain: Option<PathBuf>,
    #[command(flatten)]
    launch: Launch,
    /// The robot's leo.toml, for the buses and servos in the motor.toml beside it [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: SetValues,
    /// A fault to inject from the start; may be repeated
    #[arg(long, value_name = "SPEC")]
    fault: Vec<String>,
    /// A file of faults, `faults = ["SPEC", ..]`, read again whenever it changes
    #[arg(long, value_name = "FILE")]
    faults: Option<PathBuf>,
    /// The seed: the same seed with the same instructions gives the same faults [default: as configured]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Let servos answer a fast read when one before them is silent [default: as configured]
    #[arg(long)]
    fast_read_continues_after_gap: bool,
}

impl MockBus {
    /// Whether it is a process of a robot.
    pub(super) fn is_supervised(&self) -> bool {
        self.domain.is_some()
    }

    /// Serves every mock bus until stopped.
    pub(super) fn run(&self) -> Result<ExitCode, CommandError> {
        if let Some(domain) = &self.domain {
            let launch =
                Launch { domain: domain.clone(), config: self.config.clone(), ..self.launch.clone() };
            let robot = launch.files().and_then(|files| Robot::of(&files)).map_err(CommandError::usage)?;
            mock_bus_process::run(&launch, &robot).map_err(CommandError::runtime)?;
            return Ok(ExitCode::SUCCESS);
        }
        let robot = self.set.robot(self.config.as_deref())?;
        let mut faults = configured_faults(&robot, self.config.as_deref())?;
        faults.seed = self.seed.unwrap_or(faults.seed);
        if self.fast_read_continues_after_gap {
            faults.followers = FollowerBehaviour::Continue;
        }
        for words in &self.fault {
            faults.injections.push(parse(words, &robot.motor).map_err(CommandError::usage)?);
        }
        let folder = LinkFolder::new().map_err(|error| {
            CommandError::runtime(format!(
                "cannot make a folder for the links to the buses: {error}; is TMPDIR writable?"
            ))
        })?;
        let stop = ::process::stop_flag().map_err(CommandError::runtime)?;
        let options = StandaloneOptions { faults, file: self.faults.clone() };
        let result = mock_bus_process::run_standalone(
            &robot.motor,
            folder.path(),
            &options,
            &stop,
            &mut stdout().lock(),
        );
        result.map_err(|error| match error {
            StandaloneError::NoMock | StandaloneError::File(_) => CommandError::usage(error),
            StandaloneError::MockBuses(_) | StandaloneError::Print(_) => CommandError::runtime(error),
        })?;
        Ok(ExitCode::SUCCESS)
    }
}

/// The faults of `leo.toml`, which is at `config`.
pub(crate) fn configured_faults(robot: &Robot, config: Option<&Path>) -> Result<Faults, CommandError> {
    let settings = &robot.leo.mock_bus;
    Faults::configured(settings, &robot.motor).map_err(|(index, error)| {
        let (words, reason) = (settings.faults.get(index).map_or("", String::as_str), error.to_string());
        let path = ["mock_bus", "faults", &index.to_string()];
        Robot::value_error(config, &path, words, &reason).map_or_else(
            || CommandError::usage(format!("`{words}` in `mock_bus.faults`: {reason}")),
            CommandError::usage,
        )
    })
}
