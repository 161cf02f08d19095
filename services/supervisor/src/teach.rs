//! `leo teach`: a lesson through the real processes in lockstep time.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::ExitStatus;
use std::time::Duration;

use account::Account;
use clock::Instant;
use config::leo::Leo;
use message::{Events, Process, ProcessState};
use process::Launch;
use transport::janitor::{Janitor, claim, sweep_stale};
use transport::{Domain, HealthReader, Inlet, Node, PortError, ReceiveError};

use crate::Children;
use crate::check::room;
use crate::conductor::{Conductor, Timetable, TurnError, Watch};
use crate::run::{ORDER, RunError, watch_signals};

/// A robot that has not finished performing this long after the lesson's script is over, in
/// simulated time, never will.
const PATIENCE: Duration = Duration::from_secs(300);
/// What was said last is heard, thought about and answered within this time.
const ANSWER: Duration = Duration::from_secs(1);
/// How often a starting process is looked at.
const LOOK: Duration = Duration::from_millis(2);

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
}

/// Why a lesson came to nothing.
#[derive(Debug, thiserror::Error)]
pub enum TeachError {
    /// The robot could not run at all.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A process could not be started.
    #[error("cannot start the process `{process}`: {source}")]
    Start {
        /// The process.
        process: Process,
        /// What the system said.
        source: std::io::Error,
    },
    /// A process ended, or was not ready in time.
    #[error("the process `{process}` did not get ready: {how}")]
    NotReady {
        /// The process.
        process: Process,
        /// What became of it.
        how: String,
    },
    /// A process died or hangs.
    #[error(transparent)]
    Turn(#[from] TurnError),
    /// Nothing could be heard from the learner.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// Leo did not do what it was told to.
    #[error("Leo has not finished performing {} s after the lesson's script was over", PATIENCE.as_secs())]
    Unfinished,
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
    room(settings, partners).map_err(RunError::NoRoom)?;
    let claim = claim(&teaching.domain).map_err(RunError::from)?;
    let outcome =
        teaching.domain.make().map_err(|error| RunError::from(error).into()).and_then(|()| play(teaching));
    Janitor::new(&teaching.domain).wipe(claim);
    outcome
}

fn play(teaching: &Teaching) -> Result<Account, TeachError> {
    let settings = &teaching.settings;
    let signals = watch_signals().map_err(RunError::Signals)?;
    let queues = process::queues(&settings.buffers, true);
    let node = Node::join(&teaching.domain, Process::Supervisor.name(), 1, queues).map_err(RunError::from)?;
    let processes: Vec<Process> = ORDER.into_iter().filter(|process| *process != Process::Console).collect();
    let mut conductor = Conductor::open(&node, &processes, settings.supervisor.turn_within_ms.duration())?;
    let mut events = node.inlet::<Events>(None)?;
    let children = Children::new().map_err(RunError::Executable)?;
    let mut class = Class { children, signals, ended: BTreeMap::new(), interrupted: false };
    for &process in &processes {
        class.start(process, teaching)?;
    }
    for &process in &processes {
        class.await_ready(&node, process, settings.supervisor.ready_within_ms.duration())?;
    }
    let account = conduct(&mut conductor, &mut class, &mut events, teaching);
    conductor.dismiss();
    class.see_off(settings.supervisor.stop_within_ms.duration());
    account
}

fn conduct(
    conductor: &mut Conductor,
    class: &mut Class,
    events: &mut Inlet<Events>,
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

/// The processes of one lesson.
struct Class {
    children: Children,
    signals: UnixStream,
    ended: BTreeMap<Process, ExitStatus>,
    interrupted: bool,
}

impl Class {
    fn start(&mut self, process: Process, teaching: &Teaching) -> Result<(), TeachError> {
        let launch = Launch {
            domain: teaching.domain.root().to_owned(),
            incarnation: 1,
            parent: i32::try_from(std::process::id()).ok(),
            config: teaching.config.clone(),
            lesson: teaching.lesson.clone(),
            synthetic: None,
            partners: teaching.partners,
            stay: false,
            lockstep: true,
            state: teaching.state.clone(),
            campaign: None,
        };
        self.children.start(process, &launch).map_err(|source| TeachError::Start { process, source })
    }

    fn await_ready(&mut self, node: &Node, process: Process, within: Duration) -> Result<(), TeachError> {
        let give_up = clock::now() + within;
        let mut board = None;
        loop {
            if board.is_none() {
                board = HealthReader::open(node, process, 1).ok();
            }
            let state = board.as_ref().and_then(|board: &HealthReader| board.read().state());
            if state == Some(ProcessState::Running) {
                return Ok(());
            }
            if let Some(how) = self.ended(process) {
                return Err(TeachError::NotReady { process, how });
            }
            if self.interrupted() {
                return Err(TurnError::Interrupted.into());
            }
            if clock::now() >= give_up {
                let how = format!("nothing heard of it for {} s", within.as_secs());
                return Err(TeachError::NotReady { process, how });
            }
            self.children.wait(self.signals.as_fd(), LOOK);
        }
    }

    /// Waits until all have ended; those that do not in time are killed as the class is dropped.
    fn see_off(&mut self, within: Duration) {
        let give_up = clock::now() + within;
        while !self.children.is_empty() && clock::now() < give_up {
            self.ended.extend(self.children.bury());
            self.children.wait(self.signals.as_fd(), LOOK);
        }
    }
}

impl Watch for Class {
    fn ended(&mut self, process: Process) -> Option<String> {
        self.ended.extend(self.children.bury());
        self.ended.get(&process).map(ToString::to_string)
    }

    fn interrupted(&mut self) -> bool {
        let mut bytes = [0; 16];
        self.interrupted |= self.signals.read(&mut bytes).is_ok_and(|count| count > 0);
        self.interrupted
    }
}
