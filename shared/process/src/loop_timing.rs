use std::time::Duration;

use clock::Instant;
use cycle::Schedule;
use message::{Done, Head as _, Header, TurnKind, Turns, TurnsDone};
use transport::{FramePublisher, FrameSubscriber, Node};

use crate::ProcessError;

/// Longest wait before a process checks its stop flag and sends a heartbeat.
pub(crate) const IDLE: Duration = Duration::from_millis(50);

/// What triggers the iterations of the main loop.
pub(crate) enum LoopTiming {
    /// The machine's clock.
    Wall {
        /// Release times; `None` for an event-driven process.
        schedule: Option<Schedule>,
    },
    /// Turns given by the conductor.
    Lockstep(Box<Lockstep>),
}

pub(crate) struct Lockstep {
    turns: FrameSubscriber<Turns>,
    done: FramePublisher<TurnsDone>,
    round: u64,
    now: Instant,
}

/// Result of waiting.
pub(crate) enum Wait {
    /// Start a cycle with this release time.
    Go(Instant),
    /// Timeout without an event.
    Idle,
    /// The conductor requests a stop.
    Stop,
}

impl Lockstep {
    pub(crate) fn open(node: &Node, process: message::Process) -> Result<Self, ProcessError> {
        let number = Some(u32::from(process.raw()));
        Ok(Self {
            turns: node.waking_subscriber(number)?,
            done: node.publisher(number, 1)?,
            round: 0,
            now: Instant::EPOCH,
        })
    }

    pub(crate) fn now(&self) -> Instant {
        self.now
    }

    pub(crate) fn wait(&mut self) -> Result<Wait, ProcessError> {
        self.turns.wait(IDLE)?;
        let Some(frame) = self.turns.receive()? else { return Ok(Wait::Idle) };
        let Some(turn) = frame.entries().first() else { return Ok(Wait::Idle) };
        self.now = Instant::from_nanos(frame.head().header().valid_at_ns);
        self.round = turn.round;
        Ok(match turn.kind() {
            Some(TurnKind::Step) => Wait::Go(self.now),
            Some(TurnKind::Stop) | None => Wait::Stop,
        })
    }

    pub(crate) fn done(&mut self, finished: bool) -> Result<(), ProcessError> {
        let done = Done { round: self.round, finished: u64::from(finished) };
        self.done.send(Header::at(self.now.as_nanos()), 1, |_| done, |_| {})?;
        Ok(())
    }
}
