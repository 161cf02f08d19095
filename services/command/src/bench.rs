//! `leo bench`: measures latencies.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use belief_process::{Believer, Divergences};
use clap::Args;
use message::{Belief, Histogram, Hop};
use supervisor_process::bench::PerceptFrame;

use crate::failure::CommandError;
use crate::progress::Progress;
use crate::seconds;

#[derive(Args, Clone, Debug)]
#[command(after_help = "Examples:\n  leo bench --seconds 10 --json")]
pub(crate) struct Bench {
    /// How long to measure each rate and size
    #[arg(long, value_name = "SECONDS", default_value = "5", value_parser = seconds::parse,
        allow_hyphen_values = true)]
    seconds: Duration,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

#[derive(Args, Clone, Debug)]
pub(crate) struct BenchEcho {
    #[arg(long)]
    domain: PathBuf,
    #[arg(long)]
    name: String,
    #[arg(long)]
    bytes: usize,
}

impl Bench {
    /// Measures, and prints the results with the commit of the program.
    pub(crate) fn run(&self, commit: &str) -> Result<ExitCode, CommandError> {
        let mut out = std::io::stdout().lock();
        let progress = Progress::of_steps(supervisor_process::bench::STEPS);
        let measured =
            supervisor_process::bench::measure(self.seconds, commit, belief_loop, || progress.step());
        drop(progress);
        let report = measured.map_err(CommandError::runtime)?;
        supervisor_process::bench::write(&report, self.json, &mut out).map_err(CommandError::runtime)?;
        Ok(ExitCode::SUCCESS)
    }
}

impl BenchEcho {
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        supervisor_process::bench::echo(&self.domain, &self.name, self.bytes)
            .map_err(CommandError::runtime)?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Partners whose perspectives are measured, as in the measured processes.
const PARTNERS: u32 = 1;
/// Frames until every history is full and the memory is warm.
const WARM_UP_FRAMES: usize = 100;

/// Runs the step of the belief process over percept frames, one after the other without a pause, and measures each. Its
/// beliefs are copied instead of published.
fn belief_loop(frames: &[PerceptFrame], capacity: usize) -> Result<Histogram, String> {
    let robot = config::Robot::load(None).map_err(|error| error.to_string())?;
    let depth = robot.leo.belief.depth.get();
    let mut believer = Believer::new(&robot.percepts, &robot.perspective, PARTNERS, depth, capacity)
        .map_err(|error| error.to_string())?;
    let mut divergences = Divergences::new(&robot.percepts, &believer, capacity);
    let mut published: Vec<Belief> = Vec::with_capacity(capacity.saturating_mul(4));
    let mut measured = Histogram::default();
    for (index, PerceptFrame { head, entries }) in frames.iter().enumerate() {
        let at_ns = head.header.hop_time(Hop::Perceived).unwrap_or(head.header.valid_at_ns);
        let started = clock::now();
        believer.step(clock::Instant::from_nanos(at_ns), head, entries);
        divergences.read(&believer);
        published.clear();
        for perspective in 0..believer.perspectives() {
            published.extend_from_slice(divergences.beliefs(perspective));
        }
        std::hint::black_box(&published);
        let took = clock::now().since(started);
        divergences.compare();
        if index >= WARM_UP_FRAMES {
            measured.record(u64::try_from(took.as_nanos()).unwrap_or(u64::MAX));
        }
    }
    Ok(measured)
}
