//! `leo replay`: what a recording says was perceived, said and felt, through the real belief and learner
//! processes once more; and what they make of it beside what they made of it then.

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

/// Who makes anything of what is replayed, readers before their writers.
const PROCESSES: [Process; 2] = [Process::Learner, Process::Belief];
/// What the player publishes in the place of, as it was recorded.
const STAGE: [Process; 3] = [Process::Sensor, Process::Simulator, Process::Motor];
/// Sentences that one frame holds at most.
const SENTENCES: usize = 16;

/// Where time is kept, it is looked this often whether the user wants to stop.
const SLICE: Duration = Duration::from_millis(50);

/// What to replay, and how.
#[derive(Clone, Debug)]
pub struct Replaying {
    /// The domain of its own that the processes run in.
    pub domain: Domain,
    /// The configuration that the recording was made with, checked.
    pub settings: Leo,
    /// Its file, as the processes read it themselves.
    pub config: PathBuf,
    /// How many joints it has.
    pub joints: usize,
    /// Multiple of real time; as fast as the machine can, without.
    pub speed: Option<f64>,
    /// What comes before is played too, because beliefs have a past, and is neither compared nor told.
    pub from: Duration,
    /// What comes after is not played.
    pub to: Option<Duration>,
    /// Where all that is played, and what the processes make of it, is recorded, if it is.
    pub record: Option<Record>,
}

/// What came of it.
#[derive(Clone, Debug, Default)]
pub struct Played {
    /// Simulated time, from the first frame played to the last.
    pub lasted: Duration,
    /// Of each buffer that the processes made.
    pub paired: BTreeMap<Buffer, Paired>,
    /// What differs first; the replay ends there.
    pub wrong: Option<Wrong>,
    /// Why nothing was compared, if nothing was.
    pub incomparable: Option<&'static str>,
}

/// Frames of one buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Paired {
    /// In the recording, and replayed the same bit by bit.
    pub equal: u64,
    /// Replayed, and not compared.
    pub uncompared: u64,
}

/// A frame that was replayed otherwise than it was recorded.
#[derive(Clone, Debug)]
pub struct Wrong {
    /// The buffer.
    pub buffer: Buffer,
    /// The number of the frame.
    pub sequence: u64,
    /// The instant that it speaks about, from the beginning of the recording.
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

/// Why a replay came to nothing.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The processes could not run at all.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The processes are not all there, or one died or hangs.
    #[error(transparent)]
    Class(#[from] ClassError),
    /// The recording cannot be read on.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// What is played cannot be recorded.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A frame could not be sent to the processes.
    #[error(transparent)]
    Send(#[from] SendError),
    /// Nothing could be received from them.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// A frame has more entries than the configuration lets a buffer hold.
    #[error("frame {sequence} of `{buffer}` has {entries} entries, and its configuration allows {most}")]
    TooLong {
        /// The buffer.
        buffer: Buffer,
        /// The number of the frame.
        sequence: u64,
        /// How many it has.
        entries: usize,
        /// How many it may have.
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

/// Replays a recording in lockstep time, and compares what the belief process and the learner make of it
/// with what they made of it when it was recorded, as far as that was in lockstep time too. `tell` is
/// given every utterance and every event, in the order of the instants.
///
/// # Errors
///
/// The recording cannot be read to its end, a process died or hangs, or they could not run at all.
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

/// Why what comes of a replay need not be what came of it then.
fn incomparable<R: Read>(reader: &Reader<R>) -> Option<&'static str> {
    let time = reader.about().map(|about| about.time);
    (time != Some(Time::Lockstep)).then_some(
        "it was recorded of a robot in the machine's time, which begins in the middle and in which frames wait \
         for one another differently every time",
    )
}

/// What stands in for sensor, simulator and motor, and what the processes make of it.
struct Stage {
    percepts: Outlet<Percepts>,
    utterances: Outlet<Utterances>,
    joint_states: Outlet<JointStates>,
    /// The newest one counts: it is sent when the learner has its turn.
    joints: Option<Frame>,
    inlets: Inlets,
    /// Made in the last turn, and not yet found in the recording.
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

/// Sends a frame as it was recorded, its number and its life included.
fn send<T>(outlet: &mut Outlet<T>, frame: &Frame) -> Result<(), ReplayError>
where
    T: Topic<Head: Bytes, Entry: Bytes>,
{
    // The reader gives whole frames only.
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
    /// The instant of the clock, and the simulated one, from which on time is kept.
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

    /// Gives the belief process and the learner their turns on a frame of the percept buffer.
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

    /// What was made of the percepts before the next ones has to be in the recording by now.
    fn expect_nothing_more(&mut self) {
        let more = self.stage.made.values_mut().find_map(VecDeque::pop_front);
        if let Some(frame) = more {
            self.blame(&frame, Difference::of_presence(false));
        }
    }

    /// Compares a recorded frame with the one that was made.
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

    /// Waits until it is time for a turn, where time is kept.
    fn keep_time(&mut self, frame: &Frame, now: Instant) -> Result<(), ReplayError> {
        let mut until = Instant::EPOCH;
        if let Some(speed) = self.replaying.speed
            && self.counts(frame)
        {
            let (began, simulated) = *self.paced_from.get_or_insert_with(|| (clock::now(), now));
            // What is too long to be told is no time to wait for.
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
