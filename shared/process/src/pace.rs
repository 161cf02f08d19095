use std::time::Duration;

use clock::Instant;
use cycle::Schedule;
use message::{Done, Head as _, Header, Topic, TurnKind, Turns, TurnsDone};
use transport::{Inlet, Node, Outlet};

use crate::Failure;

/// How long a process waits before it looks whether it was told to stop, and its heart beats.
pub(crate) const IDLE: Duration = Duration::from_millis(50);

/// What makes the loop go round.
pub(crate) enum Pace {
    /// The machine's clock.
    Wall {
        /// Release times; none for a process that is woken.
        schedule: Option<Schedule>,
    },
    /// The conductor's turns.
    Lockstep(Box<Lockstep>),
}

pub(crate) struct Lockstep {
    turns: Inlet<Turns>,
    done: Outlet<TurnsDone>,
    round: u64,
    now: Instant,
}

/// What waiting came to.
pub(crate) enum Wait {
    /// Begin a cycle, released then.
    Go(Instant),
    /// Nothing yet.
    Idle,
    /// The conductor says stop.
    Stop,
}

impl Lockstep {
    pub(crate) fn open(node: &Node, process: message::Process) -> Result<Self, Failure> {
        let number = Some(u32::from(process.raw()));
        Ok(Self {
            turns: node.waking_inlet(number)?,
            done: node.outlet(number, 1)?,
            round: 0,
            now: Instant::EPOCH,
        })
    }

    pub(crate) fn now(&self) -> Instant {
        self.now
    }

    pub(crate) fn wait(&mut self) -> Result<Wait, Failure> {
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

    pub(crate) fn done(&mut self, finished: bool) -> Result<(), Failure> {
        let done = Done { round: self.round, finished: u64::from(finished) };
        self.done.send(Header::at(self.now.as_nanos()), 1, |_| done, |_| {})?;
        Ok(())
    }
}

/// Waits for a frame of the inlet that wakes the process.
pub(crate) fn wait_for_call<T: Topic>(inlet: &mut Inlet<T>) -> Result<Wait, Failure> {
    inlet.wait(IDLE)?;
    Ok(Wait::Go(clock::now()))
}
