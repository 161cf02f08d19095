//! Recordings started and stopped with the page's record button.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clock::{Duration, Instant};
use config::lesson::Lesson;
use folder::{Folder, Output};
use process::Launch;
use recording::{Recorder, Subject, Time, robot_pose};
use serde_json::json;
use transport::Domain;

use crate::io::background::Background;
use crate::io::requester::Requester;
use crate::state_store::StateStore;

/// The program's name and version, as written into recordings.
pub(crate) const PROGRAM: &str = concat!("leo ", env!("CARGO_PKG_VERSION"));
/// Maximum number of pending requests; further ones are refused.
const MAX_WAITING: usize = 64;

/// Records the robot into a file of its state directory on request.
///
/// Starting and stopping block on the disk, so each runs in a thread, one after the other. The requester is answered
/// when it is done.
pub(crate) struct Tape {
    folder: Option<PathBuf>,
    start: Start,
    state: State,
    waiting: VecDeque<RecordRequest>,
    /// The error of the last recording, if it failed.
    error: Option<String>,
    /// The last file, and the number of frames dropped from it.
    last: Option<(PathBuf, u64)>,
}

/// Starts a recording into a new file. On failure the file is removed.
type Start = Arc<dyn Fn(&Output) -> Result<Box<dyn Recording>, String> + Send + Sync>;

/// A running recording.
trait Recording: Send {
    /// Whether it ended because of an error.
    fn has_ended(&self) -> bool;
    /// Frames dropped so far.
    fn dropped(&self) -> u64;
    /// Ends it and returns the total number of dropped frames.
    fn stop(self: Box<Self>) -> Result<u64, String>;
}

impl Recording for Recorder {
    fn has_ended(&self) -> bool {
        Self::has_ended(self)
    }

    fn dropped(&self) -> u64 {
        self.counts().total().dropped
    }

    fn stop(self: Box<Self>) -> Result<u64, String> {
        let counts = Self::stop(*self).map_err(|error| error.to_string())?;
        Ok(counts.total().dropped)
    }
}

enum State {
    Idle,
    Beginning { begun: Background<Running>, requester: Requester },
    Running(Running),
    Ending { file: PathBuf, ended: Background<u64>, requester: Option<Requester> },
}

struct Running {
    recording: Box<dyn Recording>,
    file: PathBuf,
    since: Instant,
}

/// A request to start or stop a recording.
struct RecordRequest {
    on: bool,
    requester: Requester,
}

/// Answers with the path of a file, or why there is none.
fn tell(requester: &Requester, result: Result<Option<&Path>, &str>) {
    let file = result.map(|file| file.map(|file| file.display().to_string()));
    requester.answer(file.as_ref().map(|file| Some(("file", file.as_deref()?))).map_err(|why| *why));
}

impl Tape {
    pub(crate) fn new(launch: &Launch, lesson: &Lesson, domain: Domain) -> Self {
        let folder = launch.state.as_deref().map(process::state::recordings);
        let (launch, robot_pose) = (launch.clone(), robot_pose(lesson));
        let start = move |output: &Output| {
            let files = launch.files().map_err(|error| error.to_string())?;
            let subject = Subject::of(&files, Time::Wall, launch.partners, robot_pose, PROGRAM);
            let subject = subject.map_err(|error| error.to_string())?;
            let recorder = Recorder::start(&domain, subject, output).map_err(|error| error.to_string())?;
            Ok(Box::new(recorder) as Box<dyn Recording>)
        };
        Self::with(folder, Arc::new(start))
    }

    fn with(folder: Option<PathBuf>, start: Start) -> Self {
        Self { folder, start, state: State::Idle, waiting: VecDeque::new(), error: None, last: None }
    }

    /// Queues a page's request to start or stop a recording.
    pub(crate) fn ask(&mut self, on: bool, requester: Requester) {
        if self.waiting.len() >= MAX_WAITING {
            tell(&requester, Err("recordings wait for the disk: try again later"));
            return;
        }
        self.waiting.push_back(RecordRequest { on, requester });
    }

    /// Executes pending requests without blocking and answers those that are done. Returns whether the state changed.
    pub(crate) fn step(&mut self, now: Instant) -> bool {
        let mut has_changed = self.settle();
        while matches!(self.state, State::Idle | State::Running(_))
            && let Some(wanted) = self.waiting.pop_front()
        {
            self.turn(now, wanted);
            has_changed = true;
        }
        has_changed
    }

    /// Polls the running thread. Returns whether it finished.
    fn settle(&mut self) -> bool {
        match std::mem::replace(&mut self.state, State::Idle) {
            State::Beginning { begun, requester } => match begun.poll() {
                None => self.state = State::Beginning { begun, requester },
                Some(Ok(running)) => {
                    tell(&requester, Ok(Some(&running.file)));
                    self.error = None;
                    self.state = State::Running(running);
                    return true;
                }
                Some(Err(error)) => {
                    tell(&requester, Err(&error));
                    return true;
                }
            },
            State::Ending { file, ended, requester } => match ended.poll() {
                None => self.state = State::Ending { file, ended, requester },
                Some(ended) => {
                    self.ended(file, ended, requester.as_ref());
                    return true;
                }
            },
            // A recording that ended by itself has failed; ending it yields the error.
            State::Running(running) if running.recording.has_ended() => self.end(running, None),
            state @ (State::Running(_) | State::Idle) => self.state = state,
        }
        false
    }

    fn turn(&mut self, now: Instant, RecordRequest { on, requester }: RecordRequest) {
        match std::mem::replace(&mut self.state, State::Idle) {
            // Only one recording runs at a time: a second start request joins it.
            State::Running(running) if on => {
                tell(&requester, Ok(Some(&running.file)));
                self.state = State::Running(running);
            }
            State::Running(running) => self.end(running, Some(requester)),
            State::Idle if on => self.begin(now, requester),
            state @ (State::Idle | State::Beginning { .. } | State::Ending { .. }) => {
                tell(&requester, Ok(None));
                self.state = state;
            }
        }
    }

    fn begin(&mut self, now: Instant, requester: Requester) {
        let Some(folder) = self.folder.clone() else {
            tell(&requester, Err("this robot saves nothing: it has no state directory"));
            return;
        };
        let start = Arc::clone(&self.start);
        let begun = Background::start("tape", move || begin(&folder, &start, now));
        self.state = State::Beginning { begun, requester };
    }

    fn end(&mut self, running: Running, requester: Option<Requester>) {
        let Running { recording, file, .. } = running;
        let ended = Background::start("tape", move || recording.stop());
        self.state = State::Ending { file, ended, requester };
    }

    fn ended(&mut self, file: PathBuf, ended: Result<u64, String>, requester: Option<&Requester>) {
        if let Some(requester) = requester {
            tell(requester, ended.as_ref().map(|_dropped| Some(file.as_path())).map_err(String::as_str));
        }
        match ended {
            Ok(dropped) => self.last = Some((file, dropped)),
            Err(error) => self.error = Some(error),
        }
    }

    /// Blocks until no recording runs and all data is written.
    pub(crate) fn finish(mut self) -> Result<(), String> {
        if let State::Beginning { begun, .. } = self.state {
            self.state = State::Running(begun.wait()?);
        }
        match self.state {
            State::Running(running) => running.recording.stop().map(drop),
            State::Ending { ended, .. } => ended.wait().map(drop),
            State::Idle | State::Beginning { .. } => Ok(()),
        }
    }

    /// Publishes the state of the recording.
    pub(crate) fn show(&self, now: Instant, state_store: &mut StateStore) {
        let cell = match &self.state {
            State::Running(running) => {
                let seconds = Duration::as_secs(&now.since(running.since));
                let bytes = std::fs::metadata(&running.file).map_or(0, |file| file.len());
                let (file, dropped) = (running.file.display().to_string(), running.recording.dropped());
                json!({ "on": true, "file": file, "seconds": seconds, "bytes": bytes, "dropped": dropped, "error": null })
            }
            State::Idle | State::Beginning { .. } | State::Ending { .. } => {
                let file = self.last.as_ref().map(|(file, _)| file.display().to_string());
                let dropped = self.last.as_ref().map_or(0, |(_, dropped)| *dropped);
                json!({ "on": false, "file": file, "seconds": 0, "bytes": 0, "dropped": dropped, "error": self.error })
            }
        };
        state_store.put("recording", &cell);
    }
}

/// Starts a recording into the next free file name.
fn begin(folder: &Path, start: &Start, now: Instant) -> Result<Running, String> {
    let own = Folder::make_all(folder).map_err(|error| format!("cannot record: {error}"))?;
    let own = Arc::new(own);
    let mut names = (1..10_000).map(|number| format!("recording_{number}.mcap"));
    let name = names
        .find(|name| own.has(name).is_ok_and(|is_there| !is_there))
        .ok_or_else(|| format!("{} is full of recordings: delete some", folder.display()))?;
    let output = Output::in_folder(&own, &name);
    let recording = start(&output)?;
    Ok(Running { recording, file: output.path().to_owned(), since: now })
}
