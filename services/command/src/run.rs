//! `leo run`: runs the whole robot.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use config::Robot;
use config::campaign::Campaign;
use config::leo::Leo as Settings;
use config::lesson::Lesson;
use supervisor_process::{ORDER, ProcessFaults, RunOptions};

use crate::configuration::SetValues;
use crate::failure::CommandError;
use crate::preflight::{check_can_start, check_link, warn_missing_needs};
use crate::{configuration, domain, seconds};

#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo run --lesson config/lessons/task1.toml --for 60\n\nWhat Leo learns is kept in the state directory, \
                  $XDG_STATE_HOME/leo or ~/.local/state/leo, and known to the next run: `leo tasks list`. The first line is \
                  the address of the page, with its access token. Stopping the robot needs no token: curl -X POST \
                  http://127.0.0.1:7780/stop"
)]
pub(crate) struct Run {
    /// The robot's leo.toml; the files beside it are read too [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: SetValues,
    /// The lesson to play [default: built in, Task 1 of the study]
    #[arg(long, value_name = "FILE")]
    lesson: Option<PathBuf>,
    /// Run for this time [default: until the lesson is over]
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds::parse, allow_hyphen_values = true)]
    run_for: Option<Duration>,
    /// Run until the robot is stopped, as a service does
    #[arg(long, conflicts_with = "run_for")]
    stay: bool,
    /// A fault campaign for the servo buses, the percepts and the processes
    #[arg(long, value_name = "FILE")]
    faults: Option<PathBuf>,
    /// The shared-memory domain to run in [default: a new one]
    #[arg(long, value_name = "DIRECTORY")]
    domain: Option<PathBuf>,
}

impl Run {
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        let files = self.set.files(self.config.as_deref())?;
        let robot = configuration::robot(&files)?;
        let lesson = self.lesson.as_deref().map(|file| lesson_text(file, &robot.leo)).transpose()?;
        check_can_start(&robot, self.config.as_deref())?;
        supervisor_process::check_cores(&robot.leo).map_err(CommandError::usage)?;
        check_link(&robot.leo.link)?;
        if robot.leo.link.runs_here(message::Process::Console) {
            console_process::check_port(&robot.leo.console).map_err(CommandError::runtime)?;
        }
        let faults = self.faults.as_deref().map(|file| campaign(file, &robot)).transpose()?;
        let state = domain::state_directory()?;
        process::state::prepare(&state).map_err(CommandError::usage)?;
        // Report a broken memory here as one clear error; the learner would only die of it repeatedly. A memory that is
        // locked by another robot is accepted: the learner then runs without one.
        learner_process::check_memory(&state).map_err(CommandError::usage)?;
        // On a real robot there is no simulator process.
        let plays = robot.leo.sensor.simulator().is_some();
        let options = RunOptions {
            domain: domain::domain_for_run(self.domain.as_deref())?,
            processes: ORDER
                .into_iter()
                .filter(|process| *process != message::Process::Simulator || plays)
                .filter(|process| robot.leo.link.runs_here(*process))
                .collect(),
            settings: robot.leo,
            files,
            lesson,
            state: Some(state),
            faults,
            stay: self.stay,
            run_for: self.run_for,
        };
        domain::outcome(supervisor_process::run(&options))
    }
}

/// The text of a lesson file, validated before anything starts.
fn lesson_text(file: &Path, settings: &Settings) -> Result<String, CommandError> {
    let text = read(file)?;
    warn_missing_needs(file, &Lesson::parse(&text, file).map_err(CommandError::usage)?, settings);
    Ok(text)
}

/// The text of a fault campaign, validated before anything starts, and its process faults.
fn campaign(file: &Path, robot: &Robot) -> Result<(String, ProcessFaults), CommandError> {
    let text = read(file)?;
    let bus = |words: &str| mock_bus_process::parse(words, &robot.motor).map(drop);
    let campaign = Campaign::checked(&text, file, bus, ProcessFaults::check).map_err(CommandError::usage)?;
    Ok((text, ProcessFaults::new(&campaign.processes).map_err(CommandError::usage)?))
}

fn read(file: &Path) -> Result<String, CommandError> {
    config::text(file).map_err(CommandError::usage)
}
