use std::path::{Path, PathBuf};

use config::Robot;
use message::{Beliefs, Event, Events, Header, Hop, JointGoals, JointStates, Process, Utterance, Utterances};
use process::{Failure, Launch, Member, Progress};
use store::{OpenError, Store};
use tasks::Task;
use transport::{Frame, Inlet, Outlet};

use crate::{Input, Learner, LeoBody, Output, Settings, Vocabulary};

/// Events that one frame holds; more go into further frames.
const EVENTS: usize = 64;
/// The file, in the state directory, of what was learned.
const FILE: &str = "learned.redb";

/// Learns and performs until the process is told to stop.
///
/// # Errors
///
/// The configuration is refused, what was learned cannot be read, the domain cannot be joined, or
/// the middleware failed.
pub fn run(launch: &Launch, robot: &Robot) -> Result<(), Failure> {
    let leo = &robot.leo;
    let mut member = Member::join(launch, Process::Learner, &leo.buffers, &leo.learner.realtime)?;
    let mut beliefs = BeliefInlets::open(&member, launch.partners.unwrap_or(leo.belief.partners))?;
    let mut utterances = member.inlet::<Utterances>(None)?;
    let mut joint_states = member.inlet::<JointStates>(None)?;
    let mut events = member.outlet::<Events>(None, EVENTS)?;
    let mut goals = member.outlet::<JointGoals>(None, robot.motor.joints.len())?;
    let memory = Memory::open(launch.state.as_deref())?;
    let vocabulary = Vocabulary::of(&robot.percepts).map_err(Failure::own)?;
    let body = LeoBody::new(robot).map_err(Failure::own)?;
    let mut learner =
        Learner::new(Settings::of(&leo.learner), vocabulary, &beliefs.perspectives(), body, memory.tasks()?);
    let mut present_rad = vec![None; robot.motor.joints.len()];
    let mut said: Vec<Utterance> = Vec::new();
    member.begin(None)?;
    while member.next_call(beliefs.last())?.is_some() {
        while let Some(frame) = utterances.receive()? {
            said.extend_from_slice(frame.entries());
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
        // One step for every instant of which there are beliefs; one without any where there are
        // none, because the motor process waits for goals.
        let mut is_first = true;
        loop {
            let instant = beliefs.next_instant()?;
            if !is_first && (instant.is_none() || member.shall_stop()) {
                break;
            }
            is_first = false;
            let frames = instant.unwrap_or_default();
            let header = frames.first().map_or_else(Header::default, |frame| frame.head().header);
            let views: Vec<_> = frames.iter().map(|frame| (frame.head(), frame.entries())).collect();
            let now = member.begin_step(header.passed(Hop::Believed).unwrap_or(member.now().as_nanos()));
            let input = Input { beliefs: &views, utterances: &said, present_rad: &present_rad };
            let output = learner.step(now, &input);
            said.clear();
            publish(&member, now.as_nanos(), &header, output, &memory, &mut events, &mut goals)?;
            member.health().drops = beliefs.drops() + utterances.drops() + joint_states.drops();
            member.health().undelivered = events.undelivered() + goals.undelivered();
            member.end_step();
        }
        member.end_call(Progress::More)?;
    }
    Ok(())
}

/// Saves, then reports, then moves: what Leo says it learned is durable.
fn publish(
    member: &Member,
    now_ns: u64,
    header: &Header,
    output: Output,
    memory: &Memory,
    events: &mut Outlet<Events>,
    goals: &mut Outlet<JointGoals>,
) -> Result<(), Failure> {
    let Output { save, events: mut reports, goals: wanted } = output;
    for (key, task) in save {
        if let Err(complaint) = memory.save(&key, &task) {
            tracing::error!(task = task.name, "{complaint}");
            let sorry = "I learned it, but I cannot remember it beyond today";
            reports.push(Event::new(message::EventKind::Said, &task.name, sorry));
        }
    }
    for chunk in reports.chunks(EVENTS) {
        let nothing = Event::new(message::EventKind::Said, "", "");
        let event = |index| chunk.get(index).copied().unwrap_or(nothing);
        events.send(Header::at(now_ns), chunk.len(), event, |_| {})?;
    }
    if let Some(&first) = wanted.first() {
        let mut header = header.onwards();
        header.valid_at_ns = now_ns;
        let goal = |index| wanted.get(index).copied().unwrap_or(first);
        goals
            .send(header, wanted.len(), goal, |header| header.pass(Hop::Decided, member.now().as_nanos()))?;
    }
    Ok(())
}

/// The belief buffers of all perspectives, taken together: one frame of each, of one instant.
struct BeliefInlets {
    inlets: Vec<Inlet<Beliefs>>,
    waiting: Vec<Option<Frame<Beliefs>>>,
}

impl BeliefInlets {
    fn open(member: &Member, partners: u32) -> Result<Self, Failure> {
        let mut inlets = Vec::new();
        for perspective in 0..=partners {
            // The last perspective of an instant is published last: it wakes.
            let inlet = if perspective == partners {
                member.waking_inlet(Some(perspective))?
            } else {
                member.inlet(Some(perspective))?
            };
            inlets.push(inlet);
        }
        let waiting = inlets.iter().map(|_| None).collect();
        Ok(Self { inlets, waiting })
    }

    fn perspectives(&self) -> Vec<u16> {
        (0..).take(self.inlets.len()).collect()
    }

    fn last(&mut self) -> &mut Inlet<Beliefs> {
        let last = self.inlets.len() - 1;
        #[expect(clippy::indexing_slicing, reason = "the robot's own perspective is always there")]
        &mut self.inlets[last]
    }

    /// The next instant of which every perspective's frame is there. Frames whose counterpart was
    /// dropped are passed over.
    fn next_instant(&mut self) -> Result<Option<Vec<Frame<Beliefs>>>, Failure> {
        loop {
            for (slot, inlet) in self.waiting.iter_mut().zip(&mut self.inlets) {
                if slot.is_none() {
                    *slot = inlet.receive()?;
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
        self.inlets.iter().map(Inlet::drops).sum()
    }
}

/// The file in a state directory that holds what Leo has learned.
#[must_use]
pub fn memory_file(state: &Path) -> PathBuf {
    state.join(FILE)
}

/// Whether what is remembered in a state directory can be read, and more be remembered there; the
/// directory is made where there is none. Another robot that has it open is no obstacle.
///
/// # Errors
///
/// It cannot be read or written; nothing of it was changed.
pub fn check_memory(state: &Path) -> Result<(), Failure> {
    match Store::open(&memory_file(state)) {
        Ok(store) => Memory(Some(store)).tasks().map(drop),
        Err(OpenError::InUse { .. }) => Ok(()),
        Err(error) => Err(Failure::own(error)),
    }
}

/// What is remembered beyond the life of the process, if anything.
struct Memory(Option<Store>);

impl Memory {
    fn open(folder: Option<&Path>) -> Result<Self, Failure> {
        let Some(folder) = folder else { return Ok(Self(None)) };
        match Store::open(&memory_file(folder)) {
            Ok(store) => Ok(Self(Some(store))),
            Err(busy @ OpenError::InUse { .. }) => {
                tracing::warn!("{busy}: this robot begins knowing nothing, and forgets when it ends");
                Ok(Self(None))
            }
            Err(error) => Err(Failure::own(error)),
        }
    }

    fn tasks(&self) -> Result<Vec<Task>, Failure> {
        let Some(store) = &self.0 else { return Ok(Vec::new()) };
        let entries = store.load::<Task>().map_err(Failure::own)?;
        Ok(entries.into_iter().map(|(_, task)| task).collect())
    }

    fn save(&self, key: &str, task: &Task) -> Result<(), store::WriteError> {
        self.0.as_ref().map_or(Ok(()), |store| store.save(key, task))
    }
}
