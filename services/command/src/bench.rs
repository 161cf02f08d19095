//! `leo bench`: measures latencies.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;

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
        let measured = supervisor_process::bench::measure(self.seconds, commit, || progress.step());
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
