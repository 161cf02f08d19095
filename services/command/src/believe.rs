//! `leo believe`: runs a recorded trace through perception and belief, and prints the result.

use std::fs::File;
use std::io::{BufWriter, Read, StdoutLock, Write as _, stdin, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use clock::Instant;
use reports::beliefs::{BeliefReport, JsonLines, Refusal, Summary, Timeline};
use trace::{FramesByInstant, Reader};

use crate::belief_pipeline::BeliefPipeline;
use crate::configuration::SetValues;
use crate::failure::CommandError;
use crate::progress::Progress;
use crate::trace_quality::Instants;
use crate::{seconds, trace_quality};

#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo believe config/traces/moved.jsonl --every 500\n\ndocs/traces.md says what a \
                        trace is and how to make one, and what is printed."
)]
pub(crate) struct Believe {
    /// The trace, as JSON lines or MCAP; `-` is standard input
    #[arg(value_name = "TRACE")]
    trace: PathBuf,
    /// Follow the paper literally where Leo departs from it, and print the differences
    #[arg(long)]
    literal: bool,
    /// Print JSON lines: every belief of every perspective at every instant
    #[arg(long)]
    json: bool,
    /// The robot's leo.toml; the files beside it are read too [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: SetValues,
    /// Partners whose beliefs are simulated, numbered from 1 [default: as configured]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=64))]
    partners: Option<u32>,
    /// Print an instant at most this often; all instants are processed [default: every instant]
    #[arg(long, value_name = "MS", value_parser = seconds::parse_millis, allow_hyphen_values = true)]
    every: Option<Duration>,
}

impl Believe {
    /// Processes the trace and prints the beliefs.
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        let mut robot = self.set.robot(self.config.as_deref())?;
        let literal = if self.literal { robot.percepts.belief.make_literal() } else { Vec::new() };
        let partners = self.partners.unwrap_or(robot.leo.belief.partners);
        let minds = BeliefPipeline::new(&robot, partners).map_err(CommandError::usage)?;
        let (reader, progress) = open(&self.trace, Progress::beside_output).map_err(CommandError::usage)?;
        let teller: Box<dyn BeliefReport> = if self.json {
            Box::new(JsonLines::new(&robot.percepts))
        } else {
            Box::new(Timeline::new(&robot.percepts).with_names(&robot.leo.belief.names))
        };
        let mut out = Out { out: BufWriter::new(stdout().lock()), text: String::new() };
        if !self.json {
            out.text.extend(literal.iter().map(|setting| format!("literal: {setting}\n")));
        }
        let told = self.tell(minds, FramesByInstant::new(reader), teller, literal, &mut out);
        drop(progress);
        match told {
            Ok((summary, instants)) => {
                let Summary { observations, refused, cut_short, .. } = &summary;
                trace_quality::judge(&self.trace, &instants, *observations, refused, *cut_short)?;
                Ok(ExitCode::SUCCESS)
            }
            Err(error @ OutputError::Unread(_)) => Err(CommandError::usage(error)),
            Err(OutputError::Unwritten(error)) => Err(CommandError::output(&error)),
        }
    }

    fn tell(
        &self,
        mut minds: BeliefPipeline,
        mut trace: FramesByInstant<Box<dyn Read>>,
        mut teller: Box<dyn BeliefReport>,
        literal: Vec<String>,
        out: &mut Out<'_>,
    ) -> Result<(Summary, Instants), OutputError> {
        let mut instants = Instants::default();
        let mut summary = Summary { literal, ..Summary::default() };
        let mut frames = Vec::new();
        let mut shown_at: Option<Instant> = None;
        while trace.read(&mut frames)? {
            minds.step(&frames);
            let at = minds.at();
            instants.add(at);
            summary.first_at_ns.get_or_insert(at.as_nanos());
            summary.last_at_ns = Some(at.as_nanos());
            for frame in &frames {
                summary.frames += 1;
                summary.earlier += u64::from(frame.at_ns < at.as_nanos());
                summary.observations += u64::try_from(frame.observations.len()).unwrap_or(u64::MAX);
            }
            summary.not_simulated.extend(minds.partners().filter(|partner| !minds.simulates(*partner)));
            if self.every.is_none_or(|every| shown_at.is_none_or(|shown_at| at.since(shown_at) >= every)) {
                shown_at = Some(at);
                teller.append(at.as_nanos(), &minds.all(), &mut out.text);
                out.write()?;
            }
        }
        let reader = trace.reader();
        summary.cut_short = reader.is_cut();
        if let Some(truncation) = reader.truncation() {
            tracing::warn!("{}: {truncation}", self.trace.display());
        }
        summary.left_out = minds.left_out();
        let unidentified = minds.unidentified();
        let unused = unidentified.as_ref().map_or(0, |unidentified| unidentified.observations);
        summary.observations = summary.observations.saturating_sub(unused);
        summary.refused = reader.refused().iter().map(refusal).chain(unidentified).collect();
        if let Some(unchecked) = reader.unchecked() {
            tracing::warn!("{}: {unchecked}: damage there would not be noticed", self.trace.display());
        }
        teller.finish(&minds.all(), &summary, &mut out.text);
        out.write()?;
        Ok((summary, instants))
    }
}

/// Opens a file, or standard input, and shows how much of a file was read.
pub(crate) fn open(
    trace: &Path,
    shown: fn(&File) -> Progress,
) -> Result<(Reader<Box<dyn Read>>, Progress), trace::TraceError> {
    if trace == Path::new("-") {
        return Ok((
            Reader::new(Box::new(stdin().lock()) as Box<dyn Read>, "standard input")?,
            Progress::hidden(),
        ));
    }
    let name = trace.display().to_string();
    match File::open(trace) {
        Ok(file) => {
            let progress = shown(&file);
            let counted: Box<dyn Read> = Box::new(progress.counting(file));
            Ok((Reader::new(counted, &name)?, progress))
        }
        Err(source) => Err(trace::TraceError::Read { name, source }),
    }
}

pub(crate) fn refusal(refused: &trace::Rejections) -> Refusal {
    Refusal {
        reason: refused.reason.to_string(),
        observations: refused.observations,
        first: refused.first.to_string(),
    }
}

/// Why the output ended early.
#[derive(Debug, thiserror::Error)]
enum OutputError {
    #[error(transparent)]
    Unread(#[from] trace::TraceError),
    #[error("cannot write to standard output: {0}")]
    Unwritten(#[from] std::io::Error),
}

/// Standard output, and the text to be written to it.
struct Out<'a> {
    out: BufWriter<StdoutLock<'a>>,
    text: String,
}

impl Out<'_> {
    /// Writes and flushes at once, so that a reader of a pipe sees the current state.
    fn write(&mut self) -> std::io::Result<()> {
        if !self.text.is_empty() {
            self.out.write_all(self.text.as_bytes())?;
            self.out.flush()?;
            self.text.clear();
        }
        Ok(())
    }
}
