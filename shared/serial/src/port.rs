//! Reads and writes with a deadline.

use clock::Instant;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::{AsFd, BorrowedFd};
use rustix::io::{Errno, read, write};

use crate::LineLostError;

/// Reads the available bytes, or waits for the first ones until `until`. Returns 0 if none arrived.
pub(crate) fn read_until(fd: impl AsFd, into: &mut [u8], until: Instant) -> Result<usize, LineLostError> {
    loop {
        if let Some(count) = read_now(fd.as_fd(), into)? {
            return Ok(count);
        }
        if !ready(fd.as_fd(), PollFlags::IN, until)? {
            return Ok(0);
        }
    }
}

/// Reads the available bytes; `None` if there are none.
fn read_now(fd: BorrowedFd<'_>, into: &mut [u8]) -> Result<Option<usize>, LineLostError> {
    match read(fd, &mut *into) {
        Ok(0) if !into.is_empty() => Err(LineLostError::HangUp),
        Ok(count) => Ok(Some(count)),
        Err(Errno::AGAIN | Errno::INTR) => Ok(None),
        Err(Errno::IO) => Err(LineLostError::HangUp),
        Err(error) => Err(LineLostError::Failed(error)),
    }
}

/// Writes all of `bytes`. Waits for space until `until`.
pub(crate) fn write_until(fd: impl AsFd, mut bytes: &[u8], until: Instant) -> Result<(), LineLostError> {
    while !bytes.is_empty() {
        match write(fd.as_fd(), bytes) {
            Ok(count) => bytes = bytes.get(count..).unwrap_or_default(),
            Err(Errno::AGAIN) => {
                if !ready(fd.as_fd(), PollFlags::OUT, until)? {
                    return Err(LineLostError::WriteTimeout);
                }
            }
            Err(Errno::INTR) => {}
            Err(Errno::IO) => return Err(LineLostError::HangUp),
            Err(error) => return Err(LineLostError::Failed(error)),
        }
    }
    Ok(())
}

/// Discards received bytes with at most `reads` reads, so that a line that never falls silent cannot hold the cycle.
/// Returns the number of bytes.
pub(crate) fn drain(fd: impl AsFd, reads: u32) -> Result<usize, LineLostError> {
    let mut thrown = 0;
    let mut bin = [0; 512];
    for _ in 0..reads {
        match read_now(fd.as_fd(), &mut bin)? {
            None => break,
            Some(count) => thrown += count,
        }
    }
    Ok(thrown)
}

/// Whether the line became ready before `until`.
fn ready(fd: BorrowedFd<'_>, flags: PollFlags, until: Instant) -> Result<bool, LineLostError> {
    let timeout = Timespec::try_from(until.since(clock::now())).ok();
    let mut fds = [PollFd::from_borrowed_fd(fd, flags)];
    match poll(&mut fds, timeout.as_ref()) {
        Ok(0) => Ok(false),
        Ok(_) => {
            let [asked] = &fds;
            // Bytes received before the hang-up must still be read.
            let hung_up = asked.revents().intersects(PollFlags::HUP | PollFlags::ERR);
            if hung_up && !asked.revents().contains(flags) { Err(LineLostError::HangUp) } else { Ok(true) }
        }
        // The caller retries; a deadline in the past ends the next wait at once.
        Err(Errno::INTR) => Ok(true),
        Err(error) => Err(LineLostError::Failed(error)),
    }
}
