//! `leo teach`: plays a lesson through the real processes in lockstep time.

use std::path::PathBuf;
use std::time::Duration;

use account::Account;
use clock::Instant;
use config::leo::Leo;
use message::{Events, Process};
use process::Launch;
use recording::{Buffer, Inlets, RecordError};
use transport::janitor::{Janitor, claim, sweep_stale};
use transport::{Domain, Inlet, Node, PortError, ReceiveError};

use crate::Lives;
use crate::io::check::room;
use crate::io::class::{Class, ClassError};
use crate::io::conductor::{Conductor, Timetable, TurnError};
use crate::io::run::{ORDER, RunError};
use crate::io::tape::{Record, Tape};

/// Timeout in simulated time for the last performance, counted from the end of the lesson's script.
const PATIENCE: Duration = Duration::from_secs(300);
/// Simulated time that the learner needs to answer the last utterance.
const ANSWER: Duration = Duration::from_secs(1);

/// Options of a lesson.
#[derive(Clone, Debug)]
pub struct Teaching {
    /// The robot's domain.
    pub domain: Domain,
    /// The validated configuration.
    pub settings: Leo,
    /// The configuration file, which the processes read themselves.
    pub config: Option<PathBuf>,
    /// The lesson; `None` for the built-in one.
    pub lesson: Option<PathBuf>,
    /// Number of performances in the lesson.
    pub performances: u32,
    /// Number of partners whose perspective is simulated; default: the configuration's value.
    pub partners: Option<u32>,
    /// File that stores what Leo has learned. `None`: Leo starts without memory and stores nothing.
    pub state: Option<PathBuf>,
    /// Where to record the lesson.
    pub record: Option<Record>,
}

/// Error of a lesson.
#[derive(Debug, thiserror::Error)]
pub enum TeachError {
    /// The robot could not be run.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The processes did not all start, or one died or timed out.
    #[error(transparent)]
    Class(#[from] ClassError),
    /// Receiving from the learner failed.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// The lesson cannot be recorded.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// Leo did not finish the requested performances.
    #[error("Leo has not finished performing {} s after the lesson's script was over", PATIENCE.as_secs())]
    Unfinished,
}

impl From<TurnError> for TeachError {
    fn from(error: TurnError) -> Self {
        Self::Class(error.into())
    }
}

impl From<PortError> for TeachError {
    fn from(error: PortError) -> Self {
        Self::Run(error.into())
    }
}

/// Plays one lesson to the end of the last performance, as fast as possible, and returns its account. Deterministic:
/// the same lesson always gives the same account.
///
/// # Errors
///
/// A process died or timed out (the error names it), or the robot could not be run. Shared memory is removed in any
/// case.
pub fn teach(teaching: &Teaching) -> Result<Account, TeachError> {
    sweep_stale();
    let settings = &teaching.settings;
    let partners = teaching.partners.unwrap_or(settings.belief.partners);
    room(settings, partners, true).map_err(RunError::NoRoom)?;
    let claim = claim(&teaching.domain).map_err(RunError::from)?;
    let outcome =
        teaching.domain.make().map_err(|error| RunError::from(error).into()).and_then(|()| play(teaching));
    Janitor::new(&teaching.domain).wipe(claim);
    outcome
}

fn play(teaching: &Teaching) -> Result<Account, TeachError> {
    let settings = &teaching.settings;
    let class = Class::new(settings)?;
    let queues = process::queues(&settings.buffers, true);
    let mut node =
        Node::join(&teaching.domain, Process::Supervisor.name(), 1, queues).map_err(RunError::from)?;
    let processes: Vec<Process> =
        ORDER.into_iter().filter(|process| !matches!(process, Process::Console | Process::Link)).collect();
    let mut class = class.with_lives(Lives::put_up(&node, &processes)?);
    node.follow_roster()?;
    let mut conductor = Conductor::open(&node, &processes, settings.supervisor.turn_within_ms.duration())?;
    let mut events = node.inlet::<Events>(None)?;
    let mut witness = teaching.record.as_ref().map(|record| Witness::open(&node, record)).transpose()?;
    let launch = Launch {
        domain: teaching.domain.root().to_owned(),
        incarnation: 1,
        parent: i32::try_from(std::process::id()).ok(),
        config: teaching.config.clone(),
        kept: None,
        lesson: teaching.lesson.clone(),
        synthetic: None,
        partners: teaching.partners,
        stay: false,
        lockstep: true,
        state: teaching.state.clone(),
        campaign: None,
    };
    class.gather(&node, &processes, &launch, settings.supervisor.ready_within_ms.duration())?;
    let account = conduct(&mut conductor, &mut class, &mut events, witness.as_mut(), teaching);
    conductor.dismiss();
    class.see_off(settings.supervisor.stop_within_ms.duration());
    let account = account?;
    if let Some(witness) = witness {
        witness.finish()?;
    }
    Ok(account)
}

fn conduct(
    conductor: &mut Conductor,
    class: &mut Class,
    events: &mut Inlet<Events>,
    mut witness: Option<&mut Witness>,
    teaching: &Teaching,
) -> Result<Account, TeachError> {
    let settings = &teaching.settings;
    let (sensor, motor) = (settings.sensor.rate_hz.period(), settings.motor.rate_hz.period());
    let mut timetable = Timetable::new(&[
        (Process::Simulator, settings.simulator.rate_hz.period()),
        (Process::Sensor, sensor),
        (Process::Belief, sensor),
        (Process::Learner, sensor),
        (Process::MockBus, motor),
        (Process::Motor, motor),
    ]);
    let performances = usize::try_from(teaching.performances).unwrap_or(usize::MAX);
    let mut account = Account::default();
    let mut script_over: Option<Instant> = None;
    while let Some((process, at)) = timetable.next_turn() {
        let finished = conductor.step(process, at, class)?;
        if let Some(witness) = &mut witness {
            witness.take()?;
        }
        if process == Process::Simulator && finished {
            script_over.get_or_insert(at);
        }
        while let Some(frame) = events.receive()? {
            for event in frame.entries() {
                account.note(event);
            }
        }
        if let Some(over) = script_over {
            if account.performances_ended() >= performances && at.since(over) >= ANSWER {
                break;
            }
            if at.since(over) > PATIENCE {
                return Err(TeachError::Unfinished);
            }
        }
    }
    Ok(account)
}

/// Recorder of a lesson. It drains the topics after every turn, so that the file holds the frames in the order of the
/// turns.
struct Witness {
    inlets: Inlets,
    tape: Tape,
}

impl Witness {
    fn open(node: &Node, record: &Record) -> Result<Self, RecordError> {
        let perspectives = record.subject.robot.leo.belief.perspectives(record.subject.partners);
        let tape = Tape::begin(record)?;
        Ok(Self { inlets: Inlets::make(node, Buffer::all(perspectives))?, tape })
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
