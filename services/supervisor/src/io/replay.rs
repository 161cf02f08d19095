//! `leo replay`: feeds a recording's percepts, utterances and joint states to the real belief and learner processes,
//! and compares their output with the recorded output.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::io::Read;
use std::path::PathBuf;
use std::time::Duration;

use clock::Instant;
use config::leo::Leo;
use message::{Bytes, Head as _, Hop, JointStates, Percepts, Process, Topic, Utterances};
use process::Launch;
use recording::{Buffer, Difference, Frame, Inlets, ReadError, Reader, RecordError, Time};
use transport::janitor::{Janitor, claim, sweep_stale};
use transport::{Domain, Node, Outlet, PortError, ReceiveError, SendError};

use crate::Lives;
use crate::io::check::room;
use crate::io::class::{Class, ClassError};
use crate::io::conductor::{Conductor, TurnError, Watch as _};
use crate::io::run::RunError;
use crate::io::tape::{Record, Tape};

/// The processes that consume what is replayed; readers before their writers.
const PROCESSES: [Process; 2] = [Process::Learner, Process::Belief];
/// The processes whose recorded output the player publishes in their place.
const STAGE: [Process; 3] = [Process::Sensor, Process::Simulator, Process::Motor];
/// Maximum number of utterances in one frame.
const SENTENCES: usize = 16;

/// Polling interval for a stop request while replaying at a given speed.
const SLICE: Duration = Duration::from_millis(50);

/// Options of a replay.
#[derive(Clone, Debug)]
pub struct Replaying {
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
pub struct Played {
    /// Simulated time from the first to the last frame played.
    pub lasted: Duration,
    /// Counts per buffer that the processes produced.
    pub paired: BTreeMap<Buffer, Paired>,
    /// The first difference; the replay stops there.
    pub wrong: Option<Wrong>,
    /// Reason why nothing was compared.
    pub incomparable: Option<&'static str>,
}

/// Frame counts of one buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Paired {
    /// Recorded frames that were reproduced bit by bit.
    pub equal: u64,
    /// Produced frames that were not compared.
    pub uncompared: u64,
}

/// A produced frame that differs from the recorded one.
#[derive(Clone, Debug)]
pub struct Wrong {
    /// The buffer.
    pub buffer: Buffer,
    /// The sequence number of the frame.
    pub sequence: u64,
    /// The frame's time stamp, relative to the start of the recording.
    pub at: Duration,
    /// The first field that differs.
    pub difference: Difference,
}

impl fmt::Display for Wrong {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { buffer, sequence, at, difference } = self;
        write!(out, "{buffer}, frame {sequence}, at {:.3} s: {difference}", at.as_secs_f64())
    }
}

/// Error of a replay.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The processes could not be run.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The processes did not all start, or one died or timed out.
    #[error(transparent)]
    Class(#[from] ClassError),
    /// The recording cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The replay cannot be recorded.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A frame could not be sent to the processes.
    #[error(transparent)]
    Send(#[from] SendError),
    /// Receiving from the processes failed.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// A frame has more entries than the configuration allows.
    #[error("frame {sequence} of `{buffer}` has {entries} entries, and its configuration allows {most}")]
    TooLong {
        /// The buffer.
        buffer: Buffer,
        /// The sequence number of the frame.
        sequence: u64,
        /// Its number of entries.
        entries: usize,
        /// The maximum number of entries.
        most: usize,
    },
}

impl From<TurnError> for ReplayError {
    fn from(error: TurnError) -> Self {
        Self::Class(error.into())
    }
}

impl From<PortError> for ReplayError {
    fn from(error: PortError) -> Self {
        Self::Run(error.into())
    }
}

/// Replays a recording in lockstep time, and compares the output of the belief process and the learner with the
/// recorded output. The comparison requires a recording in lockstep time. `tell` receives every utterance and event
/// in the order of their time stamps.
///
/// # Errors
///
/// The recording cannot be read to its end, a process died or timed out, or the processes could not be run.
pub fn replay<R: Read>(
    replaying: &Replaying,
    reader: &mut Reader<R>,
    tell: impl FnMut(&Frame),
) -> Result<Played, ReplayError> {
    sweep_stale();
    let partners = reader.about().map_or(replaying.settings.belief.partners, |about| about.partners);
    room(&replaying.settings, partners, true).map_err(RunError::NoRoom)?;
    let claim = claim(&replaying.domain).map_err(RunError::from)?;
    let made = replaying.domain.make().map_err(|error| ReplayError::from(RunError::from(error)));
    let outcome = made.and_then(|()| play(replaying, reader, partners, tell));
    Janitor::new(&replaying.domain).wipe(claim);
    outcome
}

fn play<R: Read>(
    replaying: &Replaying,
    reader: &mut Reader<R>,
    partners: u32,
    tell: impl FnMut(&Frame),
) -> Result<Played, ReplayError> {
    let settings = &replaying.settings;
    let class = Class::new(settings)?;
    let queues = process::queues(&settings.buffers, true);
    let mut node =
        Node::join(&replaying.domain, Process::Supervisor.name(), 1, queues).map_err(RunError::from)?;
    let mut lives = Lives::put_up(&node, &PROCESSES)?;
    for process in STAGE {
        lives.stand_in(&node, process);
    }
    let mut class = class.with_lives(lives);
    node.follow_roster()?;
    let turn_within = settings.supervisor.turn_within_ms.duration();
    let mut conductor = Conductor::open(&node, &PROCESSES, turn_within)?;
    let stage = Stage::open(&node, replaying, settings.belief.perspectives(partners))?;
    let tape = replaying.record.as_ref().map(Tape::begin).transpose()?;
    let launch = Launch {
        domain: replaying.domain.root().to_owned(),
        incarnation: 1,
        parent: i32::try_from(std::process::id()).ok(),
        config: Some(replaying.config.clone()),
        kept: None,
        lesson: None,
        synthetic: None,
        partners: Some(partners),
        stay: false,
        lockstep: true,
        state: None,
        campaign: None,
    };
    class.gather(&node, &PROCESSES, &launch, settings.supervisor.ready_within_ms.duration())?;
    let mut performance = Performance {
        conductor: &mut conductor,
        class: &mut class,
        stage,
        replaying,
        tell,
        played: Played { incomparable: incomparable(reader), ..Played::default() },
        began_ns: None,
        paced_from: None,
        tape,
    };
    let outcome = performance.play(reader);
    let Performance { played, tape, .. } = performance;
    conductor.dismiss();
    class.see_off(settings.supervisor.stop_within_ms.duration());
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
        "it was recorded of a robot in the machine's time, which begins in the middle and in which frames wait \
         for one another differently every time",
    )
}

/// Publishers that stand in for sensor, simulator and motor, and subscribers to the processes' output.
struct Stage {
    percepts: Outlet<Percepts>,
    utterances: Outlet<Utterances>,
    joint_states: Outlet<JointStates>,
    /// The newest joint states, published at the learner's next turn.
    joints: Option<Frame>,
    inlets: Inlets,
    /// Frames produced in the last turn that have not been matched with the recording.
    made: BTreeMap<Buffer, VecDeque<Frame>>,
}

impl Stage {
    fn open(node: &Node, replaying: &Replaying, perspectives: u32) -> Result<Self, PortError> {
        let made = Buffer::all(perspectives).filter(|buffer| buffer.is_made_of_others());
        Ok(Self {
            percepts: node.outlet(None, replaying.settings.buffers.objects.get())?,
            utterances: node.outlet(None, SENTENCES)?,
            joint_states: node.outlet(None, replaying.joints)?,
            joints: None,
            inlets: Inlets::make(node, made)?,
            made: BTreeMap::new(),
        })
    }
}

/// Publishes a frame as recorded, including its sequence number and incarnation.
fn send<T>(outlet: &mut Outlet<T>, frame: &Frame) -> Result<(), ReplayError>
where
    T: Topic<Head: Bytes, Entry: Bytes>,
{
    // The reader returns complete frames only.
    let Some((head, entries)) = frame.read::<T>() else { return Ok(()) };
    if entries.len() > outlet.capacity() {
        let Frame { buffer, sequence, .. } = *frame;
        let (entries, most) = (entries.len(), outlet.capacity());
        return Err(ReplayError::TooLong { buffer, sequence, entries, most });
    }
    outlet.send_all(head, &entries, |sent| *sent.header_mut() = *head.header())?;
    Ok(())
}

struct Performance<'a, F> {
    conductor: &'a mut Conductor,
    class: &'a mut Class,
    stage: Stage,
    replaying: &'a Replaying,
    tell: F,
    played: Played,
    began_ns: Option<u64>,
    /// Start of the paced part: clock time and simulated time.
    paced_from: Option<(Instant, Instant)>,
    tape: Option<Tape>,
}

impl<F: FnMut(&Frame)> Performance<'_, F> {
    fn play<R: Read>(&mut self, reader: &mut Reader<R>) -> Result<(), ReplayError> {
        for frame in reader {
            let frame = frame?;
            let at = self.since_begin(&frame);
            if self.replaying.to.is_some_and(|to| at > to) {
                break;
            }
            self.played.lasted = self.played.lasted.max(at);
            if !frame.buffer.is_made_of_others() {
                self.keep(&frame)?;
            }
            match frame.buffer {
                Buffer::Scene => {}
                Buffer::Utterances => {
                    send(&mut self.stage.utterances, &frame)?;
                    self.say(&frame);
                }
                Buffer::JointStates => self.stage.joints = Some(frame),
                Buffer::Percepts => self.step(&frame)?,
                Buffer::Beliefs(_) | Buffer::Divergences(_) | Buffer::Events | Buffer::JointGoals => {
                    self.pair(&frame);
                }
            }
            if self.played.wrong.is_some() {
                break;
            }
        }
        Ok(())
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
            (self.tell)(frame);
        }
    }

    /// Gives the belief process and the learner a turn for a frame of the percept buffer.
    fn step(&mut self, frame: &Frame) -> Result<(), ReplayError> {
        self.expect_nothing_more();
        if self.played.wrong.is_some() {
            return Ok(());
        }
        // The instant of the turn in which it was published.
        let now = Instant::from_nanos(frame.header().passed(Hop::Perceived).unwrap_or(frame.at_ns));
        self.keep_time(frame, now)?;
        if let Some(joints) = self.stage.joints.take() {
            send(&mut self.stage.joint_states, &joints)?;
        }
        send(&mut self.stage.percepts, frame)?;
        for process in [Process::Belief, Process::Learner] {
            self.conductor.step(process, now, self.class)?;
            let mut made = Vec::new();
            self.stage.inlets.take(|frame| made.push(frame))?;
            for frame in made {
                self.keep(&frame)?;
                if frame.buffer == Buffer::Events {
                    self.say(&frame);
                }
                if self.played.incomparable.is_some() || !self.counts(&frame) {
                    self.played.paired.entry(frame.buffer).or_default().uncompared += 1;
                }
                if self.played.incomparable.is_none() {
                    self.stage.made.entry(frame.buffer).or_default().push_back(frame);
                }
            }
        }
        Ok(())
    }

    /// All frames produced for the previous percepts must have appeared in the recording by now.
    fn expect_nothing_more(&mut self) {
        let more = self.stage.made.values_mut().find_map(VecDeque::pop_front);
        if let Some(frame) = more {
            self.blame(&frame, Difference::of_presence(false));
        }
    }

    /// Compares a recorded frame with the produced one.
    fn pair(&mut self, recorded: &Frame) {
        if self.played.incomparable.is_some() {
            return;
        }
        let made = self.stage.made.get_mut(&recorded.buffer).and_then(VecDeque::pop_front);
        if !self.counts(recorded) {
            return;
        }
        let difference = match made {
            None => Some(Difference::of_presence(true)),
            Some(made) => Difference::between(recorded, &made),
        };
        match difference {
            None => self.played.paired.entry(recorded.buffer).or_default().equal += 1,
            Some(difference) => self.blame(recorded, difference),
        }
    }

    fn blame(&mut self, frame: &Frame, difference: Difference) {
        if !self.counts(frame) {
            return;
        }
        let at = self.since_begin(frame);
        let Frame { buffer, sequence, .. } = *frame;
        self.played.wrong.get_or_insert(Wrong { buffer, sequence, at, difference });
    }

    /// Waits until a turn is due, if a replay speed is given.
    fn keep_time(&mut self, frame: &Frame, now: Instant) -> Result<(), ReplayError> {
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
            if self.class.interrupted() {
                return Err(TurnError::Interrupted.into());
            }
            if clock::now() >= until {
                return Ok(());
            }
            clock::sleep_until(until.min(clock::now() + SLICE));
        }
    }
}
