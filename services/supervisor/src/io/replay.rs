//! `leo replay`: feeds a recording's percepts, utterances and joint states to the real belief and learner processes,
//! and compares their output with the recorded output.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::io::Read;
use std::path::PathBuf;
use std::time::Duration;

use clock::Instant;
use config::leo::Leo;
use invariant::require;
use message::{Head as _, Hop, JointStates, Percepts, Process, Recording, Topic, TopicId, Utterances};
use process::Launch;
use recording::{BufferSubscribers, Channel, Difference, Frame, Reader, RecordError, Time, recorded_topics};
use transport::{Domain, FramePublisher, Node, PortError};

use crate::io::conductor::{Conductor, ProcessMonitor as _, TurnError};
use crate::io::lockstep_processes::{LockstepError, LockstepProcesses, in_domain};
use crate::io::tape::{Record, RecordingFile};

/// The processes that consume what is replayed; readers before their writers.
const PROCESSES: [Process; 2] = [Process::Learner, Process::Belief];
/// The processes whose recorded output the player publishes in their place.
const REPLAYED_PROCESSES: [Process; 3] = [Process::Sensor, Process::Simulator, Process::Motor];
/// Maximum number of utterances in one frame.
const SENTENCES: usize = Utterances::ROW.capacity.entries(0, 0);

/// Polling interval for a stop request while replaying at a given speed.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Options of a replay.
#[derive(Clone, Debug)]
pub struct ReplayOptions {
    /// The domain of the processes.
    pub domain: Domain,
    /// The validated configuration of the recorded robot.
    pub settings: Leo,
    /// Its file, which the processes read themselves.
    pub config: PathBuf,
    /// Its number of joints.
    pub joints: usize,
    /// Multiple of real time; `None` for as fast as possible.
    pub speed: Option<f64>,
    /// Start of the comparison. Earlier frames are played too, because beliefs have a history, but are neither
    /// compared nor reported.
    pub from: Duration,
    /// End of the replay.
    pub to: Option<Duration>,
    /// Where to record the replayed and the produced frames.
    pub record: Option<Record>,
}

/// Result of a replay.
#[derive(Clone, Debug, Default)]
pub struct ReplayReport {
    /// Simulated time from the first to the last frame played.
    pub lasted: Duration,
    /// Counts per topic that the processes produced.
    pub paired: BTreeMap<TopicId, FrameCounts>,
    /// The first difference; the replay stops there.
    pub wrong: Option<Mismatch>,
    /// Reason why nothing was compared.
    pub incomparable: Option<&'static str>,
}

/// Frame counts of one topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// Recorded frames that were reproduced bit by bit.
    pub equal: u64,
    /// Produced frames that were not compared.
    pub uncompared: u64,
}

/// A produced frame that differs from the recorded one.
#[derive(Clone, Debug)]
pub struct Mismatch {
    /// The channel.
    pub channel: Channel,
    /// The sequence number of the frame.
    pub sequence: u64,
    /// The frame's time stamp, relative to the start of the recording.
    pub at: Duration,
    /// The first field that differs.
    pub difference: Difference,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { channel, sequence, at, difference } = self;
        write!(out, "{channel}, frame {sequence}, at {:.3} s: {difference}", at.as_secs_f64())
    }
}

/// Replays a recording in lockstep time, and compares the output of the belief process and the learner with the
/// recorded output. The comparison requires a recording in lockstep time. `tell` receives every utterance and event
/// in the order of their time stamps, and returns whether they are still read. A replay that is neither read nor
/// recorded ends.
///
/// # Errors
///
/// The recording cannot be read to its end, a process died or timed out, or the processes could not be run.
pub fn replay<R: Read>(
    replaying: &ReplayOptions,
    reader: &mut Reader<R>,
    tell: impl FnMut(&Frame) -> bool,
) -> Result<ReplayReport, LockstepError> {
    let partners = reader.about().map_or(replaying.settings.belief.partners, |about| about.partners);
    let play = || play(replaying, reader, partners, tell);
    in_domain(&replaying.domain, &replaying.settings, partners, play)
}

fn play<R: Read>(
    replaying: &ReplayOptions,
    reader: &mut Reader<R>,
    partners: u32,
    tell: impl FnMut(&Frame) -> bool,
) -> Result<ReplayReport, LockstepError> {
    let settings = &replaying.settings;
    let (node, mut conductor, mut lockstep_processes) =
        LockstepProcesses::open(&replaying.domain, settings, &PROCESSES, &REPLAYED_PROCESSES)?;
    let ports = ReplayPorts::open(&node, replaying, settings.belief.perspectives(partners))?;
    let tape = replaying.record.as_ref().map(RecordingFile::begin).transpose()?;
    let launch =
        Launch { config: Some(replaying.config.clone()), partners: Some(partners), ..Launch::default() };
    lockstep_processes.start_all(&node, &PROCESSES, launch)?;
    let mut performance = ReplayRun {
        conductor: &mut conductor,
        lockstep_processes: &mut lockstep_processes,
        ports,
        replaying,
        tell,
        is_unwatched: false,
        played: ReplayReport { incomparable: incomparable(reader), ..ReplayReport::default() },
        began_ns: None,
        paced_from: None,
        tape,
    };
    let outcome = performance.play(reader);
    let ReplayRun { played, tape, .. } = performance;
    lockstep_processes.stop_all(&mut conductor);
    outcome?;
    if let Some(tape) = tape {
        tape.finish()?;
    }
    Ok(played)
}

/// Reason why the output of a replay may differ from the recording.
fn incomparable<R: Read>(reader: &Reader<R>) -> Option<&'static str> {
    let time = reader.about().map(|about| about.time);
    (time != Some(Time::Lockstep)).then_some(
        "it was recorded from a robot in the machine's time: such a recording begins at any moment, and the order of \
         its frames is not reproducible",
    )
}

/// Publishers that stand in for sensor, simulator and motor, and subscribers to the processes' output.
struct ReplayPorts {
    percepts: FramePublisher<Percepts>,
    utterances: FramePublisher<Utterances>,
    joint_states: FramePublisher<JointStates>,
    /// The newest joint states, published at the learner's next turn.
    joints: Option<Frame>,
    inlets: BufferSubscribers,
    /// Frames produced in the last turn that have not been matched with the recording.
    made: BTreeMap<TopicId, VecDeque<Frame>>,
}

impl ReplayPorts {
    fn open(node: &Node, replaying: &ReplayOptions, perspectives: u32) -> Result<Self, PortError> {
        let made = recorded_topics(perspectives).filter(|topic| is_derived(*topic));
        Ok(Self {
            percepts: node.publisher(None, replaying.settings.buffers.max_objects.get())?,
            utterances: node.publisher(None, SENTENCES)?,
            joint_states: node.publisher(None, replaying.joints)?,
            joints: None,
            inlets: BufferSubscribers::make(node, made)?,
            made: BTreeMap::new(),
        })
    }
}

/// Whether the processes of a replay compute a topic.
fn is_derived(topic: TopicId) -> bool {
    topic.row().recording == Recording::Derived
}

/// Publishes a frame as recorded, including its sequence number and incarnation.
fn send<T: Topic>(publisher: &mut FramePublisher<T>, frame: &Frame) -> Result<(), LockstepError> {
    let read = require!(frame.read::<T>(), "the reader returns complete frames only");
    let Some((head, entries)) = read else { return Ok(()) };
    if entries.len() > publisher.capacity() {
        let (channel, sequence) = (Channel(frame.topic), frame.sequence);
        let (entries, max) = (entries.len(), publisher.capacity());
        return Err(LockstepError::TooLong { channel, sequence, entries, max });
    }
    publisher.send_all(head, &entries, |sent| *sent.header_mut() = *head.header())?;
    Ok(())
}

struct ReplayRun<'a, F> {
    conductor: &'a mut Conductor,
    lockstep_processes: &'a mut LockstepProcesses,
    ports: ReplayPorts,
    replaying: &'a ReplayOptions,
    tell: F,
    /// Whether what is told can no longer be written.
    is_unwatched: bool,
    played: ReplayReport,
    began_ns: Option<u64>,
    /// Start of the paced part: clock time and simulated time.
    paced_from: Option<(Instant, Instant)>,
    tape: Option<RecordingFile>,
}

impl<F: FnMut(&Frame) -> bool> ReplayRun<'_, F> {
    fn play<R: Read>(&mut self, reader: &mut Reader<R>) -> Result<(), LockstepError> {
        for frame in reader {
            let frame = frame?;
            let at = self.since_begin(&frame);
            if self.replaying.to.is_some_and(|to| at > to) {
                break;
            }
            self.played.lasted = self.played.lasted.max(at);
            if is_derived(frame.topic) {
                self.compare(&frame);
            } else {
                self.keep(&frame)?;
            }
            if frame.topic == TopicId::Utterances {
                send(&mut self.ports.utterances, &frame)?;
                self.say(&frame);
            } else if frame.topic == TopicId::Percepts {
                self.step(&frame)?;
            } else if frame.topic == TopicId::JointStates {
                self.ports.joints = Some(frame);
            }
            if self.played.wrong.is_some() || self.has_no_user() {
                break;
            }
        }
        Ok(())
    }

    /// Whether the replay is neither watched any more nor recorded.
    fn has_no_user(&self) -> bool {
        self.is_unwatched && self.tape.is_none()
    }

    fn since_begin(&mut self, frame: &Frame) -> Duration {
        let began_ns = *self.began_ns.get_or_insert(frame.at_ns);
        Duration::from_nanos(frame.at_ns.saturating_sub(began_ns))
    }

    fn counts(&mut self, frame: &Frame) -> bool {
        self.since_begin(frame) >= self.replaying.from
    }

    fn keep(&mut self, frame: &Frame) -> Result<(), RecordError> {
        self.tape.as_mut().map_or(Ok(()), |tape| tape.write(frame))
    }

    fn say(&mut self, frame: &Frame) {
        if self.counts(frame) {
            self.is_unwatched |= !(self.tell)(frame);
        }
    }

    /// Gives the belief process and the learner a turn for a percept frame.
    fn step(&mut self, frame: &Frame) -> Result<(), LockstepError> {
        self.check_all_matched();
        if self.played.wrong.is_some() {
            return Ok(());
        }
        // The instant of the turn in which it was published.
        let now = Instant::from_nanos(frame.header().hop_time(Hop::Perceived).unwrap_or(frame.at_ns));
        self.wait_until_due(frame, now)?;
        if let Some(joints) = self.ports.joints.take() {
            send(&mut self.ports.joint_states, &joints)?;
        }
        send(&mut self.ports.percepts, frame)?;
        for process in [Process::Belief, Process::Learner] {
            self.conductor.step(process, now, self.lockstep_processes)?;
            let mut made = Vec::new();
            self.ports.inlets.take(|frame| made.push(frame))?;
            for frame in made {
                self.keep(&frame)?;
                if frame.topic == TopicId::Events {
                    self.say(&frame);
                }
                if self.played.incomparable.is_some() || !self.counts(&frame) {
                    self.played.paired.entry(frame.topic).or_default().uncompared += 1;
                }
                if self.played.incomparable.is_none() {
                    self.ports.made.entry(frame.topic).or_default().push_back(frame);
                }
            }
        }
        Ok(())
    }

    /// All frames produced for the previous percepts must have appeared in the recording by now.
    fn check_all_matched(&mut self) {
        let more = self.ports.made.values_mut().find_map(VecDeque::pop_front);
        if let Some(frame) = more {
            self.report_mismatch(&frame, Difference::missing_frame(false));
        }
    }

    /// Compares a recorded frame with the produced one.
    fn compare(&mut self, recorded: &Frame) {
        if self.played.incomparable.is_some() {
            return;
        }
        let made = self.ports.made.get_mut(&recorded.topic).and_then(VecDeque::pop_front);
        if !self.counts(recorded) {
            return;
        }
        let difference = match made {
            None => Some(Difference::missing_frame(true)),
            Some(made) => Difference::between(recorded, &made),
        };
        match difference {
            None => self.played.paired.entry(recorded.topic).or_default().equal += 1,
            Some(difference) => self.report_mismatch(recorded, difference),
        }
    }

    fn report_mismatch(&mut self, frame: &Frame, difference: Difference) {
        if !self.counts(frame) {
            return;
        }
        let at = self.since_begin(frame);
        let (channel, sequence) = (Channel(frame.topic), frame.sequence);
        self.played.wrong.get_or_insert(Mismatch { channel, sequence, at, difference });
    }

    /// Waits until a turn is due, if a replay speed is given.
    fn wait_until_due(&mut self, frame: &Frame, now: Instant) -> Result<(), LockstepError> {
        let mut until = Instant::EPOCH;
        if let Some(speed) = self.replaying.speed
            && self.counts(frame)
        {
            let (began, simulated) = *self.paced_from.get_or_insert_with(|| (clock::now(), now));
            // A delay beyond the range of `Duration` is skipped.
            let after = Duration::try_from_secs_f64(now.since(simulated).as_secs_f64() / speed);
            until = began + after.unwrap_or_default();
        }
        loop {
            if self.lockstep_processes.interrupted() {
                return Err(TurnError::Interrupted.into());
            }
            if clock::now() >= until {
                return Ok(());
            }
            clock::sleep_until(until.min(clock::now() + POLL_INTERVAL));
        }
    }
}
