//! `leo evaluate`: compares the beliefs about a trace with the truth, by the measures of multi-object tracking.

mod comparison;
mod error;
mod hypotheses;
mod input;
mod mot;
mod picture;
mod report;
mod truth;

use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use folder::Output;
use trace::FramesByInstant;

use crate::belief_pipeline::BeliefPipeline;
use crate::configuration::SetValues;
use crate::failure::CommandError;
use crate::output::Force;
use crate::progress::Progress;
use crate::{believe, output, trace_quality};
use comparison::{ComparedPercepts, Comparison, Hypothesis, Similarity};
use error::InputError;
use hypotheses::HypothesisFile;
use input::Input;
use mot::Row;
use picture::Picture;
use report::{Report, Summary};
use truth::{Truth, TruthText};

/// The cut-off of a distance, in metres, where none is given: between two blocks on a table.
const CUT_OFF_M: f64 = 0.1;

/// Sightings of a detector's object after which its belief is compared, where nothing is given: as the tracker SORT does.
const ANNOUNCE_DETECTIONS_AFTER: u32 = 3;

#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo evaluate --truth truth.jsonl trace.jsonl\n  leo evaluate --truth gt.txt --detections \
                  det.txt --frame-rate 25\n\ndocs/evaluation.md says how a truth is written, and what the measures mean."
)]
pub(crate) struct Evaluate {
    /// The trace, as for `leo believe`; `-` is standard input
    #[arg(value_name = "TRACE", required_unless_present = "detections", conflicts_with = "detections")]
    trace: Option<PathBuf>,
    /// The truth: JSON lines in metres, or CSV of the MOT Challenge in pixels
    #[arg(long, value_name = "FILE")]
    truth: PathBuf,
    /// Detections instead of a trace: CSV of the MOT Challenge
    #[arg(long, value_name = "FILE")]
    detections: Option<PathBuf>,
    /// Frames per second of the MOT Challenge files; frame 1 is at 0 s
    #[arg(long, value_name = "HZ", value_parser = positive, allow_hyphen_values = true)]
    frame_rate: Option<f64>,
    /// The size of a pixel [default: the median height of the detections' boxes is 1.7 m]
    #[arg(long, value_name = "METRES", value_parser = positive, allow_hyphen_values = true)]
    pixel: Option<f64>,
    /// Use detections of this score and above, with confidence 1 [default: the score is the confidence]
    #[arg(long, value_name = "SCORE", value_parser = score, allow_hyphen_values = true)]
    min_score: Option<f64>,
    /// Sightings after which a belief is announced, and compared [default: 3 for detections, which may be false; otherwise
    /// as configured]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    announce_after: Option<u32>,
    /// What is compared [default: box for a truth in pixels, distance otherwise]
    #[arg(long, value_name = "WHAT")]
    similarity: Option<Compared>,
    /// The largest distance of a match [default: 0.1]
    #[arg(long, value_name = "METRES", value_parser = positive, allow_hyphen_values = true)]
    cut_off: Option<f64>,
    /// Count every belief in every frame, and not only those that were observed in the frame
    #[arg(long)]
    remembered: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    /// Write the compared beliefs to a file
    #[arg(long, value_name = "FILE")]
    save_hypotheses: Option<PathBuf>,
    /// Write the detections to a file, as a trace
    #[arg(long, value_name = "FILE")]
    save_trace: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
    /// The robot's leo.toml; the files beside it are read too [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: SetValues,
    /// Partners whose beliefs are simulated, numbered from 1 [default: as configured]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=64))]
    partners: Option<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Compared {
    /// Intersection over union of boxes in the image plane, 0.5 or more
    Box,
    /// The distance of positions, up to `--cut-off`
    Distance,
}

/// Why an evaluation ends early.
#[derive(Debug, thiserror::Error)]
enum EvaluationError {
    #[error(transparent)]
    Trace(#[from] trace::TraceError),
    #[error(transparent)]
    Frame(#[from] evaluation::FrameError),
    #[error("cannot write {name}: {source}")]
    Unwritten { name: String, source: std::io::Error },
    #[error(
        "no instant of the truth, {} to {} ns, is in the trace, {}: both need the same clock and the same instants",
        .truth_ns.0, .truth_ns.1, trace_span(.trace_ns.as_ref())
    )]
    NoCommonInstant { truth_ns: (u64, u64), trace_ns: Option<(u64, u64)> },
}

fn trace_span(span_ns: Option<&(u64, u64)>) -> String {
    span_ns.map_or_else(|| "which is empty".to_owned(), |(first, last)| format!("{first} to {last} ns"))
}

fn positive(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|number| (1.0e-6..=1.0e6).contains(number))
        .ok_or_else(|| format!("`{text}` is not a number from 0.000001 to 1000000"))
}

fn score(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number.filter(|number| number.is_finite()).ok_or_else(|| format!("`{text}` is not a number"))
}

/// What is read before the first frame.
struct Prepared {
    truth: Truth,
    /// Of a truth in pixels.
    picture: Option<Picture>,
    input: Input,
    similarity: Similarity,
    /// How much of the trace was read.
    progress: Progress,
}

impl Evaluate {
    /// An output file, which is not one that is read.
    fn output(&self, file: &Path) -> Result<Output, CommandError> {
        let inputs = [self.trace.as_deref(), self.detections.as_deref(), Some(self.truth.as_path())];
        let configuration = config::read_files(self.config.as_deref());
        let inputs = inputs.into_iter().flatten().chain(configuration.iter().map(PathBuf::as_path));
        self.force.named_unless_read(file, inputs)
    }

    /// Runs the trace through the belief systems, compares, and prints the measures.
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        if self.save_hypotheses.is_some() && self.save_hypotheses == self.save_trace {
            return Err(CommandError::usage("--save-trace and --save-hypotheses need two files"));
        }
        let files = [&self.save_hypotheses, &self.save_trace].into_iter().flatten();
        let outputs = files.map(|file| self.output(file)).collect::<Result<Vec<_>, _>>()?;
        let mut robot = self.set.robot(self.config.as_deref())?;
        if let Some(tracking) = &mut robot.percepts.belief.tracking {
            let of_detections = self.detections.is_some().then_some(ANNOUNCE_DETECTIONS_AFTER);
            tracking.announce_after =
                self.announce_after.or(of_detections).unwrap_or(tracking.announce_after);
        }
        let partners = self.partners.unwrap_or(robot.leo.belief.partners);
        let mut minds = BeliefPipeline::new(&robot, partners).map_err(CommandError::usage)?;
        let prepared = self.prepare()?;
        let similarity = prepared.similarity;
        let percepts = ComparedPercepts::of(&robot.percepts, similarity).map_err(CommandError::usage)?;
        let mut comparison = Comparison::new(percepts, similarity, self.remembered);
        comparison.add_perspectives(&minds.all(), &prepared.truth);
        let mut summary = Summary { remembered: self.remembered, ..Summary::default() };
        summary.metres_per_pixel = prepared.picture.map(|picture| picture.metres_per_pixel);
        let known: Vec<u16> = comparison.perspectives.iter().map(|own| own.agent).collect();
        summary.not_simulated =
            prepared.truth.agents().into_iter().filter(|agent| !known.contains(agent)).collect();
        let compared = self.compare(&mut minds, prepared, &mut comparison, &mut summary);
        compared.map_err(|error| match error {
            EvaluationError::Unwritten { .. } => CommandError::runtime(error),
            EvaluationError::Trace(_)
            | EvaluationError::Frame(_)
            | EvaluationError::NoCommonInstant { .. } => CommandError::usage(error),
        })?;
        let report = Report::of(&comparison.perspectives, similarity, &summary, &robot.leo.belief.names);
        let text = if self.json { output::to_json(&report.to_json())? } else { report.to_text() };
        output::print_beside(&outputs, &text)?;
        if let Some(trace) = &self.trace {
            let Summary { observations, refused, instants, cut_short, .. } = &summary;
            trace_quality::judge(trace, instants, *observations, refused, *cut_short)?;
        }
        Ok(ExitCode::SUCCESS)
    }

    /// Reads the truth, and opens the trace or reads the detections.
    fn prepare(&self) -> Result<Prepared, CommandError> {
        if self.detections.is_none() && (self.min_score.is_some() || self.save_trace.is_some()) {
            return Err(CommandError::usage(
                "--min-score and --save-trace are about detections, and a trace is given: say --detections, or leave \
                 them out",
            ));
        }
        let name = self.truth.display().to_string();
        let text = TruthText::read(open(&self.truth)?, &name).map_err(CommandError::usage)?;
        let is_in_pixels = matches!(text, TruthText::Mot(_));
        let detections = self.detections.as_deref().map(detections).transpose()?;
        let picture = self.picture(is_in_pixels, detections.as_deref())?;
        let last = match &text {
            TruthText::Mot(rows) => rows.iter().map(|row| row.frame).max().unwrap_or(0),
            TruthText::Json(_) => 0,
        };
        let truth = text.in_metres(picture.as_ref(), &name).map_err(CommandError::usage)?;
        let mut progress = Progress::hidden();
        let input = match (&self.trace, detections, &picture) {
            (Some(trace), _, _) => {
                let opened = believe::open(trace, Progress::of_file).map_err(CommandError::usage)?;
                let (reader, of_trace) = opened;
                progress = of_trace;
                Input::Trace(Box::new(FramesByInstant::new(reader)))
            }
            (None, Some(rows), Some(picture)) => {
                let frames = input::observations(&rows, last, picture, self.min_score);
                self.save_trace(&frames)?;
                Input::Detections(frames.into_iter())
            }
            (None, _, _) => return Err(CommandError::usage("give a trace, or --detections")),
        };
        let similarity = self.similarity(is_in_pixels, &truth)?;
        Ok(Prepared { truth, picture: picture.filter(|_| is_in_pixels), input, similarity, progress })
    }

    /// The scale and the rate, if anything is in pixels.
    fn picture(
        &self,
        is_in_pixels: bool,
        detections: Option<&[Row]>,
    ) -> Result<Option<Picture>, CommandError> {
        if !is_in_pixels && detections.is_none() {
            return match self.frame_rate.or(self.pixel) {
                None => Ok(None),
                Some(_) => Err(CommandError::usage(
                    "--frame-rate and --pixel are for files of the MOT Challenge, and neither the truth nor the trace is \
                     one",
                )),
            };
        }
        let Some(frame_rate_hz) = self.frame_rate else {
            return Err(CommandError::usage(
                "files of the MOT Challenge number their frames: say --frame-rate with the frames per second, for \
                 example --frame-rate 25",
            ));
        };
        let metres_per_pixel = self.pixel.or_else(|| picture::scale_of_persons(detections?));
        let Some(metres_per_pixel) = metres_per_pixel else {
            return Err(CommandError::usage(if detections.is_some() {
                "there are no detections: say --pixel with the size of a pixel in metres"
            } else {
                "the truth is in pixels and the trace in metres: say --pixel with the size of a pixel in metres, as in \
                 the trace"
            }));
        };
        Ok(Some(Picture { metres_per_pixel, frame_rate_hz }))
    }

    fn similarity(&self, is_in_pixels: bool, truth: &Truth) -> Result<Similarity, CommandError> {
        let compared =
            self.similarity.unwrap_or(if is_in_pixels { Compared::Box } else { Compared::Distance });
        match compared {
            Compared::Box if self.cut_off.is_some() => Err(CommandError::usage(
                "--cut-off is the largest distance of a match, and boxes are compared: add --similarity distance",
            )),
            Compared::Box if !truth.has_sizes() => Err(CommandError::usage(format!(
                "{}: boxes are compared, and an object has no `size_m`: add it to every object, or say --similarity \
                 distance",
                self.truth.display()
            ))),
            Compared::Box => Ok(Similarity::Box),
            Compared::Distance => Ok(Similarity::Distance { cut_off_m: self.cut_off.unwrap_or(CUT_OFF_M) }),
        }
    }

    /// Runs all frames, and compares those that have a truth.
    fn compare(
        &self,
        minds: &mut BeliefPipeline,
        prepared: Prepared,
        comparison: &mut Comparison,
        summary: &mut Summary,
    ) -> Result<(), EvaluationError> {
        let Prepared { truth, picture, mut input, progress: _shown, .. } = prepared;
        let mut pending =
            PendingTruth { truth: &truth, next_ns: Some(0), file: self.hypothesis_file(picture)? };
        let mut frames = Vec::new();
        let mut span_ns: Option<(u64, u64)> = None;
        let mut present: Option<(u64, Vec<Vec<Hypothesis>>)> = None;
        while input.read(&mut frames)? {
            minds.step(&frames);
            summary.instants.add(minds.at());
            let at_ns = minds.at().as_nanos();
            span_ns = Some((span_ns.map_or(at_ns, |(first, _)| first), at_ns));
            summary.observations += frames
                .iter()
                .map(|frame| quantity::number::saturating_u64(frame.observations.len()))
                .sum::<u64>();
            // Frames that come late count as of the instant before them, which is then compared once.
            if let Some((before_ns, beliefs)) = present.take_if(|(before_ns, _)| *before_ns != at_ns) {
                pending.compare(before_ns, &beliefs, comparison, summary)?;
            }
            present = Some((at_ns, comparison.hypotheses(at_ns, &minds.all())));
        }
        if let Some((at_ns, beliefs)) = present {
            pending.compare(at_ns, &beliefs, comparison, summary)?;
        }
        pending.compare_rest(comparison, summary)?;
        summary.left_out = minds.left_out();
        if let Input::Trace(trace) = &input {
            let reader = trace.reader();
            summary.cut_short = reader.is_cut();
            if let (Some(truncation), Some(file)) = (reader.truncation(), &self.trace) {
                tracing::warn!("{}: {truncation}", file.display());
            }
            summary.refused = reader.refused().iter().map(believe::refusal).collect();
        }
        let unidentified = minds.unidentified();
        let unused = unidentified.as_ref().map_or(0, |unidentified| unidentified.observations);
        summary.observations = summary.observations.saturating_sub(unused);
        summary.refused.extend(unidentified);
        match truth.span_ns() {
            Some(truth_ns) if summary.frames == summary.without_instant => {
                Err(EvaluationError::NoCommonInstant { truth_ns, trace_ns: span_ns })
            }
            Some(_) | None => Ok(()),
        }
    }

    fn hypothesis_file(&self, picture: Option<Picture>) -> Result<Option<HypothesisFile>, EvaluationError> {
        let Some(file) = &self.save_hypotheses else { return Ok(None) };
        let created = HypothesisFile::create(&self.force.unchecked(file), picture);
        created
            .map(Some)
            .map_err(|source| EvaluationError::Unwritten { name: file.display().to_string(), source })
    }

    fn save_trace(&self, frames: &[trace::Frame]) -> Result<(), CommandError> {
        let Some(output) = self.force.named_if(self.save_trace.as_deref())? else { return Ok(()) };
        let written = output.create_whole().and_then(|mut file| {
            input::write_trace(frames, &mut BufWriter::new(&mut file))?;
            file.finish()
        });
        written.map_err(|error| {
            CommandError::runtime(format!("cannot write {}: {error}", output.path().display()))
        })
    }
}

/// The frames of the truth that are not compared yet.
struct PendingTruth<'a> {
    truth: &'a Truth,
    /// The earliest instant of them; `None` after the last.
    next_ns: Option<u64>,
    file: Option<HypothesisFile>,
}

impl PendingTruth<'_> {
    /// Compares the beliefs of an instant. Frames of the truth before it have no beliefs to be compared with.
    fn compare(
        &mut self,
        at_ns: u64,
        beliefs: &[Vec<Hypothesis>],
        comparison: &mut Comparison,
        summary: &mut Summary,
    ) -> Result<(), EvaluationError> {
        let Some(next_ns) = self.next_ns.filter(|next_ns| *next_ns <= at_ns) else {
            summary.without_truth += 1;
            return Ok(());
        };
        for objects in self.truth.frames.range(next_ns..at_ns).map(|(_, objects)| objects) {
            (summary.frames, summary.without_instant) = (summary.frames + 1, summary.without_instant + 1);
            comparison.add(objects, &[])?;
        }
        match self.truth.frames.get(&at_ns) {
            None => summary.without_truth += 1,
            Some(objects) => {
                summary.frames += 1;
                comparison.add(objects, beliefs)?;
                if let Some(file) = &mut self.file {
                    let written = file.add(at_ns, &comparison.perspectives, beliefs);
                    written.map_err(|source| EvaluationError::Unwritten { name: file.name(), source })?;
                }
            }
        }
        self.next_ns = at_ns.checked_add(1);
        Ok(())
    }

    /// Compares the frames of the truth after the trace.
    fn compare_rest(self, comparison: &mut Comparison, summary: &mut Summary) -> Result<(), EvaluationError> {
        let rest = self.next_ns.map(|next_ns| self.truth.frames.range(next_ns..));
        for (_, objects) in rest.into_iter().flatten() {
            (summary.frames, summary.without_instant) = (summary.frames + 1, summary.without_instant + 1);
            comparison.add(objects, &[])?;
        }
        let Some(file) = self.file else { return Ok(()) };
        let name = file.name();
        file.finish().map_err(|source| EvaluationError::Unwritten { name, source })
    }
}

fn open(file: &Path) -> Result<BufReader<File>, CommandError> {
    let name = || file.display().to_string();
    let open = File::open(file).map_err(|source| InputError::File { name: name(), source });
    open.map(BufReader::new).map_err(CommandError::usage)
}

fn detections(file: &Path) -> Result<Vec<Row>, CommandError> {
    mot::read(open(file)?, &file.display().to_string()).map_err(CommandError::usage)
}
