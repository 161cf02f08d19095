//! The processes of a robot in lockstep time.

use std::collections::BTreeMap;
use std::io;
use std::process::ExitStatus;
use std::time::Duration;

use config::leo::Leo;
use message::{Process, ProcessState};
use process::Launch;
use realtime::IdleStateGuard;
use transport::{HealthReader, Node};

use crate::io::conductor::{ProcessMonitor, TurnError};
use crate::io::run::RunError;
use crate::io::signals::{Received, Signals};
use crate::{Children, RosterPublisher};

/// Polling interval while processes start or stop.
const READY_POLL_INTERVAL: Duration = Duration::from_millis(2);

/// Reason why the processes do not all run.
#[derive(Debug, thiserror::Error)]
pub enum LockstepError {
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
}

/// The processes of a robot in lockstep time. Dropping it kills those that still run.
pub(crate) struct LockstepProcesses {
    children: Children,
    signals: Signals,
    ended: BTreeMap<Process, ExitStatus>,
    interrupted: bool,
    /// Keeps cores out of idle states, because each turn wakes a process. Without the permission, a run only
    /// takes longer.
    _awake: Option<io::Result<IdleStateGuard>>,
}

impl LockstepProcesses {
    /// A set without processes. Keeps the cores awake if the settings say so.
    pub(crate) fn new(settings: &Leo) -> Result<Self, RunError> {
        Ok(Self {
            _awake: settings.supervisor.keep_cores_awake.then(IdleStateGuard::ask),
            signals: Signals::watch().map_err(RunError::Signals)?,
            children: Children::new().map_err(RunError::Executable)?,
            ended: BTreeMap::new(),
            interrupted: false,
        })
    }

    /// Publishes the processes on a roster.
    pub(crate) fn with_roster(mut self, lives: RosterPublisher) -> Self {
        self.children = self.children.with_roster(lives);
        self
    }

    /// Starts the processes in this order, and waits until all are ready.
    pub(crate) fn start_all(
        &mut self,
        node: &Node,
        processes: &[Process],
        launch: &Launch,
        ready_within: Duration,
    ) -> Result<(), LockstepError> {
        for &process in processes {
            let started = self.children.start(process, launch);
            started.map_err(|source| LockstepError::Start { process, source })?;
        }
        processes.iter().try_for_each(|process| self.await_ready(node, *process, ready_within))
    }

    fn await_ready(&mut self, node: &Node, process: Process, within: Duration) -> Result<(), LockstepError> {
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

    /// Waits until all have exited. Those that exceed the timeout are killed when this is dropped.
    pub(crate) fn wait_for_exit(&mut self, within: Duration) {
        let give_up = clock::now() + within;
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
