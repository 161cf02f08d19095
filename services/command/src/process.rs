//! The hidden commands with which the supervisor starts the robot's processes.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use config::Robot;
use config::lesson::Lesson;
use process::Launch;

use crate::failure::CommandError;
use crate::mock_bus::MockBus;

/// A process of the robot. People start the whole with `leo run`; these are for its supervisor.
#[derive(Debug, Subcommand)]
pub(crate) enum Process {
    /// The workspace, the teacher and Leo's body
    #[command(hide = true)]
    Simulator(ProcessArgs),
    /// Observations to percepts
    #[command(hide = true)]
    Sensor(ProcessArgs),
    /// Percepts to beliefs
    #[command(hide = true)]
    Belief(ProcessArgs),
    /// Beliefs to tasks, tasks to joint goals
    #[command(hide = true)]
    Learner(ProcessArgs),
    /// Joint goals to servos, servos to joint states
    #[command(hide = true)]
    Motor(ProcessArgs),
    /// Serve mock servo buses to any Dynamixel master, with faults on demand
    MockBus(MockBus),
    /// Prints events and serves the page
    #[command(hide = true)]
    Console(ProcessArgs),
    /// Carries frames between this machine and another one
    #[command(hide = true)]
    Link(ProcessArgs),
    /// Switches torque off when the supervisor and the motor process have died together
    #[command(hide = true)]
    TorqueGuard(ProcessArgs),
}

/// What the supervisor tells a process.
#[derive(Args, Clone, Debug)]
pub(crate) struct ProcessArgs {
    #[arg(long)]
    domain: PathBuf,
    #[command(flatten)]
    launch: Launch,
    #[arg(long)]
    config: Option<PathBuf>,
}

impl Process {
    /// Whether it is a process of a robot, which its supervisor starts.
    pub(crate) fn is_supervised(&self) -> bool {
        match self {
            Self::MockBus(mock_bus) => mock_bus.is_supervised(),
            Self::Simulator(_)
            | Self::Sensor(_)
            | Self::Belief(_)
            | Self::Learner(_)
            | Self::Motor(_)
            | Self::Console(_)
            | Self::Link(_)
            | Self::TorqueGuard(_) => true,
        }
    }

    /// Runs the process until it is stopped.
    pub(crate) fn run(self) -> Result<ExitCode, CommandError> {
        let arguments = match &self {
            Self::Simulator(arguments)
            | Self::Sensor(arguments)
            | Self::Belief(arguments)
            | Self::Learner(arguments)
            | Self::Motor(arguments)
            | Self::Console(arguments) => arguments,
            Self::Link(arguments) | Self::TorqueGuard(arguments) => arguments,
            Self::MockBus(_) => {
                let Self::MockBus(mock_bus) = self else { return Ok(ExitCode::SUCCESS) };
                return mock_bus.run();
            }
        };
        let ProcessArgs { domain, launch, config } = arguments.clone();
        let launch = Launch { domain, config, ..launch };
        let robot = launch.files().and_then(|files| Robot::of(&files)).map_err(CommandError::usage)?;
        match self {
            Self::Simulator(_) => simulator_process::run(&launch, &robot, &lesson(&launch)?),
            Self::Sensor(_) => sensor_process::run(&launch, &robot),
            Self::Belief(_) => belief_process::run(&launch, &robot),
            Self::Learner(_) => learner_process::run(&launch, &robot),
            Self::Motor(_) => motor_process::run(&launch, &robot),
            Self::Console(_) => console_process::run(&launch, &robot, &lesson(&launch)?),
            Self::Link(_) => link_process::run(&launch, &robot),
            Self::TorqueGuard(_) => supervisor_process::guard(&launch, &robot),
            Self::MockBus(_) => Ok(()),
        }
        .map_err(CommandError::runtime)?;
        Ok(ExitCode::SUCCESS)
    }
}

fn lesson(launch: &Launch) -> Result<Lesson, CommandError> {
    if let Some(objects) = launch.synthetic {
        return Ok(Lesson::synthetic(usize::try_from(objects).unwrap_or(usize::MAX)));
    }
    launch.lesson.as_deref().map_or_else(|| Ok(Lesson::builtin()), Lesson::load).map_err(CommandError::usage)
}
