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
    waits_ms: Option<u32>,
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
        let waits_ms = latency_timer(path).and_then(|timer| hurry(&timer));
        Ok(Self { fd, waits_ms })
    }

    /// For how many milliseconds its USB adapter waits for more before it hands over what it received, where
    /// that is more than one and could not be changed: answers come late by so much.
    #[must_use]
    pub const fn waits_ms(&self) -> Option<u32> {
        self.waits_ms
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

/// Lets a USB adapter hand over at once what it received: as they come they wait for 16 ms for more. How many
/// milliseconds it waits all the same, where that is more than one: there is no right to change it.
///
/// The flag `ASYNC_LOW_LATENCY` of `TIOCSSERIAL` would do the same for drivers that heed it, and takes an ioctl
/// by raw pointer, which this crate does without; the file is theirs as well.
fn hurry(timer: &Path) -> Option<u32> {
    let _unchanged = fs::write(timer, "1");
    let waits_ms: u32 = fs::read_to_string(timer).ok()?.trim().parse().ok()?;
    (waits_ms > 1).then_some(waits_ms)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_adapter_that_could_not_be_hurried_is_known() {
        let folder = tempfile::tempdir().unwrap();
        let timer = folder.path().join("latency_timer");
        fs::write(&timer, "16\n").unwrap();
        assert_eq!(hurry(&timer), None, "it hands over after a millisecond now");
        assert_eq!(fs::read_to_string(&timer).unwrap(), "1");
        // A number that nobody may write.
        assert_eq!(hurry(Path::new("/proc/sys/kernel/ngroups_max")), Some(65_536));
        assert_eq!(hurry(folder.path()), None, "that is no timer");
    }
}
