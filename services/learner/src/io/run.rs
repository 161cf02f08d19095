use std::path::{Path, PathBuf};

use clock::{Duration, Instant};
use config::Robot;
use invariant::require;
use message::{
    Beliefs, Event, EventKind, Events, Header, Hop, JointGoal, JointGoals, JointStates, Process, Topic as _,
    Utterance, Utterances,
};
use process::{Launch, ProcessError, ProcessNode, Progress, state};
use store::{OpenError, StoreState};
use tasks::Task;
use transport::{Frame, FramePublisher, FrameSubscriber};

use crate::io::persister::{Outcome, Persister};
use crate::late_joiner_replay::LateJoinerReplay;
use crate::reports::{EventQueue, Report};
use crate::{Input, Learner, LeoBody, Memory, Output, Settings, StoreChange, Vocabulary};

/// Maximum number of events in a frame; more events go into further frames.
const MAX_EVENTS_PER_FRAME: usize = Events::ROW.capacity.entries(0, 0);
/// Retry interval for examples that could not be stored.
const STORE_RETRY_INTERVAL: Duration = Duration::from_secs(5);
/// Time to wait for the lock of the store: a read-only tool holds it for less than this.
const LOCK_TIMEOUT: Duration = Duration::from_secs(3);

/// The reason why an example could not be stored.
type StorageError = Box<dyn std::error::Error + Send + Sync>;

/// Runs the learner until the process is told to stop.
///
/// # Errors
///
/// The configuration is invalid, the store cannot be read, the domain cannot be joined, or the middleware failed.
pub fn run(launch: &Launch, robot: &Robot) -> Result<(), ProcessError> {
    let leo = &robot.leo;
    let mut member = ProcessNode::join(launch, Process::Learner, &leo.buffers, &leo.learner.realtime)?;
    let mut beliefs = BeliefSubscribers::open(&member, launch.partners.unwrap_or(leo.belief.partners))?;
    let mut utterances = member.subscriber::<Utterances>(None)?;
    let mut joint_states = member.subscriber::<JointStates>(None)?;
    let mut events = member.publisher::<Events>(None, MAX_EVENTS_PER_FRAME)?;
    let mut goals = member.publisher::<JointGoals>(None, robot.motor.joints.len())?;
    let (store, known, losses) = remembered(launch.state.as_deref())?;
    let mut persister =
        Persister::start(store.into_writer(), STORE_RETRY_INTERVAL).map_err(ProcessError::own)?;
    let mut reports = EventQueue::default();
    let mut late_joiner_replay = LateJoinerReplay::default();
    let vocabulary =
        Vocabulary::of(&robot.percepts).map_err(ProcessError::own)?.with_names(&leo.belief.names);
    let body = LeoBody::new(robot).map_err(ProcessError::own)?;
    let mut learner =
        Learner::new(Settings::of(&leo.learner), vocabulary, &beliefs.perspectives(), body, known);
    let mut present_rad = vec![None; robot.motor.joints.len()];
    let mut said: Vec<(Instant, Utterance)> = Vec::new();
    member.begin(None)?;
    let losses =
        losses.iter().map(|lost| Event::new(EventKind::Said, "", &format!("My memory was damaged: {lost}")));
    reports.push(member.now().as_nanos(), 0, losses.collect());
    while member.next_call(beliefs.last())?.is_some() {
        while let Some(frame) = utterances.receive()? {
            let said_at = Instant::from_nanos(frame.head().valid_at_ns);
            said.extend(frame.entries().iter().map(|utterance| (said_at, *utterance)));
        }
        if let Some(frame) = joint_states.newest()? {
            for state in frame.entries() {
                let joint = usize::try_from(state.joint).unwrap_or(usize::MAX);
                if let (Some(position), Some(slot)) =
                    (state.present_position_rad(), present_rad.get_mut(joint))
                {
                    *slot = Some(position);
                }
            }
        }
        // One step for every instant with beliefs. Without beliefs there is one step without input, because the motor
        // process waits for goals.
        let mut is_first = true;
        loop {
            let instant = beliefs.next_instant()?;
            if !is_first && (instant.is_none() || member.is_stop_requested()) {
                break;
            }
            is_first = false;
            let frames = instant.unwrap_or_default();
            let header = frames.first().map_or_else(Header::default, |frame| frame.head().header);
            let views: Vec<_> = frames.iter().map(|frame| (frame.head(), frame.entries())).collect();
            let now = member.begin_step(header.hop_time(Hop::Believed).unwrap_or(member.now().as_nanos()));
            let input = Input { beliefs: &views, utterances: &said, present_rad: &present_rad };
            let output = learner.step(now, &input);
            said.clear();
            let Output { save, events: happened, goals: wanted } = output;
            publish_goals(&member, now.as_nanos(), &header, &wanted, &mut goals)?;
            reports.push(now.as_nanos(), save.len(), happened);
            save.into_iter().try_for_each(|change| persister.keep(change)).map_err(ProcessError::own)?;
            if member.is_lockstep() {
                // Disk latency is not part of simulated time.
                await_persisted(now.as_nanos(), &mut persister, &mut reports)?;
            }
            while let Some(outcome) = persister.kept() {
                report(now.as_nanos(), outcome, &mut reports);
            }
            // In simulated time the set of subscribers is fixed.
            if !member.is_lockstep()
                && let Some(key) = late_joiner_replay.next(now, events.has_new_subscribers(), learner.known())
            {
                reports.push(now.as_nanos(), 0, learner.recall(&key));
            }
            publish_reports(&mut reports, &mut events)?;
            member.health().drops = beliefs.drops() + utterances.drops() + joint_states.drops();
            member.health().undelivered = events.undelivered() + goals.undelivered();
            member.end_step();
        }
        member.end_call(Progress::More)?;
    }
    await_persisted(member.now().as_nanos(), &mut persister, &mut reports)?;
    publish_reports(&mut reports, &mut events)
}

/// Where examples are stored.
enum MemoryStore {
    /// Storage is disabled.
    Disabled,
    /// Another process held the lock at start-up. Writing would ignore examples that were not loaded.
    Locked(String),
    /// An open store.
    Open(PathBuf, Box<Memory>),
}

impl MemoryStore {
    fn into_writer(self) -> impl FnMut(&StoreChange) -> Result<(), StorageError> {
        let (file, mut memory, taken) = match self {
            Self::Disabled => (None, None, None),
            Self::Locked(busy) => (None, None, Some(busy)),
            Self::Open(file, memory) => (Some(file), Some(memory), None),
        };
        move |change| {
            if let Some(busy) = &taken {
                return Err(busy.as_str().into());
            }
            let Some(file) = &file else { return Ok(()) };
            // After a disk error the store must be opened again before the next write.
            let mut keep = || -> Result<(), StorageError> {
                let mut open = match memory.take() {
                    Some(open) => open,
                    None => Box::new(Memory::open(file)?),
                };
                open.change(change)?;
                memory = Some(open);
                Ok(())
            };
            keep().map_err(|error| {
                format!("{error}; it is tried again every {} s", STORE_RETRY_INTERVAL.as_secs()).into()
            })
        }
    }
}

/// Waits until every queued example is durable or has failed.
fn await_persisted(
    now_ns: u64,
    persister: &mut Persister<StorageError>,
    reports: &mut EventQueue,
) -> Result<(), ProcessError> {
    while let Some(outcome) = persister.wait().map_err(ProcessError::own)? {
        report(now_ns, outcome, reports);
    }
    Ok(())
}

/// Reports the result of storing an example.
fn report(now_ns: u64, outcome: Outcome<StorageError>, reports: &mut EventQueue) {
    let said = |change: &StoreChange, words| Event::new(EventKind::Said, change.task(), words);
    match outcome {
        Outcome::Durable(_) => reports.saved(None),
        Outcome::Pending(change, error) => {
            tracing::error!(task = change.task(), "{error}");
            let text = match &change {
                StoreChange::Example(_) => "I learned it, but I cannot remember it beyond today",
                StoreChange::Rewrite { .. } => "I changed it, but I cannot remember the change beyond today",
            };
            reports.saved(Some(said(&change, text)));
        }
        Outcome::PersistedLate(change) => {
            tracing::info!(task = change.task(), "the learned tasks are saved now");
            reports.push(now_ns, 0, vec![said(&change, "Now I can remember it beyond today")]);
        }
    }
}

/// Publishes the reports that are ready: Leo only claims to have learned what is durable.
fn publish_reports(
    reports: &mut EventQueue,
    events: &mut FramePublisher<Events>,
) -> Result<(), ProcessError> {
    while let Some(Report { at_ns, events: happened, .. }) = reports.next() {
        for chunk in happened.chunks(MAX_EVENTS_PER_FRAME) {
            let nothing = Event::new(EventKind::Said, "", "");
            let event = |index| require!(chunk.get(index), "event {index}").copied().unwrap_or(nothing);
            events.send(Header::at(at_ns), chunk.len(), event, |_| {})?;
        }
    }
    Ok(())
}

fn publish_goals(
    member: &ProcessNode,
    now_ns: u64,
    header: &Header,
    wanted: &[JointGoal],
    goals: &mut FramePublisher<JointGoals>,
) -> Result<(), ProcessError> {
    if let Some(&first) = wanted.first() {
        let mut header = header.header_for_derived();
        header.valid_at_ns = now_ns;
        let goal = |index| require!(wanted.get(index), "goal {index}").copied().unwrap_or(first);
        goals
            .send(header, wanted.len(), goal, |header| header.pass(Hop::Decided, member.now().as_nanos()))?;
    }
    Ok(())
}

/// Synchronized subscribers for the belief buffers of all perspectives: one frame of each, of the same instant.
struct BeliefSubscribers {
    inlets: Vec<FrameSubscriber<Beliefs>>,
    waiting: Vec<Option<Frame<Beliefs>>>,
}

impl BeliefSubscribers {
    fn open(member: &ProcessNode, partners: u32) -> Result<Self, ProcessError> {
        let mut inlets = Vec::new();
        for perspective in 0..=partners {
            // The last perspective of an instant is published last, so only it wakes the process.
            let subscriber = if perspective == partners {
                member.waking_subscriber(Some(perspective))?
            } else {
                member.subscriber(Some(perspective))?
            };
            inlets.push(subscriber);
        }
        let waiting = inlets.iter().map(|_| None).collect();
        Ok(Self { inlets, waiting })
    }

    fn perspectives(&self) -> Vec<u16> {
        (0..).take(self.inlets.len()).collect()
    }

    fn last(&mut self) -> &mut FrameSubscriber<Beliefs> {
        let last = self.inlets.len() - 1;
        #[expect(clippy::indexing_slicing, reason = "the robot's own perspective is always there")]
        &mut self.inlets[last]
    }

    /// The next instant with a frame of every perspective. Frames without a counterpart are skipped.
    fn next_instant(&mut self) -> Result<Option<Vec<Frame<Beliefs>>>, ProcessError> {
        loop {
            for (slot, subscriber) in self.waiting.iter_mut().zip(&mut self.inlets) {
                if slot.is_none() {
                    *slot = subscriber.receive()?;
                }
                if slot.is_none() {
                    return Ok(None);
                }
            }
            let place =
                |frame: &Frame<Beliefs>| (frame.head().header.incarnation, frame.head().header.sequence);
            let newest = self.waiting.iter().flatten().map(place).max();
            let mut is_one_instant = true;
            for slot in &mut self.waiting {
                if slot.as_ref().map(place) != newest {
                    *slot = None;
                    is_one_instant = false;
                }
            }
            if is_one_instant {
                return Ok(Some(self.waiting.iter_mut().filter_map(Option::take).collect()));
            }
        }
    }

    fn drops(&self) -> u64 {
        self.inlets.iter().map(FrameSubscriber::drops).sum()
    }
}

/// Checks whether the store in a state directory can be read and written. Creates the directory if it is missing. A
/// store that another process has open is not checked.
///
/// # Errors
///
/// The store cannot be read or written; it is unchanged.
pub fn check_memory(state: &Path) -> Result<(), ProcessError> {
    match Memory::open(&state::learned(state)) {
        Ok(mut memory) => memory.tasks().map(drop).map_err(ProcessError::own),
        Err(OpenError::InUse { .. }) => Ok(()),
        Err(error) => Err(ProcessError::own(error)),
    }
}

/// The state of the store in a state directory. Creates and repairs nothing.
///
/// # Errors
///
/// The store has another version, or cannot be read.
pub fn memory_state(state: &Path) -> Result<StoreState, ProcessError> {
    StoreState::of(&state::learned(state)).map_err(ProcessError::own)
}

/// Loads the store of a state directory. Returns where to store examples, the known tasks, and the losses to report.
fn remembered(folder: Option<&Path>) -> Result<(MemoryStore, Vec<Task>, Vec<String>), ProcessError> {
    let Some(folder) = folder else { return Ok((MemoryStore::Disabled, Vec::new(), Vec::new())) };
    let file = state::learned(folder);
    let until = clock::now() + LOCK_TIMEOUT;
    loop {
        match Memory::open(&file) {
            Ok(mut memory) => {
                let known = memory.tasks().map_err(ProcessError::own)?;
                let losses = memory.losses().to_vec();
                if !losses.is_empty()
                    && let Err(error) = memory.said()
                {
                    // The losses are reported again at the next start.
                    tracing::warn!("{error}");
                }
                return Ok((MemoryStore::Open(file, Box::new(memory)), known, losses));
            }
            Err(OpenError::InUse { .. }) if clock::now() < until => {
                clock::sleep_until(clock::now() + Duration::from_millis(20));
            }
            Err(busy @ OpenError::InUse { .. }) => {
                tracing::warn!("{busy}: this robot starts without learned tasks, and saves none");
                let why = format!("{busy}. Until its restart, this robot saves no learned tasks");
                return Ok((MemoryStore::Locked(why), Vec::new(), Vec::new()));
            }
            Err(error) => return Err(ProcessError::own(error)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Kept;

    #[test]
    fn start_waits_for_a_reader_to_release_the_lock() {
        let folder = tempfile::tempdir().unwrap();
        let looks = Memory::open(&state::learned(folder.path())).unwrap();
        let begun = std::thread::scope(|scope| {
            let begun = scope.spawn(|| remembered(Some(folder.path())).map(|(store, ..)| store));
            clock::sleep_until(clock::now() + Duration::from_millis(100));
            drop(looks);
            begun.join().unwrap()
        });
        assert!(matches!(begun, Ok(MemoryStore::Open(..))));
    }

    #[test]
    fn an_unsaved_example_is_not_reported_as_saved() {
        let folder = tempfile::tempdir().unwrap();
        let _another = Memory::open(&state::learned(folder.path())).unwrap();
        let Ok((store, known, _)) = remembered(Some(folder.path())) else { panic!("it begins all the same") };
        assert!(known.is_empty());
        let example = tasks::Example::shown(1, Vec::new());
        let kept = Kept { key: "task 1".into(), task: "task 1".into(), index: 0, example };
        let kept = StoreChange::Example(kept);
        let refused = store.into_writer()(&kept).unwrap_err();
        let file = state::learned(folder.path());
        let in_use = OpenError::InUse { path: file }.to_string();
        assert!(refused.to_string().contains(&in_use), "{refused}");
        assert!(MemoryStore::Disabled.into_writer()(&kept).is_ok(), "where nobody wants it kept");
    }
}
