use std::path::PathBuf;

use rustix::io::Errno;

/// Why a line could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// There is no such device, or no permission to open it.
    #[error(
        "cannot open {}: {source}; is it plugged in, and may this user open it (group `dialout`)?",
        path.display()
    )]
    Device {
        /// The device.
        path: PathBuf,
        /// Error of the system.
        source: Errno,
    },
    /// Another program uses it.
    #[error("{} is in use by another program: two masters on one bus would collide; end the other one", path.display())]
    Busy {
        /// The device.
        path: PathBuf,
    },
    /// It is no tty, or does not support the speed.
    #[error("cannot set {} to {baud} baud, raw: {source}; does this serial line support that baud \
             rate?", path.display())]
    Mode {
        /// The device.
        path: PathBuf,
        /// Bits per second.
        baud: u32,
        /// Error of the system.
        source: Errno,
    },
    /// No pseudo-terminal could be created.
    #[error("cannot make a pseudo-terminal: {source}; is /dev/pts mounted?")]
    Pty {
        /// Error of the system.
        source: Errno,
    },
}

/// The line was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineLostError {
    /// The other end hung up.
    #[error("the other end of the line was closed")]
    HangUp,
    /// It accepted no bytes before the deadline.
    #[error("the line took no bytes before the deadline")]
    WriteTimeout,
    /// A system call failed.
    #[error("the line failed: {0}")]
    Failed(Errno),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_messages_match_the_snapshot() {
        let path = || PathBuf::from("/dev/ttyUSB0");
        let opening = [
            OpenError::Device { path: path(), source: Errno::NOENT },
            OpenError::Busy { path: path() },
            OpenError::Mode { path: path(), baud: 4_500_000, source: Errno::INVAL },
            OpenError::Pty { source: Errno::NOENT },
        ];
        let lost = [LineLostError::HangUp, LineLostError::WriteTimeout, LineLostError::Failed(Errno::IO)];
        let wording: Vec<String> =
            opening.iter().map(ToString::to_string).chain(lost.iter().map(ToString::to_string)).collect();
        insta::assert_snapshot!(wording.join("\n"));
    }
}
