use crate::{Header, Process, Topic, ZeroCopySend, numbered};

numbered! {
    /// Kind of a turn.
    TurnKind: u32 {
        /// Make one step at the given instant.
        Step = 1,
        /// Exit the process.
        Stop = 2,
    }
}

/// Lockstep: the conductor gives one process a turn at an instant of simulated time. The header's `valid_at_ns` is
/// that instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Turn/1")]
pub struct Turn {
    /// A [`TurnKind`].
    pub kind: u32,
    /// Not used; zero.
    pub reserved: u32,
    /// Number of the turn in the run, from one.
    pub round: u64,
}

impl Turn {
    /// The kind; `None` if the number is invalid.
    #[must_use]
    pub fn kind(&self) -> Option<TurnKind> {
        TurnKind::from_raw(self.kind)
    }
}

/// Lockstep: a process has completed its turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Done/1")]
pub struct Done {
    /// The number of the completed turn.
    pub round: u64,
    /// Whether the process has nothing left to do: 1 yes, 0 no. The simulator ends the lesson.
    pub finished: u64,
}

/// Topic of the turns given to one process.
#[derive(Clone, Copy, Debug)]
pub enum Turns {}

impl Topic for Turns {
    type Head = Header;
    type Entry = Turn;
    const NAME: &'static str = "turns";

    fn writer(_number: Option<u32>) -> Option<Process> {
        Some(Process::Supervisor)
    }
}

/// Topic of the turns completed by one process.
#[derive(Clone, Copy, Debug)]
pub enum TurnsDone {}

impl Topic for TurnsDone {
    type Head = Header;
    type Entry = Done;
    const NAME: &'static str = "turns-done";

    fn writer(number: Option<u32>) -> Option<Process> {
        number.and_then(|number| u16::try_from(number).ok()).and_then(Process::from_raw)
    }
}
