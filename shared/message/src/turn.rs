use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::{Header, Process, Topic, numbered};

numbered! {
    /// What a process shall do with its turn.
    TurnKind: u32 {
        /// One step at the given instant.
        Step = 1,
        /// End the process.
        Stop = 2,
    }
}

/// Lockstep: the conductor gives one process its turn at an instant of simulated time. The
/// header's `valid_at_ns` is that instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Turn/1")]
pub struct Turn {
    /// A [`TurnKind`].
    pub kind: u32,
    /// Not used; zero.
    pub reserved: u32,
    /// Counts the turns of the run from one.
    pub round: u64,
}

impl Turn {
    /// What to do; `None` for nonsense.
    #[must_use]
    pub fn kind(&self) -> Option<TurnKind> {
        TurnKind::from_raw(self.kind)
    }
}

/// Lockstep: a process has done its turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Done/1")]
pub struct Done {
    /// The turn that is done.
    pub round: u64,
    /// Whether the process has nothing left to do: 1 yes, 0 no. The lesson is over when the
    /// simulator says so.
    pub finished: u64,
}

/// The topic of turns given to one process.
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

/// The topic of turns done by one process.
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
