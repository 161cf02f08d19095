//! `leo record`: a running robot into a file.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Duration;

use clap::Args;
use config::lesson::Lesson;
use recording::{Recorder, Subject, Time, stands};

use super::failure::Failed;
use super::{domain, output, seconds};

/// How often it is looked whether to stop.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Look at a running robot, and put down what its buffers hold.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Example:\n  leo record morning.mcap --for 60\n\nCtrl-C ends it. docs/recording.md says what is in the file."
)]
pub(crate) struct Record {
    /// The file, which is made anew
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The robot to look at, where several run
    #[arg(long, value_name = "DIRECTORY")]
    domain: Option<PathBuf>,
    /// End after so long; otherwise with the robot
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds::parse, allow_hyphen_values = true)]
    record_for: Option<Duration>,
    /// Keep only the last so many seconds, in memory, and write them at the end
    #[arg(long, value_name = "SECONDS", value_parser = seconds::parse, allow_hyphen_values = true)]
    last: Option<Duration>,
    /// The leo.toml that the robot runs with, for what viewers show [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// The lesson that it plays: where it stands in the room [default: built in, Task 1 of the study]
    #[arg(long, value_name = "FILE")]
    lesson: Option<PathBuf>,
}

impl Record {
    pub(crate) fn run(&self) -> Result<ExitCode, Failed> {
        let lesson = match &self.lesson {
            Some(file) => Lesson::load(file).map_err(Failed::usage)?,
            None => Lesson::builtin(),
        };
        let subject =
            Subject::load(self.config.as_deref(), Time::Wall, None, stands(&lesson), &super::program())
                .map_err(Failed::usage)?;
        let domain = domain::running(self.domain.as_deref())?;
        let stop = process::stop_flag().map_err(Failed::because)?;
        let recorder = match self.last {
            None => Recorder::start(&domain, subject, &self.file),
            Some(last) => Recorder::keep(&domain, subject, last),
        };
        let recorder = recorder.map_err(Failed::because)?;
        let until = self.record_for.map(|time| clock::now() + time);
        while !stop.load(Ordering::Relaxed)
            && !recorder.has_ended()
            && until.is_none_or(|until| clock::now() < until)
        {
            clock::sleep_until(clock::now() + LOOK_EVERY);
        }
        let mut said = String::new();
        if self.last.is_some() {
            let frames = recorder.save(&self.file).map_err(Failed::because)?;
            said = format!("of these, the last {frames} were written\n");
        }
        let counts = recorder.stop().map_err(Failed::because)?;
        let dropped = counts.total().dropped;
        let lost = match dropped {
            0 => "nothing was dropped".to_owned(),
            _ => format!("{dropped} frames were dropped: the machine or the disk was too slow"),
        };
        output::print(&format!("{}\n{counts}{said}{lost}\n", self.file.display()))?;
        Ok(ExitCode::SUCCESS)
    }
}
