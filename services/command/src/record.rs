//! `leo record`: records a running robot into a file.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Duration;

use clap::Args;
use process::black_box;
use quantity::number::{counted, counted_with};
use recording::Recorder;
use transport::Domain;
use transport::janitor::is_claimed;

use crate::failure::CommandError;
use crate::output::Force;
use crate::progress::Progress;
use crate::viewed_robot::ViewedRobot;
use crate::{domain, output, seconds};

/// Polling interval of the stop conditions.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// Time-out for the robot to write its black box.
const DUMP_TIMEOUT: Duration = Duration::from_secs(60);
/// Memory limit of `--last`, in bytes: half an hour of a robot with one partner.
const MAX_MEMORY_BYTES: usize = 1_000_000_000;

/// Look at a running robot, and put down what its buffers hold.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo record morning.mcap --for 60\n  leo record --black-box\n\nCtrl-C ends it. \
                        docs/recording.md says what is in the file."
)]
pub(crate) struct Record {
    /// The file to write; `-` is standard output
    #[arg(value_name = "FILE", required_unless_present = "black_box")]
    file: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
    /// Write the last minutes from the robot's own black box into a file now
    #[arg(long, conflicts_with_all = ["file", "record_for", "last", "config", "lesson"])]
    black_box: bool,
    /// The robot, if several run
    #[arg(long, value_name = "DIRECTORY")]
    domain: Option<PathBuf>,
    /// End after this time [default: when the robot ends]
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds::parse, allow_hyphen_values = true)]
    record_for: Option<Duration>,
    /// Keep only the last seconds in memory, 1 GB at most, and write them at the end
    #[arg(long, value_name = "SECONDS", value_parser = seconds::parse, allow_hyphen_values = true)]
    last: Option<Duration>,
    #[command(flatten)]
    viewed: ViewedRobot,
}

impl Record {
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        match &self.file {
            Some(file) => self.record(file),
            None => request_dump(&domain::running(self.domain.as_deref())?),
        }
    }

    fn record(&self, file: &Path) -> Result<ExitCode, CommandError> {
        let subject = self.viewed.subject()?;
        let domain = domain::running(self.domain.as_deref())?;
        // Check the layouts before creating a file that would stay empty.
        domain.check_layouts().map_err(CommandError::runtime)?;
        let inputs = self.viewed.files();
        let to = self.force.named_unless_read(file, inputs.iter().map(PathBuf::as_path))?;
        let stop = process::stop_flag().map_err(CommandError::runtime)?;
        let recorder = match self.last {
            None => Recorder::start(&domain, subject, &to),
            Some(last) => Recorder::keep(&domain, subject, last, MAX_MEMORY_BYTES),
        };
        let recorder = recorder.map_err(CommandError::runtime)?;
        let until = self.record_for.map(|time| clock::now() + time);
        let began = clock::now();
        let mut shown_s = None;
        let progress =
            self.record_for.map_or_else(Progress::without_end, |time| Progress::of_steps(time.as_secs()));
        while !stop.load(Ordering::Relaxed)
            && !recorder.has_ended()
            && until.is_none_or(|until| clock::now() < until)
        {
            let passed = clock::now().since(began).as_secs();
            if shown_s.replace(passed) != Some(passed) {
                progress.set(passed);
                let frames = counted(recorder.counts().total().written, "frame");
                progress.say(format!("{passed} s recorded, {frames}; Ctrl-C ends it"));
            }
            clock::sleep_until(clock::now() + POLL_INTERVAL);
        }
        drop(progress);
        let mut said = String::new();
        if self.last.is_some() {
            let last = recorder.last().map_err(CommandError::runtime)?;
            let (frames, seconds) = (last.write(&to).map_err(CommandError::runtime)?, last.span().as_secs());
            let were = counted_with(frames, "was", "were");
            said = format!("of these, the last {were} written, those of {seconds} s\n");
        }
        let counts = recorder.stop().map_err(CommandError::runtime)?;
        let dropped = counts.total().dropped;
        let lost = match dropped {
            0 => "nothing was dropped".to_owned(),
            _ => format!(
                "{} dropped: the machine or the disk was too slow",
                counted_with(dropped, "frame was", "frames were")
            ),
        };
        output::print_beside(&[to], &format!("{}\n{counts}{said}{lost}\n", file.display()))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Requests a dump of the robot's black box, and waits for the file.
fn request_dump(domain: &Domain) -> Result<ExitCode, CommandError> {
    let root = domain.root();
    let failed = |why: String| CommandError::runtime(format!("{}: {why}", root.display()));
    let stop = process::stop_flag().map_err(CommandError::runtime)?;
    let word = std::process::id().to_string();
    if !is_claimed(domain) {
        return Err(failed("no robot runs here".to_owned()));
    }
    black_box::ask(root, &word).map_err(|error| {
        failed(if error.kind() == ErrorKind::AlreadyExists {
            "another request is pending: try again".to_owned()
        } else {
            format!("{error}; is the robot another user's?")
        })
    })?;
    let until = clock::now() + DUMP_TIMEOUT;
    loop {
        if let Some(answer) = black_box::answered(root, &word) {
            output::print(&format!("{}\n", answer.map_err(failed)?))?;
            return Ok(ExitCode::SUCCESS);
        }
        if stop.load(Ordering::Relaxed) || !is_claimed(domain) || clock::now() >= until {
            // Remove the request, so that it is not served later.
            let _withdrawn = black_box::asked(root);
            return Err(failed(
                "the robot did not answer: was its console process restarted? try again".to_owned(),
            ));
        }
        clock::sleep_until(clock::now() + POLL_INTERVAL);
    }
}
