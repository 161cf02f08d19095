//! The command line of `leo`: the commands, their options, and the dispatch to the crates that implement them.
//!
//! [`run`] is all that the program calls; [`accepts`] parses alone. Each command has a module of its own.

mod arm;
mod belief_pipeline;
mod believe;
mod bench;
mod body;
mod bus;
mod check;
mod configuration;
mod domain;
mod emergency_stop;
mod evaluate;
mod examples;
mod failure;
mod journal;
mod learn;
mod manual;
mod mock_bus;
mod other_users;
mod output;
mod preflight;
mod process;
mod progress;
mod record;
mod rehearsal;
mod replay;
mod run;
mod seconds;
mod study;
mod tasks;
mod teach;
mod top;
mod trace_quality;
mod usage;
mod view;
mod viewed_robot;

use std::ffi::OsString;
use std::io::Write as _;
use std::process::ExitCode;

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

use failure::CommandError;

/// A robot that learns from people by taking their perspective.
///
/// Without a command: `leo run`.
#[derive(Debug, Parser)]
#[command(name = "leo", version, after_help = "Examples:\n  leo run --lesson config/lessons/task1.toml")]
struct Leo {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: run::Run,
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
    Run(run::Run),
    /// Play a lesson in lockstep time, as fast as the machine can, and print what Leo learned
    Teach(teach::Teach),
    /// Play the paper's study, with and without perspective taking, beside the paper's tables
    Study(study::Study),
    /// Show, forget, export or import what Leo has learned
    Tasks(tasks::Tasks),
    /// Process a recorded trace of observations: perception and belief alone, no processes
    Believe(believe::Believe),
    /// Compare the beliefs about a recorded trace with the truth, by the measures of multi-object tracking
    Evaluate(evaluate::Evaluate),
    /// Learn from before-and-after examples in a file: task learning alone, no processes
    Learn(learn::Learn),
    /// Record a running robot: every buffer's bytes, and messages for common viewers
    Record(record::Record),
    /// Serve a running robot to live viewers, such as Foxglove and Lichtblick
    View(view::View),
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
    Bench(bench::Bench),
    /// Write the manual pages and the shell completions of the package
    #[command(hide = true)]
    Manual(manual::Manual),
    /// The other process of `leo bench`
    #[command(hide = true)]
    BenchEcho(bench::BenchEcho),
    #[command(flatten)]
    Process(process::Process),
}

/// Parses the command line and runs the command. Prints its error, if any, and returns the exit status. `commit` is the
/// commit that the program was built from.
#[must_use]
pub fn run(commit: &str) -> ExitCode {
    ::process::restrict_umask();
    let words = escaped(std::env::args_os().collect());
    let outcome = match parse(&words) {
        Ok(leo) => leo.run(commit),
        Err(error) => usage::refuse(&error, &command(), &words),
    };
    match outcome {
        Ok(code) => code,
        Err(error) => {
            // The only place where a command's error is printed.
            let _ = std::io::stderr().lock().write_all(error.message().as_bytes());
            error.code
        }
    }
}

/// Parses a command line, whose first word is the name of the program, as [`run`] does. Runs nothing.
///
/// # Errors
///
/// What clap says about the command line.
pub fn accepts(words: Vec<OsString>) -> Result<(), String> {
    parse(&escaped(words)).map(drop).map_err(|error| error.to_string())
}

fn parse(words: &[OsString]) -> Result<Leo, clap::Error> {
    command().try_get_matches_from(words).and_then(|matches| Leo::from_arg_matches(&matches))
}

/// The definition of all commands.
fn command() -> clap::Command {
    examples::add(Leo::command())
}

impl Leo {
    fn run(self, commit: &str) -> Result<ExitCode, CommandError> {
        let log = journal::start(self.verbose, self.log_json);
        let command = self.command.unwrap_or(Command::Run(self.run));
        // The processes of a robot inherit the variable, and their supervisor has said it.
        if !matches!(&command, Command::Process(process) if process.is_supervised()) {
            journal::warn_of_filter();
        }
        let outcome = command.run(commit);
        log.finish();
        outcome
    }
}

/// The words of a command line. Rewrites negative numbers with a unit for `leo bus write`, so that clap takes them as
/// values.
fn escaped(words: Vec<OsString>) -> Vec<OsString> {
    let said = |word: &str| words.iter().any(|other| other == word);
    if said("bus") && said("write") { words.into_iter().map(bus::escape_negative).collect() } else { words }
}

impl Command {
    fn run(self, commit: &str) -> Result<ExitCode, CommandError> {
        match self {
            Self::Run(run) => run.run(),
            Self::Teach(teach) => teach.run(),
            Self::Study(study) => study.run(),
            Self::Tasks(tasks) => tasks.run(),
            Self::Believe(believe) => believe.run(),
            Self::Evaluate(evaluate) => evaluate.run(),
            Self::Learn(learn) => learn.run(),
            Self::Record(record) => record.run(),
            Self::View(view) => view.run(),
            Self::Replay(replay) => replay.run(),
            Self::Top(top) => top.run(),
            Self::Arm(arm) => arm.run(),
            Self::EmergencyStop(stop) => stop.run(),
            Self::Bus(bus) => bus.run(),
            Self::Check(check) => check.run(),
            Self::Bench(bench) => bench.run(commit),
            Self::Manual(manual) => manual.run(&command()),
            Self::BenchEcho(echo) => echo.run(),
            Self::Process(process) => process.run(),
        }
    }
}
