use transport::{DomainError, JoinError, PortError, ReceiveError, SendError};

/// Why a process ends before it is told to.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A file was refused.
    #[error(transparent)]
    Config(#[from] config::ConfigError),
    /// The domain is none.
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
    /// No frame could be received.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// The supervisor is gone.
    #[error(transparent)]
    Parent(#[from] realtime::ParentError),
    /// The cycle's period is no period.
    #[error(transparent)]
    Schedule(#[from] cycle::ZeroPeriod),
    /// What only one process can fail at.
    #[error("{0}")]
    Own(String),
}

impl Failure {
    /// A failure of one process's own making.
    pub fn own(reason: impl std::fmt::Display) -> Self {
        Self::Own(reason.to_string())
    }
}
