use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};

use clock::Instant;
use rustix::fd::OwnedFd;
use rustix::fs::{Mode, OFlags, fcntl_getfl, fcntl_setfl, open};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::tcgetattr;

use crate::port::{read_until, write_until};
use crate::tty::make_raw;
use crate::{LineLostError, OpenError};

/// A pseudo-terminal: a serial line whose other end is this process.
#[derive(Debug)]
pub struct Pty {
    master: OwnedFd,
    /// Held open, so that the line does not hang up between two users of the other end.
    _slave: OwnedFd,
    path: PathBuf,
}

impl Pty {
    /// Creates a raw line, at `baud` until its user sets another speed.
    ///
    /// # Errors
    ///
    /// The system supports no pseudo-terminals, or no more of them.
    pub fn new(baud: u32) -> Result<Self, OpenError> {
        Self::make(baud).map_err(|source| OpenError::Pty { source })
    }

    fn make(baud: u32) -> Result<Self, Errno> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let name = ptsname(&master, Vec::new())?;
        let path = PathBuf::from(OsString::from_vec(name.into_bytes()));
        let slave = open(&path, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?;
        make_raw(&slave, baud)?;
        fcntl_setfl(&master, fcntl_getfl(&master)? | OFlags::NONBLOCK)?;
        Ok(Self { master, _slave: slave, path })
    }

    /// Path of the other end.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Speed set at the other end, in bits per second.
    ///
    /// # Errors
    ///
    /// The line was lost.
    pub fn baud(&self) -> Result<u32, LineLostError> {
        tcgetattr(&self.master).map(|mode| mode.output_speed()).map_err(LineLostError::Failed)
    }

    /// Reads the available bytes, or waits for the first ones until `until`. Returns 0 if none arrived.
    ///
    /// # Errors
    ///
    /// The line was lost.
    pub fn read(&self, into: &mut [u8], until: Instant) -> Result<usize, LineLostError> {
        read_until(&self.master, into, until)
    }

    /// Writes all of `bytes`. Waits for space until `until`.
    ///
    /// # Errors
    ///
    /// The line was lost, or the other end did not read in time.
    pub fn write(&self, bytes: &[u8], until: Instant) -> Result<(), LineLostError> {
        write_until(&self.master, bytes, until)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Tty;
    use clock::Duration;

    fn soon() -> Instant {
        clock::now() + Duration::from_secs(5)
    }

    #[test]
    fn every_byte_arrives_unchanged_and_without_an_echo() {
        let pty = Pty::new(1_000_000).unwrap();
        let tty = Tty::open(pty.path(), 4_000_000).unwrap();
        let sent: Vec<u8> = (0..=255).collect();
        for (direction, end) in [("in", 0), ("out", 1)] {
            let mut got = Vec::new();
            let mut buffer = [0; 64];
            if end == 0 { pty.write(&sent, soon()) } else { tty.write(&sent, soon()) }.unwrap();
            while got.len() < sent.len() {
                let count =
                    if end == 0 { tty.read(&mut buffer, soon()) } else { pty.read(&mut buffer, soon()) }
                        .unwrap();
                got.extend_from_slice(&buffer[..count]);
            }
            assert_eq!(got, sent, "{direction}");
        }
        assert_eq!(tty.read(&mut [0; 8], Instant::EPOCH), Ok(0));
        assert_eq!(pty.read(&mut [0; 8], Instant::EPOCH), Ok(0));
    }

    #[test]
    fn the_speed_set_at_the_other_end_is_readable() {
        let pty = Pty::new(1_000_000).unwrap();
        assert_eq!(pty.baud(), Ok(1_000_000));
        let _tty = Tty::open(pty.path(), 4_500_000).unwrap();
        assert_eq!(pty.baud(), Ok(4_500_000));
    }

    #[test]
    fn a_read_without_data_returns_at_its_deadline() {
        let pty = Pty::new(1_000_000).unwrap();
        let tty = Tty::open(pty.path(), 1_000_000).unwrap();
        let until = clock::now() + Duration::from_micros(300);
        assert_eq!(tty.read(&mut [0; 8], until), Ok(0));
        assert!(clock::now() >= until);
    }

    #[test]
    fn the_line_survives_its_user_and_reports_a_closed_other_end() {
        let pty = Pty::new(1_000_000).unwrap();
        drop(Tty::open(pty.path(), 1_000_000).unwrap());
        assert_eq!(pty.read(&mut [0; 8], Instant::EPOCH), Ok(0));
        let tty = Tty::open(pty.path(), 1_000_000).unwrap();
        drop(pty);
        assert_eq!(tty.read(&mut [0; 8], soon()), Err(LineLostError::HangUp));
    }

    #[test]
    fn a_line_has_one_user_at_a_time() {
        let pty = Pty::new(1_000_000).unwrap();
        let tty = Tty::open(pty.path(), 1_000_000).unwrap();
        let refused = Tty::open(pty.path(), 1_000_000).unwrap_err();
        assert!(matches!(&refused, OpenError::Busy { path } if path == pty.path()), "{refused:?}");
        drop(tty);
        Tty::open(pty.path(), 1_000_000).unwrap();
    }

    #[test]
    fn draining_discards_waiting_bytes_up_to_a_number_of_reads() {
        let pty = Pty::new(1_000_000).unwrap();
        let tty = Tty::open(pty.path(), 1_000_000).unwrap();
        pty.write(&[7; 1500], soon()).unwrap();
        assert_eq!(tty.drain(2), Ok(1024));
        assert_eq!(tty.drain(8), Ok(476));
    }

    #[test]
    fn a_path_that_is_no_tty_is_refused_by_name() {
        let no_tty = Tty::open("/dev/null".as_ref(), 1_000_000).unwrap_err();
        assert!(matches!(&no_tty, OpenError::Mode { baud: 1_000_000, .. }), "{no_tty:?}");
        let missing = Tty::open("/dev/nowhere".as_ref(), 1_000_000).unwrap_err();
        assert!(matches!(&missing, OpenError::Device { .. }), "{missing:?}");
        let busy = OpenError::Busy { path: "/dev/ttyUSB0".into() };
        insta::assert_snapshot!([no_tty, missing, busy].map(|error| error.to_string()).join("\n"));
    }
}
