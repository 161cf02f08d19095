use std::path::PathBuf;

use rustix::io::Errno;

/// Why a line could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// There is no such device, or it may not be opened.
    #[error(
        "cannot open {}: {source}; is it plugged in, and may this user open it (group `dialout`)?",
        path.display()
    )]
    Device {
        /// The device.
        path: PathBuf,
        /// What the system said.
        source: Errno,
    },
    /// Another program uses it.
    #[error("{} is in use by another program: two masters on one bus would talk at once; end the other one", path.display())]
    Busy {
        /// The device.
        path: PathBuf,
    },
    /// It is no tty, or does not know the speed.
    #[error("cannot set {} to {baud} baud, raw: {source}; is it a serial line that is as fast?", path.display())]
    Mode {
        /// The device.
        path: PathBuf,
        /// Bits per second.
        baud: u32,
        /// What the system said.
        source: Errno,
    },
    /// No pseudo-terminal could be made.
    #[error("cannot make a pseudo-terminal: {source}; is /dev/pts mounted?")]
    Pty {
        /// What the system said.
        source: Errno,
    },
}

/// The line is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Lost {
    /// The other end hung up.
    #[error("the other end of the line hung up")]
    HangUp,
    /// It took no bytes before the deadline.
    #[error("the line took no bytes before the deadline")]
    Stuck,
    /// The system refused.
    #[error("the line failed: {0}")]
    Failed(Errno),
}
