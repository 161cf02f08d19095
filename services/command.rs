//! The command line: commands, their options, and the dispatch to the crates that implement them.

mod arm;
mod believe;
mod body;
mod bus;
mod check;
mod domain;
mod emergency_stop;
mod failure;
mod journal;
mod learn;
mod manual;
mod mock_bus;
mod other_users;
mod output;
mod process;
mod record;
mod rehearsal;
mod replay;
mod seconds;
mod study;
mod tasks;
mod top;

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, Parser, Subcommand};
use config::campaign::Campaign;
use config::leo::Leo as Settings;
use config::lesson::Lesson;
use config::{Files, Robot};
use recording::{Subject, Time, robot_pose};
use supervisor_process::{LessonOptions, ORDER, ProcessFaults, Record, RunOptions};

use failure::CommandError;
pub(crate) use failure::CommandError as Failure;
use journal::LogWriter;

/// A robot that learns from people by taking their perspective.
///
/// Without a command: `leo run`.
#[derive(Debug, Parser)]
#[command(name = "leo", version, after_help = "Example:\n  leo run --lesson config/lessons/task1.toml")]
pub(crate) struct Leo {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: Run,
    /// Log more to standard error (also: RUST_LOG)
    #[arg(short, long, global = true)]
    verbose: bool,
    /// Write the log on standard error as JSON
    #[arg(long, global = true)]
    log_json: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the whole robot: all processes, simulator and mock servo buses included
    Run(Run),
    /// Play a lesson in lockstep time, as fast as the machine can, and print what Leo learned
    Teach(Teach),
    /// Play the paper's study, with and without perspective taking, beside the paper's tables
    Study(study::Study),
    /// Show, forget, export or import what Leo has learned
    Tasks(tasks::Tasks),
    /// Process a recorded trace of observations: perception and belief alone, no processes
    Believe(believe::Believe),
    /// Learn from before-and-after examples in a file: task learning alone, no processes
    Learn(learn::Learn),
    /// Record a running robot: every buffer's bytes, and messages for common viewers
    Record(record::Record),
    /// Replay a recording into the belief and learner processes, and compare their output
    Replay(replay::Replay),
    /// Show a live table of the processes: rates, latencies, overruns, drops, restarts
    Top(top::Top),
    /// Arm the joints after a person has checked the robot: on hardware nothing moves before
    Arm(arm::Arm),
    /// Switch every torque off now, and keep it off until it is released
    EmergencyStop(emergency_stop::EmergencyStop),
    /// Talk to servos by hand: scan, read, write, torque, reboot, monitor
    Bus(bus::Bus),
    /// Check the whole configuration and the real-time settings of this machine
    Check(check::Check),
    /// Measure latencies beside the bare middleware and a bare thread, in one run
    Bench(Bench),
    /// Write the manual pages and the shell completions of the package
    #[command(hide = true)]
    Manual(manual::Manual),
    /// The other process of `leo bench`
    #[command(hide = true)]
    BenchEcho(BenchEcho),
    #[command(flatten)]
    Process(process::Process),
}

#[derive(Args, Clone, Debug)]
struct BenchEcho {
    #[arg(long)]
    domain: PathBuf,
    #[arg(long)]
    name: String,
    #[arg(long)]
    bytes: usize,
}

#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Example:\n  leo run --lesson config/lessons/task1.toml --for 60\n\nThe first line is the address \
                  of the page, with its access token. Stopping the robot needs no token: curl -X POST \
                  http://127.0.0.1:7780/stop"
)]
struct Run {
    /// The robot's leo.toml; the files beside it are read too [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
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

#[derive(Args, Clone, Debug)]
#[command(after_help = "Example:\n  leo teach config/lessons/task1.toml --perspective robot --json")]
struct Teach {
    /// The lessons, one after the other
    #[arg(required = true, value_name = "LESSON")]
    lessons: Vec<PathBuf>,
    /// Whose perspectives to take: `human,robot` or `robot` [default: as configured]
    #[arg(long, value_name = "WHOSE", value_delimiter = ',')]
    perspective: Vec<Whose>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    /// Record the lesson for `leo replay` and for viewers; takes one lesson only
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, requires = "record")]
    overwrite: bool,
    /// The robot's leo.toml [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Whose {
    Human,
    Robot,
}

#[derive(Args, Clone, Debug)]
#[command(after_help = "Example:\n  leo bench --seconds 10 --json")]
struct Bench {
    /// How long to measure each rate and size
    #[arg(long, value_name = "SECONDS", default_value = "5", value_parser = seconds::parse,
        allow_hyphen_values = true)]
    seconds: Duration,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// The command line's arguments. Rewrites negative numbers with a unit for `leo bus write`, so that clap takes them as
/// values.
pub(crate) fn arguments() -> Vec<std::ffi::OsString> {
    let words: Vec<_> = std::env::args_os().collect();
    let said = |word: &str| words.iter().any(|other| other == word);
    if said("bus") && said("write") { words.into_iter().map(bus::escape_negative).collect() } else { words }
}

impl Leo {
    /// Runs the command.
    pub(crate) fn run(self) -> Result<ExitCode, Failure> {
        let is_journal = journal::is_listening();
        let left_out = if is_journal { journal::mark(tracing::Level::WARN) } else { "" };
        let aside = ::process::NonBlockingWriter::over(std::io::stderr(), left_out);
        if is_journal {
            journal::mark_panics();
        }
        listen(LogWriter { aside: aside.clone(), is_journal }, self.verbose, self.log_json);
        let outcome = self.command.unwrap_or(Command::Run(self.run)).run();
        aside.finish();
        outcome
    }
}

impl Command {
    fn run(self) -> Result<ExitCode, Failure> {
        match self {
            Self::Run(run) => run.run(),
            Self::Teach(teach) => teach.run(),
            Self::Study(study) => study.run(),
            Self::Tasks(tasks) => tasks.run(),
            Self::Believe(believe) => believe.run(),
            Self::Learn(learn) => learn.run(),
            Self::Record(record) => record.run(),
            Self::Replay(replay) => replay.run(),
            Self::Top(top) => top.run(),
            Self::Arm(arm) => arm.run(),
            Self::EmergencyStop(stop) => stop.run(),
            Self::Bus(bus) => bus.run(),
            Self::Check(check) => check.run(),
            Self::Bench(bench) => bench.run(),
            Self::Manual(manual) => manual.run(),
            Self::BenchEcho(echo) => {
                supervisor_process::bench::echo(&echo.domain, &echo.name, echo.bytes)
                    .map_err(CommandError::runtime)?;
                Ok(ExitCode::SUCCESS)
            }
            Self::Process(process) => process.run(),
        }
    }
}

impl Run {
    fn run(&self) -> Result<ExitCode, Failure> {
        let files = Files::read(self.config.as_deref()).map_err(CommandError::usage)?;
        let robot = Robot::of(&files).map_err(CommandError::usage)?;
        let lesson = self.lesson.as_deref().map(|file| lesson_text(file, &robot.leo)).transpose()?;
        check_can_start(&robot, self.config.as_deref())?;
        check_link(&robot.leo.link)?;
        let faults = self.faults.as_deref().map(|file| campaign(file, &robot)).transpose()?;
        let state = domain::state_directory()?;
        ::process::state::prepare(&state).map_err(CommandError::usage)?;
        // Report a broken memory here as one clear error; the learner would only die of it repeatedly. A memory that is
        // locked by another robot is accepted: the learner then runs without one.
        let _access = learner_process::check_memory(&state).map_err(CommandError::usage)?;
        // On a real robot there is no simulator process.
        let plays = robot.leo.sensor.simulator().is_some();
        let orders = RunOptions {
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
        domain::outcome(supervisor_process::run(&orders))
    }
}

/// The text of a lesson file, validated before anything starts.
fn lesson_text(file: &Path, settings: &Settings) -> Result<String, Failure> {
    let text = read(file)?;
    warn_missing_needs(file, &Lesson::parse(&text, file).map_err(CommandError::usage)?, settings);
    Ok(text)
}

/// Warns about settings that a lesson needs and the configuration lacks. The lesson is taught nevertheless.
fn warn_missing_needs(file: &Path, lesson: &Lesson, settings: &Settings) {
    if let Some(lacking) = lesson.needs.lacking(settings) {
        let file = file.display();
        tracing::warn!("{file}: this lesson needs {lacking} in leo.toml (--config FILE)");
    }
}

/// The text of a fault campaign, validated before anything starts, and its process faults.
fn campaign(file: &Path, robot: &Robot) -> Result<(String, ProcessFaults), Failure> {
    let text = read(file)?;
    let bus = |words: &str| mock_bus_process::parse(words, &robot.motor).map(drop);
    let campaign = Campaign::checked(&text, file, bus, ProcessFaults::check).map_err(CommandError::usage)?;
    Ok((text, ProcessFaults::new(&campaign.processes).map_err(CommandError::usage)?))
}

fn read(file: &Path) -> Result<String, Failure> {
    config::text(file).map_err(CommandError::usage)
}

impl Teach {
    fn run(&self) -> Result<ExitCode, Failure> {
        let robot = Robot::load(self.config.as_deref()).map_err(CommandError::usage)?;
        check_can_teach(&robot, self.config.as_deref())?;
        let partners = match self.perspective.as_slice() {
            [] => None,
            whose if !whose.contains(&Whose::Robot) => {
                return Err(CommandError::usage(
                    "--perspective human: the robot's own perspective cannot be left out, because all others are \
                     derived from it; use `--perspective human,robot`",
                ));
            }
            whose => Some(u32::from(whose.contains(&Whose::Human))),
        };
        if self.record.is_some() && self.lessons.len() > 1 {
            return Err(CommandError::usage(
                "--record takes one lesson: teach the lessons one by one, each with its own file",
            ));
        }
        let mut lessons = Vec::new();
        for file in &self.lessons {
            let lesson = Lesson::load(file).map_err(CommandError::usage)?;
            warn_missing_needs(file, &lesson, &robot.leo);
            lessons.push((file, lesson));
        }
        let mut reports = Vec::new();
        for (file, lesson) in lessons {
            let teaching = LessonOptions {
                domain: domain::own()?,
                settings: robot.leo.clone(),
                config: self.config.clone(),
                lesson: file.clone(),
                performances: lesson.performances(),
                partners,
                record: self.recorded(&lesson, partners)?,
            };
            let report = supervisor_process::teach(&teaching).map_err(CommandError::runtime)?;
            reports.push((file.display().to_string(), lesson.title, report));
        }
        output::print_reports(&reports, &robot.leo.belief.names, self.json)?;
        Ok(ExitCode::SUCCESS)
    }
}

impl Teach {
    /// The recording to make of a lesson, if requested.
    fn recorded(&self, lesson: &Lesson, partners: Option<u32>) -> Result<Option<Record>, Failure> {
        let Some(file) = self.record.clone() else { return Ok(None) };
        let x_world_base = robot_pose(lesson);
        let subject =
            Subject::load(self.config.as_deref(), Time::Lockstep, partners, x_world_base, &program());
        let output = output::named(&file, self.overwrite);
        Ok(Some(Record { output, subject: subject.map_err(CommandError::usage)? }))
    }
}

/// This program's name and version, as written into recordings.
fn program() -> String {
    format!("leo {}", env!("CARGO_PKG_VERSION"))
}
impl Bench {
    fn run(&self) -> Result<ExitCode, Failure> {
        let mut out = std::io::stdout().lock();
        supervisor_process::bench::bench(self.seconds, self.json, env!("LEO_COMMIT"), &mut out)
            .map_err(CommandError::runtime)?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Refuses a configuration with which a process could only die repeatedly. Checks the body against the servos, the
/// traces, the mock buses' faults and the program's own belief plug-ins. `config` is the robot's `leo.toml`.
fn check_can_start(robot: &Robot, config: Option<&Path>) -> Result<(), Failure> {
    body::check(robot, config).map_err(CommandError::usage)?;
    sensor_process::check_traces(&robot.leo.sensor.source).map_err(CommandError::usage)?;
    mock_bus_process::Faults::configured(&robot.leo.mock_bus, &robot.motor)
        .map_err(|bad| CommandError::usage(format!("leo.toml: `faults` of [mock_bus]: {bad}")))?;
    let belief = &robot.leo.belief;
    // Only whether it can be constructed matters, so a capacity of one suffices.
    belief_process::Believer::new(
        &robot.percepts,
        &robot.perspective,
        belief.partners,
        belief.depth.get(),
        1,
    )
    .map_err(CommandError::usage)?;
    Ok(())
}

/// Refuses an invalid link configuration.
fn check_link(link: &config::leo::Link) -> Result<(), Failure> {
    link_process::check(link).map_err(CommandError::usage)
}

/// Refuses to play a lesson to a robot without a simulator source. Returns the number of that source.
fn check_can_teach(robot: &Robot, config: Option<&Path>) -> Result<usize, Failure> {
    check_can_start(robot, config)?;
    let simulator = robot.leo.sensor.simulator().map(usize::from);
    simulator.ok_or_else(|| {
        CommandError::usage(
            "a lesson needs the simulator, and no [[sensor.source]] of leo.toml is of the kind \
             \"simulator\"",
        )
    })
}

/// Directs the log to standard error. Default: warnings; with `-v`: debug messages; otherwise as `RUST_LOG` demands.
fn listen(voice: LogWriter, verbose: bool, json: bool) {
    use tracing_subscriber::EnvFilter;
    // quinn logs every packet and connection attempt; the link process reports its own state once.
    let default = if verbose { "debug,quinn=warn,quinn_proto=warn" } else { "warn" };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(default));
    let colour = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let subscriber = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(voice)
        .with_target(false)
        .with_ansi(colour)
        .without_time();
    if json {
        subscriber.json().init();
    } else {
        subscriber.init();
    }
}
