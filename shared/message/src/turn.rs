use crate::bytes::message;
use crate::{ZeroCopySend, wire_enum};

wire_enum! {
    /// Kind of a turn.
    TurnKind: u32 {
        /// Make one step at the given instant.
        Step = 1,
        /// Exit the process.
        Stop = 2,
    }
}

message! {
    /// Lockstep: the conductor gives one process a turn at an instant of simulated time. The header's `valid_at_ns` is
    /// that instant.
    #[derive(Debug, PartialEq, Eq)]
    pub struct Turn as "leo/Turn/1" {
        /// A [`TurnKind`].
        pub kind: u32,
        /// Not used; zero.
        pub reserved: u32,
        /// Number of the turn in the run, from one.
        pub round: u64,
    }
}

impl Turn {
    /// The kind; `None` if the number is invalid.
    #[must_use]
    pub fn kind(&self) -> Option<TurnKind> {
        TurnKind::from_raw(self.kind)
    }
}

message! {
    /// Lockstep: a process has completed its turn.
    #[derive(Debug, PartialEq, Eq)]
    pub struct Done as "leo/Done/1" {
        /// The number of the completed turn.
        pub round: u64,
        /// Whether the process has nothing left to do: 1 yes, 0 no. The simulator ends the lesson.
        pub finished: u64,
    }
}
