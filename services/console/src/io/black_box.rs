//! The black box: keeps the last minutes of the robot in memory and writes them to a file after a failure.

mod failures;
mod files;

use std::path::PathBuf;
use std::sync::Arc;

use clock::{Duration, Instant};
use config::Robot;
use config::lesson::Lesson;
use folder::Output;
use message::{Process, Roster};
use process::{Launch, black_box, emergency};
use recording::{Recorder, RingSnapshot, Subject, Time, robot_pose};
use transport::{CurrentBoard, Domain, Node};

use crate::io::background::Background;
use crate::io::requester;
use crate::io::tape::PROGRAM;
use failures::{FailureDetector, FailureEvent};
use files::{FINISHED, Files, REQUESTED, UNFINISHED};

/// Interval between two checks for failures.
const CHECK_INTERVAL: Duration = Duration::from_millis(100);
/// Recording continues for this long after a failure before its file is written.
const AFTERMATH: Duration = Duration::from_secs(3);
/// Minimum interval between two failure dumps. Failures in between go into the next dump.
const MIN_DUMP_INTERVAL: Duration = Duration::from_secs(30);
/// Time span of the dump written when the robot ends with a failure; there is no time for a full one.
const FINAL_DUMP_SPAN: Duration = Duration::from_secs(20);

/// Maximum number of requesters waiting for the next file.
const MAX_REQUESTERS: usize = 256;

/// The requester of a dump.
#[derive(Debug)]
pub(crate) enum Requester {
    /// A page.
    Page(requester::Requester),
    /// Another program, with the request word that it gave.
    Program(String),
}

/// Keeps the last minutes of the robot in memory, in threads of its own. Writes them to a file when a process
/// dies, a joint is quarantined or the emergency stop is raised, and on request.
pub(crate) struct BlackBox {
    kept: Result<DumpRecorder, String>,
    domain: PathBuf,
    joint_names: Vec<String>,
    roster: CurrentBoard<Roster>,
    failures: FailureDetector,
    looked_at: Option<Instant>,
    waiting: Waiting,
    /// Time of the last failure dump.
    wrote_at: Option<Instant>,
    writing: Option<Writing>,
}

#[derive(Clone)]
struct DumpRecorder {
    recorder: Arc<Recorder>,
    files: Files,
}

/// The failures and requests that the next file is for.
#[derive(Debug, Default)]
struct Waiting {
    failed: Vec<FailureEvent>,
    since: Option<Instant>,
    requesters: Vec<Requester>,
}

/// A file that is being written.
struct Writing {
    wanted: Waiting,
    outcome: Background<Written>,
}

/// A file that was written.
struct Written {
    file: String,
    span: Duration,
}

impl BlackBox {
    /// Starts to record into memory, if the configuration enables it and there is a state directory.
    pub(crate) fn open(launch: &Launch, robot: &Robot, lesson: &Lesson) -> Self {
        Self {
            kept: DumpRecorder::open(launch, robot, lesson),
            domain: launch.domain.clone(),
            joint_names: robot.motor.joints.iter().map(|joint| joint.name.clone()).collect(),
            roster: CurrentBoard::default(),
            failures: FailureDetector::default(),
            looked_at: None,
            waiting: Waiting::default(),
            wrote_at: None,
            writing: None,
        }
    }

    /// Requests a dump. Refuses a page if [`MAX_REQUESTERS`] requesters already wait for a slow disk.
    pub(crate) fn ask(&mut self, requester: Requester) {
        match &requester {
            Requester::Page(page) if self.waiting.requesters.len() >= MAX_REQUESTERS => {
                let why = "the disk is slow, and many requests wait for this file: try again later";
                page.answer(Err(why));
            }
            Requester::Page(_) | Requester::Program(_) => self.waiting.requesters.push(requester),
        }
    }

    /// Checks for failures and writes the dump that is due. Returns the messages for the operator.
    pub(crate) fn step(&mut self, now: Instant, node: &Node, quarantined: &[u32]) -> Vec<String> {
        if self.looked_at.is_some_and(|then| now.since(then) < CHECK_INTERVAL) {
            return Vec::new();
        }
        self.looked_at = Some(now);
        self.waiting.requesters.extend(black_box::asked(&self.domain).map(Requester::Program));
        self.check_failures(now, node, quarantined);
        let lines = self.written();
        self.write(now);
        lines
    }

    fn check_failures(&mut self, now: Instant, node: &Node, quarantined: &[u32]) {
        let roster = self.roster.read(node, Process::Supervisor, 1);
        let lives = roster.map(|roster| self.failures.check_processes(&roster));
        let joints = self.failures.check_joints(quarantined, &self.joint_names);
        let stopped = self.failures.check_emergency_stop(emergency::is_raised(&self.domain));
        let failed = lives.unwrap_or_default().into_iter().chain(joints).chain(stopped);
        let before = self.waiting.failed.len();
        self.waiting.failed.extend(failed);
        if self.waiting.failed.len() > before {
            self.waiting.since.get_or_insert(now);
        }
    }

    /// Starts the next dump, if a request is pending or the aftermath of a failure is over.
    fn write(&mut self, now: Instant) {
        if self.writing.is_some() {
            return;
        }
        let Some(wanted) = self.waiting.due(now, self.wrote_at) else { return };
        if !wanted.failed.is_empty() {
            self.wrote_at = Some(now);
        }
        let (kept, word) = (self.kept.clone(), wanted.word());
        // On a loaded machine reading the ring takes a while.
        let outcome = Background::start("black-box", move || {
            let kept = kept?;
            write(&kept.last()?, &kept.files, &word)
        });
        self.writing = Some(Writing { wanted, outcome });
    }

    /// Reports a finished dump to its requesters.
    fn written(&mut self) -> Vec<String> {
        let Some(writing) = self.writing.take() else { return Vec::new() };
        let Some(outcome) = writing.outcome.poll() else {
            self.writing = Some(writing);
            return Vec::new();
        };
        let result = outcome.as_ref().map(|written| written.file.as_str()).map_err(String::as_str);
        for requester in &writing.wanted.requesters {
            match requester {
                Requester::Page(page) => page.answer(result.map(|file| Some(("file", file)))),
                Requester::Program(word) => {
                    if let Err(error) = black_box::answer(&self.domain, word, result) {
                        tracing::warn!(%error, "cannot answer the request for the last minutes");
                    }
                }
            }
        }
        // Without a recorder a failure produces no dump, so there is nothing to report.
        let is_told = self.kept.is_ok() && !writing.wanted.failed.is_empty() || outcome.is_ok();
        if is_told { vec![dump_message(&writing.wanted, &outcome)] } else { Vec::new() }
    }

    /// The shutdown work, which may take seconds: waits for the dump in progress, then writes a short dump for
    /// failures that have none. Returns the messages for the operator.
    pub(crate) fn end(self) -> impl FnOnce() -> Vec<String> + Send {
        let Self { kept, waiting, writing, .. } = self;
        move || {
            let mut lines = Vec::new();
            if let Some(Writing { wanted, outcome }) = writing {
                lines.push(dump_message(&wanted, &outcome.wait()));
            }
            if let Ok(kept) = &kept
                && !waiting.failed.is_empty()
            {
                let written = kept
                    .last()
                    .and_then(|last| write(&last.newest(FINAL_DUMP_SPAN), &kept.files, &waiting.word()));
                lines.push(dump_message(&waiting, &written));
            }
            lines
        }
    }
}

impl DumpRecorder {
    fn open(launch: &Launch, robot: &Robot, lesson: &Lesson) -> Result<Self, String> {
        let console = &robot.leo.console;
        let span = console.black_box_s.duration();
        if span.is_zero() {
            return Err("this robot has no black box: `console.black_box_s` is 0".to_owned());
        }
        let Some(state) = &launch.state else {
            return Err("this robot saves nothing: it has no state directory".to_owned());
        };
        let begin = || {
            let domain = Domain::at(&launch.domain).map_err(|error| error.to_string())?;
            let subject = launch.files().and_then(|files| {
                Subject::of(&files, Time::Wall, launch.partners, robot_pose(lesson), PROGRAM)
            });
            let subject = subject.map_err(|error| error.to_string())?;
            let bytes = console.black_box_mb.get().saturating_mul(1_000_000);
            Recorder::keep(&domain, subject, span, bytes).map_err(|error| error.to_string())
        };
        let recorder = begin().map_err(|error| {
            // A missing black box must not keep the robot from running.
            tracing::error!("cannot start the black box: {error}; the robot runs without it");
            format!("this robot has no black box: {error}")
        })?;
        let files =
            Files { folder: process::state::recordings(state), max_per_kind: console.black_box_files.get() };
        Ok(Self { recorder: Arc::new(recorder), files })
    }

    fn last(&self) -> Result<RingSnapshot, String> {
        self.recorder.last().map_err(|error| error.to_string())
    }
}

impl Waiting {
    /// What the next dump is for, if one is due. A failure has priority once its aftermath is over, because the ring
    /// overwrites what led to it. Requests pending at that time share its dump; otherwise they get one at once.
    fn due(&mut self, now: Instant, wrote_at: Option<Instant>) -> Option<Self> {
        let has_settled = self.since.is_some_and(|since| now.since(since) >= AFTERMATH);
        let is_apart = wrote_at.is_none_or(|then| now.since(then) >= MIN_DUMP_INTERVAL);
        if has_settled && is_apart {
            return Some(std::mem::take(self));
        }
        let requesters = std::mem::take(&mut self.requesters);
        (!requesters.is_empty()).then(|| Self { requesters, ..Self::default() })
    }

    /// The suffix of the dump's file name: one word per kind of failure, in order of first occurrence.
    fn word(&self) -> String {
        let mut words: Vec<&str> = Vec::new();
        for FailureEvent { word, .. } in &self.failed {
            if !words.contains(&word.as_str()) {
                words.push(word);
            }
        }
        if words.is_empty() { REQUESTED.to_owned() } else { words.join("_") }
    }
}

/// The message for the operator about a dump.
fn dump_message(wanted: &Waiting, outcome: &Result<Written, String>) -> String {
    let what: Vec<&str> = wanted.failed.iter().map(|failed| failed.what.as_str()).collect();
    let why = if what.is_empty() { String::new() } else { format!("{}; ", what.join(", ")) };
    match outcome {
        Ok(Written { file, span }) => format!("{why}the last {} s are in {file}", span.as_secs()),
        Err(error) => format!("{why}the last minutes could not be written: {error}"),
    }
}

/// Writes a dump and removes the oldest surplus files. An incomplete file is removed.
fn write(last: &RingSnapshot, files: &Files, word: &str) -> Result<Written, String> {
    let in_folder = |error: std::io::Error| format!("{}: {error}", files.folder.display());
    let folder = Arc::new(files.open().map_err(|error| error.to_string())?);
    let stem = files.next(word).map_err(in_folder)?;
    // Write under another name and rename: a reader never sees an incomplete file.
    let [name, unfinished] = [FINISHED, UNFINISHED].map(|extension| format!("{stem}{extension}"));
    last.write(&Output::in_folder(&folder, &unfinished)).map_err(|error| error.to_string())?;
    let renamed = folder.rename(&unfinished, &name).and_then(|()| files.evict_oldest(&folder));
    renamed.map_err(in_folder)?;
    Ok(Written { file: files.folder.join(name).display().to_string(), span: last.span() })
}

#[cfg(test)]
mod tests {
    use crossbeam::channel::bounded;

    use super::*;
    use crate::io::background::NO_RESULT;

    #[test]
    fn an_aborted_writer_does_not_block_the_next_dump() {
        let (page, mut answers) = tokio::sync::mpsc::channel(1);
        let wanted = Waiting {
            requesters: vec![Requester::Page(requester::Requester { page, id: Some(7) })],
            ..Waiting::default()
        };
        let (to, outcome) = bounded(1);
        let mut black_box = BlackBox {
            kept: Err("none is needed".to_owned()),
            domain: PathBuf::new(),
            joint_names: Vec::new(),
            roster: CurrentBoard::default(),
            failures: FailureDetector::default(),
            looked_at: None,
            waiting: Waiting::default(),
            wrote_at: None,
            writing: Some(Writing { wanted, outcome: Background(outcome) }),
        };
        assert!(black_box.written().is_empty() && black_box.writing.is_some());
        drop(to);
        black_box.written();
        assert!(black_box.writing.is_none());
        assert!(answers.try_recv().unwrap().contains(NO_RESULT));
    }

    #[test]
    fn a_failure_dump_has_priority_over_requests() {
        let at = |ms| Instant::EPOCH + Duration::from_millis(ms);
        let mut waiting = Waiting::default();
        let asked_and_due = |waiting: &mut Waiting, ms, wrote_at| {
            waiting.requesters.push(Requester::Program("word".to_owned()));
            waiting.due(at(ms), wrote_at).unwrap()
        };
        waiting.failed.push(FailureEvent { word: "belief".to_owned(), what: "belief died".to_owned() });
        waiting.since = Some(at(1000));
        // The aftermath is not over yet, and a request does not wait for it.
        let early = asked_and_due(&mut waiting, 3999, None);
        assert_eq!((early.word().as_str(), early.requesters.len()), (REQUESTED, 1));
        let due = asked_and_due(&mut waiting, 4000, None);
        assert_eq!((due.word().as_str(), due.requesters.len(), due.failed.len()), ("belief", 1, 1));
        assert!(waiting.due(at(4001), Some(at(4000))).is_none());
        // A failure alone gets no dump so soon after another one.
        waiting.failed.push(FailureEvent { word: "motor".to_owned(), what: "motor died".to_owned() });
        waiting.since = Some(at(5000));
        assert_eq!(asked_and_due(&mut waiting, 9000, Some(at(4000))).word(), REQUESTED);
        assert!(waiting.due(at(33_999), Some(at(4000))).is_none());
        // The file name contains a word for each kind of failure.
        for word in ["quarantine", "motor", "quarantine"] {
            waiting.failed.push(FailureEvent { word: word.to_owned(), what: "failed".to_owned() });
        }
        assert_eq!(waiting.due(at(34_000), Some(at(4000))).unwrap().word(), "motor_quarantine");
    }
}
