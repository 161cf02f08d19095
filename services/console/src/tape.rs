//! The page's record button.

use std::path::PathBuf;

use clock::{Duration, Instant};
use config::lesson::Lesson;
use process::Launch;
use recording::{Recorder, Subject, Time, stands};
use serde_json::json;
use transport::Domain;

use crate::sheet::Sheet;

/// The program, as recordings name it.
pub(crate) const PROGRAM: &str = concat!("leo ", env!("CARGO_PKG_VERSION"));

/// Records the robot into a file of its state directory while somebody wants it to.
pub(crate) struct Tape {
    launch: Launch,
    lesson: Lesson,
    domain: Domain,
    running: Option<Running>,
    /// What the last recording ended with, if it did not end well.
    error: Option<String>,
    /// The last file, and what was dropped of it.
    last: Option<(PathBuf, u64)>,
}

struct Running {
    recorder: Recorder,
    file: PathBuf,
    since: Instant,
}

impl Tape {
    pub(crate) fn new(launch: &Launch, lesson: &Lesson, domain: Domain) -> Self {
        let (launch, lesson) = (launch.clone(), lesson.clone());
        Self { launch, lesson, domain, running: None, error: None, last: None }
    }

    /// Begins a recording; where one runs, that is it. The file that is written is given back.
    pub(crate) fn begin(&mut self, now: Instant) -> Result<String, String> {
        if let Some(running) = &self.running {
            return Ok(running.file.display().to_string());
        }
        let Some(state) = &self.launch.state else {
            return Err("this robot remembers nothing: it has no state directory".to_owned());
        };
        let folder = process::state::recordings(state);
        std::fs::create_dir_all(&folder)
            .map_err(|error| format!("cannot make the folder {}: {error}", folder.display()))?;
        let free = (1..10_000).map(|number| folder.join(format!("recording_{number}.mcap")));
        let file = free
            .into_iter()
            .find(|file| !file.exists())
            .ok_or_else(|| format!("{} is full of recordings: take some away", folder.display()))?;
        let stands = stands(&self.lesson);
        let config = self.launch.config.as_deref();
        let subject = Subject::load(config, Time::Wall, self.launch.partners, stands, PROGRAM);
        let subject = subject.map_err(|error| error.to_string())?;
        let recorder = Recorder::start(&self.domain, subject, &file).map_err(|error| error.to_string())?;
        let said = file.display().to_string();
        self.error = None;
        self.running = Some(Running { recorder, file, since: now });
        Ok(said)
    }

    /// Ends the recording, if one runs; the file that was written is given back.
    pub(crate) fn end(&mut self) -> Result<Option<String>, String> {
        let Some(running) = self.running.take() else { return Ok(None) };
        let file = running.file;
        match running.recorder.stop() {
            Ok(counts) => {
                let said = file.display().to_string();
                self.last = Some((file, counts.total().dropped));
                Ok(Some(said))
            }
            Err(error) => {
                self.error = Some(error.to_string());
                Err(error.to_string())
            }
        }
    }

    /// Shows how the recording fares. One that ended by itself has failed, and says why.
    pub(crate) fn show(&mut self, now: Instant, sheet: &mut Sheet) {
        if self.running.as_ref().is_some_and(|running| running.recorder.has_ended()) {
            // It is told below.
            let _failed = self.end();
        }
        let cell = match &self.running {
            Some(running) => {
                let seconds = Duration::as_secs(&now.since(running.since));
                let bytes = std::fs::metadata(&running.file).map_or(0, |file| file.len());
                let dropped = running.recorder.counts().total().dropped;
                let file = running.file.display().to_string();
                json!({ "on": true, "file": file, "seconds": seconds, "bytes": bytes, "dropped": dropped, "error": null })
            }
            None => {
                let file = self.last.as_ref().map(|(file, _)| file.display().to_string());
                let dropped = self.last.as_ref().map_or(0, |(_, dropped)| *dropped);
                json!({ "on": false, "file": file, "seconds": 0, "bytes": 0, "dropped": dropped, "error": self.error })
            }
        };
        sheet.put("recording", &cell);
    }
}
