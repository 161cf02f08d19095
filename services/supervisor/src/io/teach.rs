//! `leo teach`: a lesson through the real processes in lockstep time.

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

/// A robot that has not finished performing this long after the lesson's script is over, in
/// simulated time, never will.
const PATIENCE: Duration = Duration::from_secs(300);
/// What was said last is heard, thought about and answered within this time.
const ANSWER: Duration = Duration::from_secs(1);

/// What to teach, and how.
#[derive(Clone, Debug)]
pub struct Teaching {
    /// The domain of its own that the robot runs in.
    pub domain: Domain,
    /// The configuration, checked.
    pub settings: Leo,
    /// The file of the configuration, as the processes read it themselves.
    pub config: Option<PathBuf>,
    /// The lesson; the built-in one without it.
    pub lesson: Option<PathBuf>,
    /// How many times the lesson has Leo perform.
    pub performances: u32,
    /// Partners whose perspective is taken; what the configuration says, without.
    pub partners: Option<u32>,
    /// Where Leo remembers what it learned; it begins knowing nothing, and forgets, without.
    pub state: Option<PathBuf>,
    /// Where the lesson is recorded, if it is.
    pub record: Option<Record>,
}

/// Why a lesson came to nothing.
#[derive(Debug, thiserror::Error)]
pub enum TeachError {
    /// The robot could not run at all.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The processes are not all there, or one died or hangs.
    #[error(transparent)]
    Class(#[from] ClassError),
    /// Nothing could be heard from the learner.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// The lesson cannot be recorded.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// Leo did not do what it was told to.
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

/// Plays one lesson from the beginning to the end of the last performance, as fast as the machine
/// can, and gives the account of it: the same for the same lesson, every time.
///
/// # Errors
///
/// A process died or hangs (the error names it), or the robot could not run at all. Nothing is
/// left behind.
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

/// The recording of a lesson: after every turn what it brought, so that the file holds the frames in
/// the order of the turns.
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
