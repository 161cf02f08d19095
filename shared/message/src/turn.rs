use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::bytes::impl_bytes;
use crate::wire_enum;

wire_enum! {
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

impl_bytes!(Turn = "leo/Turn/1" {
    kind, reserved, round
});

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

impl_bytes!(Done = "leo/Done/1" {
    round, finished
});
