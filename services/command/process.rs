//! The processes, as the supervisor starts them.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use config::Robot;
use config::lesson::Lesson;
use process::Launch;

use super::failure::Failed;

/// A process of the robot. People start the whole with `leo run`; these are for its supervisor.
#[derive(Debug, Subcommand)]
pub(crate) enum Process {
    /// The workspace, the teacher and Leo's body
    #[command(hide = true)]
    Simulator(Told),
    /// Observations to percepts
    #[command(hide = true)]
    Sensor(Told),
    /// Percepts to beliefs
    #[command(hide = true)]
    Belief(Told),
    /// Beliefs to tasks, tasks to joint goals
    #[command(hide = true)]
    Learner(Told),
    /// Joint goals to servos, servos to joint states
    #[command(hide = true)]
    Motor(Told),
    /// The mock servo bus
    #[command(hide = true)]
    MockBus(Told),
    /// Tells people what happens
    #[command(hide = true)]
    Console(Told),
}

/// What the supervisor tells a process.
#[derive(Args, Clone, Debug)]
pub(crate) struct Told {
    #[arg(long)]
    domain: PathBuf,
    #[arg(long, default_value_t = 1)]
    incarnation: u64,
    #[arg(long)]
    parent: Option<i32>,
    #[arg(long)]
    config: Option<PathBuf>,
    #[arg(long)]
    lesson: Option<PathBuf>,
    #[arg(long)]
    synthetic: Option<u32>,
    #[arg(long)]
    partners: Option<u32>,
    #[arg(long)]
    stay: bool,
    #[arg(long)]
    lockstep: bool,
    #[arg(long)]
    state: Option<PathBuf>,
}

impl Process {
    /// Runs the process until it is told to stop.
    pub(crate) fn run(self) -> Result<ExitCode, Failed> {
        let (Self::Simulator(told)
        | Self::Sensor(told)
        | Self::Belief(told)
        | Self::Learner(told)
        | Self::Motor(told)
        | Self::MockBus(told)
        | Self::Console(told)) = &self;
        let launch = told.launch();
        let robot = Robot::load(launch.config.as_deref()).map_err(Failed::usage)?;
        match self {
            Self::Simulator(_) => simulator_process::run(&launch, &robot, &lesson(&launch)?),
            Self::Sensor(_) => sensor_process::run(&launch, &robot),
            Self::Belief(_) => belief_process::run(&launch, &robot),
            Self::Learner(_) => learner_process::run(&launch, &robot),
            Self::Motor(_) => motor_process::run(&launch, &robot),
            Self::MockBus(_) => mock_bus_process::run(&launch, &robot),
            Self::Console(_) => console_process::run(&launch, &robot, &lesson(&launch)?),
        }
        .map_err(Failed::because)?;
        Ok(ExitCode::SUCCESS)
    }
}

impl Told {
    fn launch(&self) -> Launch {
        Launch {
            domain: self.domain.clone(),
            incarnation: self.incarnation,
            parent: self.parent,
            config: self.config.clone(),
            lesson: self.lesson.clone(),
            synthetic: self.synthetic,
            partners: self.partners,
            stay: self.stay,
            lockstep: self.lockstep,
            state: self.state.clone(),
        }
    }
}

fn lesson(launch: &Launch) -> Result<Lesson, Failed> {
    if let Some(objects) = launch.synthetic {
        return Ok(Lesson::synthetic(usize::try_from(objects).unwrap_or(usize::MAX)));
    }
    launch.lesson.as_deref().map_or_else(|| Ok(Lesson::builtin()), Lesson::load).map_err(Failed::usage)
}
