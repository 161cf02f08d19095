//! The processes of a robot in lockstep time.

use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;
use std::process::ExitStatus;
use std::time::Duration;

use config::leo::{Leo, Supervisor};
use message::{Health, Process, ProcessState};
use process::Launch;
use realtime::IdleStateGuard;
use recording::{Channel, ReadError, RecordError};
use transport::janitor::{Janitor, claim, sweep_stale};
use transport::{CurrentBoard, Domain, Node, PortError, ReceiveError, SendError};

use crate::io::check::check_shared_memory;
use crate::io::conductor::{Conductor, ProcessMonitor, TurnError};
use crate::io::run::RunError;
use crate::io::signals::{Received, Signals};
use crate::{Children, RosterPublisher};

/// Polling interval while processes start or stop.
const READY_POLL_INTERVAL: Duration = Duration::from_millis(2);

/// Error of a lesson or a replay in lockstep time.
#[derive(Debug, thiserror::Error)]
pub enum LockstepError {
    /// The robot could not be run.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A port could not be opened.
    #[error(transparent)]
    Port(#[from] PortError),
    /// A process could not be started.
    #[error("cannot start the process `{process}`: {source}")]
    Start {
        /// The process.
        process: Process,
        /// The operating system's error.
        source: io::Error,
    },
    /// A process ended, or was not ready in time.
    #[error("the process `{process}` did not become ready: {how}")]
    NotReady {
        /// The process.
        process: Process,
        /// Exit status or timeout.
        how: String,
    },
    /// A process died, or its turn timed out.
    #[error(transparent)]
    Turn(#[from] TurnError),
    /// A frame could not be sent to the processes.
    #[error(transparent)]
    Send(#[from] SendError),
    /// Receiving from the processes failed.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// The recording to replay cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The frames cannot be recorded.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A frame has more entries than the configuration allows.
    #[error("frame {sequence} of `{channel}` has {entries} entries, and its configuration allows {max}")]
    TooLong {
        /// The channel.
        channel: Channel,
        /// The sequence number of the frame.
        sequence: u64,
        /// Its number of entries.
        entries: usize,
        /// The maximum number of entries.
        max: usize,
    },
    /// Leo did not finish the requested performances of a lesson.
    #[error("Leo has not finished performing {} s after the lesson's script was over", .0.as_secs())]
    Unfinished(Duration),
}

/// Plays in a new domain, whose shared memory is removed in any case.
pub(crate) fn in_domain<T>(
    domain: &Domain,
    settings: &Leo,
    partners: u32,
    play: impl FnOnce() -> Result<T, LockstepError>,
) -> Result<T, LockstepError> {
    sweep_stale();
    check_shared_memory(settings, partners, true).map_err(RunError::NoRoom)?;
    let claim = claim(domain).map_err(RunError::from)?;
    let outcome = domain.make().map_err(|error| RunError::from(error).into()).and_then(|()| play());
    Janitor::new(domain).wipe(claim);
    outcome
}

/// The processes of a robot in lockstep time. Dropping it kills those that still run.
pub(crate) struct LockstepProcesses {
    children: Children,
    signals: Signals,
    domain: PathBuf,
    settings: Supervisor,
    ended: BTreeMap<Process, ExitStatus>,
    interrupted: bool,
    /// Keeps cores out of idle states, because each turn wakes a process. Without the permission, a run only
    /// takes longer.
    _awake: Option<io::Result<IdleStateGuard>>,
}

impl LockstepProcesses {
    /// Joins a domain and publishes the processes on its roster, with those for which this process stands in. Keeps the
    /// cores awake if the settings say so.
    pub(crate) fn open(
        domain: &Domain,
        settings: &Leo,
        processes: &[Process],
        replaced: &[Process],
    ) -> Result<(Node, Conductor, Self), LockstepError> {
        let awake = settings.supervisor.keep_cores_awake.then(IdleStateGuard::ask);
        let signals = Signals::watch().map_err(RunError::Signals)?;
        let children = Children::new().map_err(RunError::Executable)?;
        let queues = process::queues(&settings.buffers, true);
        let mut node = Node::join(domain, Process::Supervisor.name(), 1, queues).map_err(RunError::from)?;
        let mut roster = RosterPublisher::publish_members(&node, processes)?;
        replaced.iter().for_each(|process| roster.register_self(&node, *process));
        node.follow_roster()?;
        let conductor = Conductor::open(&node, processes, settings.supervisor.step_timeout_ms.duration())?;
        let all = Self {
            children: children.with_roster(roster),
            signals,
            domain: domain.root().to_owned(),
            settings: settings.supervisor.clone(),
            ended: BTreeMap::new(),
            interrupted: false,
            _awake: awake,
        };
        Ok((node, conductor, all))
    }

    /// Starts the processes in this order, and waits until all are ready.
    pub(crate) fn start_all(
        &mut self,
        node: &Node,
        processes: &[Process],
        launch: Launch,
    ) -> Result<(), LockstepError> {
        let launch = Launch {
            domain: self.domain.clone(),
            incarnation: 1,
            parent: i32::try_from(std::process::id()).ok(),
            lockstep: true,
            ..launch
        };
        for &process in processes {
            let started = self.children.start(process, &launch);
            started.map_err(|source| LockstepError::Start { process, source })?;
        }
        let within = self.settings.ready_timeout_ms.duration();
        processes.iter().try_for_each(|process| self.await_ready(node, *process, within))
    }

    fn await_ready(&mut self, node: &Node, process: Process, within: Duration) -> Result<(), LockstepError> {
        let give_up = clock::now() + within;
        let mut board = CurrentBoard::<Health>::default();
        loop {
            let health = board.read(node, process, 1);
            if health.and_then(|health| health.state()) == Some(ProcessState::Running) {
                return Ok(());
            }
            if let Some(how) = self.ended(process) {
                return Err(LockstepError::NotReady { process, how });
            }
            if self.interrupted() {
                return Err(TurnError::Interrupted.into());
            }
            if clock::now() >= give_up {
                let how = format!("no heartbeat for {} s", within.as_secs());
                return Err(LockstepError::NotReady { process, how });
            }
            self.children.wait(self.signals.as_fd(), READY_POLL_INTERVAL);
        }
    }

    /// Stops all processes and waits until they have exited. Those that exceed the timeout are killed when this is
    /// dropped.
    pub(crate) fn stop_all(&mut self, conductor: &mut Conductor) {
        conductor.stop_all();
        let give_up = clock::now() + self.settings.stop_timeout_ms.duration();
        while !self.children.is_empty() && clock::now() < give_up {
            self.ended.extend(self.children.reap());
            self.children.wait(self.signals.as_fd(), READY_POLL_INTERVAL);
        }
    }
}

impl ProcessMonitor for LockstepProcesses {
    fn ended(&mut self, process: Process) -> Option<String> {
        self.ended.extend(self.children.reap());
        self.ended.get(&process).map(ToString::to_string)
    }

    fn interrupted(&mut self) -> bool {
        self.interrupted |= self.signals.receive() != Received::default();
        self.interrupted
    }
}
