use std::fs;
use std::path::{Path, PathBuf};

use clock::Instant;
use rustix::fd::{AsFd, OwnedFd};
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::io::Errno;
use rustix::termios::{ControlModes, OptionalActions, SpecialCodeIndex, tcgetattr, tcsetattr};

use crate::port::{drain, read_until, write_until};
use crate::{Lost, OpenError};

/// A serial line, raw: eight bits, no parity, one stop bit, no flow control, no echo.
#[derive(Debug)]
pub struct Tty {
    fd: OwnedFd,
}

impl Tty {
    /// Opens a serial device at any speed that it knows, for this program alone among those that
    /// open it so.
    ///
    /// # Errors
    ///
    /// It cannot be opened, is in use, is no tty, or does not know the speed.
    pub fn open(path: &Path, baud: u32) -> Result<Self, OpenError> {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let fd = open(path, flags, Mode::empty())
            .map_err(|source| OpenError::Device { path: path.to_owned(), source })?;
        // `TIOCEXCL` would outlive this program where somebody holds the line open, as a mock does.
        flock(&fd, FlockOperation::NonBlockingLockExclusive)
            .map_err(|_| OpenError::Busy { path: path.to_owned() })?;
        make_raw(&fd, baud).map_err(|source| OpenError::Mode { path: path.to_owned(), baud, source })?;
        hurry(path);
        Ok(Self { fd })
    }

    /// Reads what is there, or waits for the first of it until `until`: zero when none came.
    ///
    /// # Errors
    ///
    /// The line is gone.
    pub fn read(&self, into: &mut [u8], until: Instant) -> Result<usize, Lost> {
        read_until(&self.fd, into, until)
    }

    /// Writes all of `bytes`, waiting for room until `until`.
    ///
    /// # Errors
    ///
    /// The line is gone, or had no room.
    pub fn write(&self, bytes: &[u8], until: Instant) -> Result<(), Lost> {
        write_until(&self.fd, bytes, until)
    }

    /// Throws away what waits to be read, at most `reads` pieces of it, and returns how many
    /// bytes that were.
    ///
    /// # Errors
    ///
    /// The line is gone.
    pub fn drain(&self, reads: u32) -> Result<usize, Lost> {
        drain(&self.fd, reads)
    }
}

/// Lets a USB adapter hand over at once what it received: as they come they wait for 16 ms for more.
/// Where there is no such thing, or no right to it, nothing changes.
fn hurry(path: &Path) {
    if let Some(timer) = latency_timer(path) {
        let _unchanged = fs::write(timer, "1");
    }
}

/// Where the latency timer of a tty's USB adapter is set, in milliseconds, if it has one.
fn latency_timer(path: &Path) -> Option<PathBuf> {
    let device = fs::canonicalize(path).ok()?;
    let timer = Path::new("/sys/class/tty").join(device.file_name()?).join("device/latency_timer");
    timer.exists().then_some(timer)
}

/// Puts a tty into raw mode at `baud`.
pub(crate) fn make_raw(fd: impl AsFd, baud: u32) -> Result<(), Errno> {
    let mut mode = tcgetattr(fd.as_fd())?;
    mode.make_raw();
    mode.control_modes.remove(ControlModes::CSTOPB | ControlModes::CRTSCTS);
    mode.control_modes.insert(ControlModes::CLOCAL | ControlModes::CREAD);
    mode.special_codes[SpecialCodeIndex::VMIN] = 1;
    mode.special_codes[SpecialCodeIndex::VTIME] = 0;
    mode.set_speed(baud)?;
    tcsetattr(fd.as_fd(), OptionalActions::Now, &mode)
}
