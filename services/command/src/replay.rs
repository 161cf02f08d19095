//! `leo replay`: plays a recording through the belief and learner processes again.

use std::fmt::Write as _;
use std::fs;
use std::io::Read;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use config::Robot;
use console_process::{Line, Narrator, Transcript};
use message::{Events, TopicId, Utterances};
use quantity::number::counted;
use recording::{Channel, Frame, Reader, Subject, Time};
use supervisor_process::{FrameCounts, LockstepError, Record, ReplayOptions};

use crate::failure::CommandError;
use crate::output::Force;
use crate::progress::Progress;
use crate::{body, domain, output, seconds};

/// The files of a robot's configuration.
const FILES: [&str; 5] = ["leo.toml", "percepts.toml", "perspective.toml", "motor.toml", "leo.urdf"];

/// Play a recording into the real belief and learner processes.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo teach config/lessons/task1.toml --record task1.mcap\n  leo replay task1.mcap\n\n\
                  What was recorded in lockstep time is compared bit by bit, and the first difference is named: \
                  exit status 1. With --speed it is told as it goes."
)]
pub(crate) struct Replay {
    /// The recording
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Replay at this multiple of real time, and print what happens [default: as fast as possible]
    #[arg(long, value_name = "TIMES", value_parser = speed, allow_hyphen_values = true)]
    speed: Option<f64>,
    /// Compare and print only what comes after this many seconds; the part before is replayed too
    #[arg(long, value_name = "SECONDS", value_parser = seconds::parse, allow_hyphen_values = true)]
    from: Option<Duration>,
    /// End after this many seconds of the recording
    #[arg(long, value_name = "SECONDS", value_parser = seconds::parse, allow_hyphen_values = true)]
    to: Option<Duration>,
    /// Record the replayed frames and the new output of the processes
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
}

/// Parses a multiple of real time, from 0.001 to 1000.
fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse().ok().filter(|speed| (0.001..=1000.0).contains(speed));
    speed.ok_or_else(|| "give a number from 0.001 to 1000, for example 1 or 0.5".to_owned())
}

impl Replay {
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        let name = self.file.display();
        if let (Some(from), Some(to)) = (self.from, self.to)
            && to <= from
        {
            return Err(CommandError::usage("--to must be after --from: nothing lies between them"));
        }
        let output = self.record.as_deref().map(|to| self.force.named_unless_read(to, [self.file.as_path()]));
        let outputs = Vec::from_iter(output.transpose()?);
        let file = fs::File::open(&self.file)
            .map_err(|error| CommandError::usage(format!("cannot read {name}: {error}")))?;
        // With --speed the command prints as it goes.
        let progress = if self.speed.is_some() { Progress::hidden() } else { Progress::of_file(&file) };
        let mut reader =
            Reader::new(progress.counting(file), &name.to_string()).map_err(CommandError::usage)?;
        let folder = tempfile::tempdir().map_err(|error| {
            CommandError::runtime(format!("cannot make a folder for the recorded configuration: {error}"))
        })?;
        // Write only known file names.
        for file in FILES {
            let text = reader.files().get(file).ok_or_else(|| {
                CommandError::usage(format!(
                    "{name} is not a recording of Leo: its configuration lacks {file}"
                ))
            })?;
            fs::write(folder.path().join(file), text).map_err(|error| {
                CommandError::runtime(format!("cannot write the recorded configuration: {error}"))
            })?;
        }
        let config = folder.path().join("leo.toml");
        // Errors should name the recording instead of the temporary folder.
        let refused = |error: &dyn std::fmt::Display| {
            CommandError::usage(
                error.to_string().replace(&folder.path().display().to_string(), &name.to_string()),
            )
        };
        let mut text = String::new();
        for file in Robot::migrated(&config).map_err(|error| refused(&error))? {
            if !file.steps.is_empty() {
                fs::write(&file.file, &file.text).map_err(|error| {
                    CommandError::runtime(format!("cannot write the recorded configuration: {error}"))
                })?;
                let which = file.file.file_name().unwrap_or_default().display();
                // Writing to a string cannot fail.
                let _ =
                    writeln!(text, "{name}: its {which} is of an older version: {}", file.steps.join("; "));
            }
        }
        let robot = Robot::load(Some(&config)).map_err(|error| refused(&error))?;
        body::check(&robot, Some(&config)).map_err(|error| refused(&error))?;
        let narrator = self.speed.map(|_| (Narrator::new(&robot.leo.belief.names), Transcript::default()));
        let mut narration = Narration { narrator };
        let replaying = ReplayOptions {
            domain: domain::own()?,
            settings: robot.leo.clone(),
            config,
            joints: robot.motor.joints.len(),
            speed: self.speed,
            from: self.from.unwrap_or_default(),
            to: self.to,
            record: self.recorded(&reader, &robot)?,
        };
        if reader.about().is_some_and(|about| about.time == Time::Lockstep) {
            reader.require_check_sums();
        }
        let played = supervisor_process::replay(&replaying, &mut reader, |frame| narration.tell(frame));
        drop(progress);
        let played = played.map_err(|error| {
            if matches!(error, LockstepError::Read(_)) {
                CommandError::usage(error)
            } else {
                CommandError::runtime(error)
            }
        })?;
        let _ = writeln!(text, "{name}: {:.3} s were played", played.lasted.as_secs_f64());
        if reader.is_cut() && reader.frames() == 0 {
            tracing::warn!(
                "{name}: the file is cut short after {} bytes, as by a killed writer: it has no whole frame",
                reader.bytes()
            );
        } else if reader.is_cut() {
            let _ = writeln!(
                text,
                "the file is truncated after {}: the part before was replayed",
                counted(reader.bytes(), "byte")
            );
        }
        if let Some(unchecked) = reader.unchecked() {
            let _ = writeln!(text, "{unchecked}: damage there would not be noticed");
        }
        let frames = |count| if count == 1 { "frame" } else { "frames" };
        for (topic, paired) in &played.paired {
            let FrameCounts { equal, uncompared } = *paired;
            let said = match (equal, uncompared) {
                (equal, 0) => format!("{equal:>9} {} equal", frames(equal)),
                (0, uncompared) => format!("{uncompared:>9} {}, not compared", frames(uncompared)),
                (equal, uncompared) => {
                    format!("{equal:>9} {} equal, {uncompared} not compared", frames(equal))
                }
            };
            let _ = writeln!(text, "{:<22} {said}", Channel(*topic).to_string());
        }
        if let Some(why) = played.incomparable {
            let _ = writeln!(text, "nothing was compared: {why}");
        }
        let printed = output::print_beside(&outputs, &text);
        if reader.is_cut() && reader.frames() > 0 {
            tracing::warn!("{name} is truncated: it was replayed up to there");
        }
        match played.wrong {
            None => printed.map(|()| ExitCode::SUCCESS),
            // A difference is an error, also if the report cannot be printed.
            Some(wrong) => Err(CommandError::runtime(format!("{name}: the first difference is in {wrong}"))),
        }
    }
}

impl Replay {
    /// The recording to make of the replay, if requested. It is in lockstep time, whatever the source is.
    fn recorded<R: Read>(&self, reader: &Reader<R>, robot: &Robot) -> Result<Option<Record>, CommandError> {
        let Some(output) = self.force.named_if(self.record.as_deref())? else { return Ok(None) };
        let about = reader.about().ok_or_else(|| CommandError::usage("nothing is known of the recording"))?;
        let text = |name: &'static str| Some((name, reader.files().get(name)?.clone()));
        let subject = Subject {
            robot: robot.clone(),
            files: FILES.into_iter().filter_map(text).collect(),
            time: Time::Lockstep,
            partners: about.partners,
            x_world_base: about.x_world_base(),
            program: output::program(),
        };
        Ok(Some(Record { output, subject }))
    }
}

/// Prints utterances and events as they happen, if requested.
struct Narration {
    narrator: Option<(Narrator, Transcript)>,
}

impl Narration {
    /// Returns whether what is printed has a reader.
    fn tell(&mut self, frame: &Frame) -> bool {
        let Some((narrator, transcript)) = &mut self.narrator else { return true };
        let mut lines: Vec<Line> = Vec::new();
        if frame.topic == TopicId::Utterances
            && let Some((_, said)) = frame.read::<Utterances>()
        {
            lines.extend(said.iter().map(|said| narrator.utterance(frame.at_ns, said)));
        } else if let Some((_, events)) = frame.read::<Events>() {
            lines.extend(events.iter().filter_map(|event| narrator.event(frame.at_ns, event)));
        }
        let text: String = lines.iter().map(|line| transcript.text(line)).collect();
        output::print(&text).is_ok()
    }
}
