use std::fs;
use std::path::{Path, PathBuf};

use clock::Instant;
use rustix::fd::{AsFd, OwnedFd};
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::io::Errno;
use rustix::termios::{ControlModes, OptionalActions, SpecialCodeIndex, tcgetattr, tcsetattr};

use crate::port::{drain, read_until, write_until};
use crate::{LineLostError, OpenError};

/// A raw serial line: eight data bits, no parity, one stop bit, no flow control, no echo.
#[derive(Debug)]
pub struct Tty {
    fd: OwnedFd,
    waits_ms: Option<u32>,
}

impl Tty {
    /// Opens a serial device at any speed that it supports, with an advisory lock (`flock`) against other programs
    /// that lock it.
    ///
    /// # Errors
    ///
    /// It cannot be opened, is in use, is no tty, or does not support the speed.
    pub fn open(path: &Path, baud: u32) -> Result<Self, OpenError> {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let fd = open(path, flags, Mode::empty())
            .map_err(|source| OpenError::Device { path: path.to_owned(), source })?;
        // `TIOCEXCL` would outlive this program if another process holds the line open, as the mock does.
        flock(&fd, FlockOperation::NonBlockingLockExclusive)
            .map_err(|_| OpenError::Busy { path: path.to_owned() })?;
        make_raw(&fd, baud).map_err(|source| OpenError::Mode { path: path.to_owned(), baud, source })?;
        let waits_ms = latency_timer(path).and_then(|timer| hurry(&timer));
        Ok(Self { fd, waits_ms })
    }

    /// Latency timer of its USB adapter in milliseconds, if it is above 1 and could not be changed: answers are
    /// delayed by it.
    #[must_use]
    pub const fn waits_ms(&self) -> Option<u32> {
        self.waits_ms
    }

    /// Reads the available bytes, or waits for the first ones until `until`. Returns 0 if none arrived.
    ///
    /// # Errors
    ///
    /// The line was lost.
    pub fn read(&self, into: &mut [u8], until: Instant) -> Result<usize, LineLostError> {
        read_until(&self.fd, into, until)
    }

    /// Writes all of `bytes`. Waits for space until `until`.
    ///
    /// # Errors
    ///
    /// The line was lost, or had no space in time.
    pub fn write(&self, bytes: &[u8], until: Instant) -> Result<(), LineLostError> {
        write_until(&self.fd, bytes, until)
    }

    /// Discards received bytes with at most `reads` reads, and returns their number.
    ///
    /// # Errors
    ///
    /// The line was lost.
    pub fn drain(&self, reads: u32) -> Result<usize, LineLostError> {
        drain(&self.fd, reads)
    }
}

/// Sets the latency timer of a USB adapter to 1 ms, so that it delivers received bytes at once; the default is 16 ms.
/// Returns the value in milliseconds if it stays above 1, for lack of permission.
///
/// The flag `ASYNC_LOW_LATENCY` of `TIOCSSERIAL` would do the same for drivers that support it. It needs an ioctl
/// with a raw pointer, which this crate avoids; those drivers have the file as well.
fn hurry(timer: &Path) -> Option<u32> {
    let _unchanged = fs::write(timer, "1");
    let waits_ms: u32 = fs::read_to_string(timer).ok()?.trim().parse().ok()?;
    (waits_ms > 1).then_some(waits_ms)
}

/// Path of the latency timer of a tty's USB adapter, if it has one.
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
    fn a_latency_timer_that_cannot_be_set_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let timer = folder.path().join("latency_timer");
        fs::write(&timer, "16\n").unwrap();
        assert_eq!(hurry(&timer), None, "it hands over after a millisecond now");
        assert_eq!(fs::read_to_string(&timer).unwrap(), "1");
        // A number without write permission.
        assert_eq!(hurry(Path::new("/proc/sys/kernel/ngroups_max")), Some(65_536));
        assert_eq!(hurry(folder.path()), None, "that is no timer");
    }
}
