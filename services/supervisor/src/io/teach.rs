//! `leo teach`: plays a lesson through the real processes in lockstep time.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clock::Instant;
use config::Files;
use config::leo::Leo;
use message::{Events, Process};
use process::Launch;
use recording::{BufferSubscribers, RecordError, recorded_topics};
use reports::lesson::LessonReport;
use transport::{Domain, FrameSubscriber, Node};

use crate::io::conductor::{Conductor, TurnSchedule};
use crate::io::lockstep_processes::{LockstepError, LockstepProcesses, in_domain};
use crate::io::run::{ORDER, RunError, keep_files};
use crate::io::tape::{Record, RecordingFile};

/// Timeout in simulated time for the last performance, counted from the end of the lesson's script.
const PERFORMANCE_TIMEOUT: Duration = Duration::from_secs(300);
/// Simulated time that the learner needs to answer the last utterance.
const ANSWER_TIME: Duration = Duration::from_secs(1);

/// Options of a lesson.
#[derive(Clone, Debug)]
pub struct LessonOptions {
    /// The robot's domain.
    pub domain: Domain,
    /// The validated configuration.
    pub settings: Leo,
    /// The configuration files, which the processes read.
    pub files: Files,
    /// The lesson.
    pub lesson: PathBuf,
    /// Number of performances in the lesson.
    pub performances: u32,
    /// Number of partners whose perspective is simulated; default: the configuration's value.
    pub partners: Option<u32>,
    /// Where to record the lesson.
    pub record: Option<Record>,
}

/// Plays one lesson to the end of the last performance, as fast as possible, and returns its report. Deterministic:
/// the same lesson always gives the same report.
///
/// # Errors
///
/// A process died or timed out (the error names it), or the robot could not be run. Shared memory is removed in any
/// case.
pub fn teach(teaching: &LessonOptions) -> Result<LessonReport, LockstepError> {
    let partners = teaching.partners.unwrap_or(teaching.settings.belief.partners);
    in_domain(&teaching.domain, &teaching.settings, partners, || play(teaching))
}

fn play(teaching: &LessonOptions) -> Result<LessonReport, LockstepError> {
    let processes: Vec<Process> =
        ORDER.into_iter().filter(|process| !matches!(process, Process::Console | Process::Link)).collect();
    let (node, mut conductor, mut lockstep_processes) =
        LockstepProcesses::open(&teaching.domain, &teaching.settings, &processes, &[])?;
    let mut events = node.subscriber::<Events>(None)?;
    let mut recorder =
        teaching.record.as_ref().map(|record| LessonRecorder::open(&node, record)).transpose()?;
    let kept = keep_files(&teaching.domain, &teaching.files).map_err(RunError::from)?;
    let launch = Launch {
        config: teaching.files.leo().map(Path::to_owned),
        kept: Some(kept),
        lesson: Some(teaching.lesson.clone()),
        partners: teaching.partners,
        ..Launch::default()
    };
    lockstep_processes.start_all(&node, &processes, launch)?;
    let report = conduct(&mut conductor, &mut lockstep_processes, &mut events, recorder.as_mut(), teaching);
    lockstep_processes.stop_all(&mut conductor);
    let report = report?;
    if let Some(recorder) = recorder {
        recorder.finish()?;
    }
    Ok(report)
}

fn conduct(
    conductor: &mut Conductor,
    lockstep_processes: &mut LockstepProcesses,
    events: &mut FrameSubscriber<Events>,
    mut recorder: Option<&mut LessonRecorder>,
    teaching: &LessonOptions,
) -> Result<LessonReport, LockstepError> {
    let settings = &teaching.settings;
    let (sensor, motor) = (settings.sensor.rate_hz.period(), settings.motor.rate_hz.period());
    let mut schedule = TurnSchedule::new(&[
        (Process::Simulator, settings.simulator.rate_hz.period()),
        (Process::Sensor, sensor),
        (Process::Belief, sensor),
        (Process::Learner, sensor),
        (Process::MockBus, motor),
        (Process::Motor, motor),
    ]);
    let performances = usize::try_from(teaching.performances).unwrap_or(usize::MAX);
    let mut report = LessonReport::default();
    let mut script_over: Option<Instant> = None;
    while let Some((process, at)) = schedule.next_turn() {
        let finished = conductor.step(process, at, lockstep_processes)?;
        if let Some(recorder) = &mut recorder {
            recorder.take()?;
        }
        if process == Process::Simulator && finished {
            script_over.get_or_insert(at);
        }
        while let Some(frame) = events.receive()? {
            for event in frame.entries() {
                report.add(event);
            }
        }
        if let Some(over) = script_over {
            if report.performances_ended() >= performances && at.since(over) >= ANSWER_TIME {
                break;
            }
            if at.since(over) > PERFORMANCE_TIMEOUT {
                return Err(LockstepError::Unfinished(PERFORMANCE_TIMEOUT));
            }
        }
    }
    Ok(report)
}

/// Recorder of a lesson. It drains the topics after every turn, so that the file holds the frames in the order of the
/// turns.
struct LessonRecorder {
    inlets: BufferSubscribers,
    tape: RecordingFile,
}

impl LessonRecorder {
    fn open(node: &Node, record: &Record) -> Result<Self, RecordError> {
        let perspectives = record.subject.robot.leo.belief.perspectives(record.subject.partners);
        let tape = RecordingFile::begin(record)?;
        Ok(Self { inlets: BufferSubscribers::make(node, recorded_topics(perspectives))?, tape })
    }

    fn take(&mut self) -> Result<(), RecordError> {
        let mut written = Ok(());
        self.inlets.take(|frame| {
            if written.is_ok() {
                written = self.tape.write(&frame);
            }
        })?;
        written
    }

    fn finish(mut self) -> Result<(), RecordError> {
        self.take()?;
        self.tape.finish()
    }
}
