use transport::{DomainError, JoinError, PortError, ReceiveError, ReserveError, SendError};

/// Error that ends a process.
#[derive(Debug, thiserror::Error)]
pub enum ProcessError {
    /// A configuration file is invalid.
    #[error(transparent)]
    Config(#[from] config::SettingsError),
    /// The domain is invalid.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// The domain could not be joined.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// A port could not be opened.
    #[error(transparent)]
    Port(#[from] PortError),
    /// A frame could not be sent.
    #[error(transparent)]
    Send(#[from] SendError),
    /// A frame could not be received.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// Shared memory is full.
    #[error(transparent)]
    Reserve(#[from] ReserveError),
    /// The supervisor has died.
    #[error(transparent)]
    Parent(#[from] realtime::ParentError),
    /// The period of the cycle is zero.
    #[error(transparent)]
    Schedule(#[from] cycle::ZeroPeriodError),
    /// An error specific to one process.
    #[error("{0}")]
    Own(String),
}

impl ProcessError {
    /// An error specific to one process.
    pub fn own(reason: impl std::fmt::Display) -> Self {
        Self::Own(reason.to_string())
    }
}
