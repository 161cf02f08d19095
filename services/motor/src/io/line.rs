use std::path::PathBuf;

use clock::{Duration, Instant};
use serial::{LineLostError, Tty};

use crate::{Port, Received, Sent};

/// First waiting time before a line is opened again; doubled after each failure ...
const REOPEN_AFTER: Duration = Duration::from_millis(50);
/// ... up to this value.
const MAX_REOPEN_WAIT: Duration = Duration::from_secs(1);
/// Maximum number of reads that discard stale bytes before a request.
const DRAINS: u32 = 8;

/// A serial line that is reopened after it was lost.
#[derive(Debug)]
pub struct Line {
    tty: Option<Tty>,
    /// The lost line, until it is closed.
    lost: Option<Tty>,
    path: PathBuf,
    baud: u32,
    reopen_at: Instant,
    wait: Duration,
}

impl Line {
    /// Creates a line at a path, already opened or not.
    #[must_use]
    pub const fn new(tty: Option<Tty>, path: PathBuf, baud: u32) -> Self {
        Self { tty, lost: None, path, baud, reopen_at: Instant::EPOCH, wait: REOPEN_AFTER }
    }

    fn reopen(&mut self, now: Instant) -> Result<&Tty, LineLostError> {
        if self.tty.is_none() && now >= self.reopen_at {
            // Only one process, and only once, can open a line.
            self.close_lost();
            self.tty = Tty::open(&self.path, self.baud).ok();
            self.wait = if self.tty.is_some() { REOPEN_AFTER } else { (2 * self.wait).min(MAX_REOPEN_WAIT) };
            self.reopen_at = now + self.wait;
        }
        self.tty.as_ref().ok_or(LineLostError::HangUp)
    }

    fn note<T>(&mut self, result: Result<T, LineLostError>) -> Result<T, LineLostError> {
        if result.is_err() {
            self.lost = self.tty.take();
        }
        result
    }
}

impl Port for Line {
    fn send(&mut self, bytes: &[u8], within: Duration) -> Result<Sent, LineLostError> {
        let at = clock::now();
        let tty = self.reopen(at)?;
        let sent = tty.drain(DRAINS).and_then(|late| tty.write(bytes, at + within).map(|()| late));
        self.note(sent).map(|late| Sent { at, late })
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        within: Duration,
        until: Instant,
    ) -> Result<Received, LineLostError> {
        // Bytes already received are read even if the thread is late.
        let until = until.min(clock::now() + within);
        let received = self.tty.as_ref().ok_or(LineLostError::HangUp)?.read(into, until);
        self.note(received).map(|count| Received { count, at: clock::now() })
    }

    fn close_lost(&mut self) {
        self.lost = None;
    }
}

#[cfg(test)]
mod tests {
    use serial::{OpenError, Pty};

    use super::*;

    const BAUD: u32 = 1_000_000;
    const SHORT: Duration = Duration::from_millis(2);

    #[test]
    fn a_blocked_line_stays_open_until_it_is_closed_and_reopened() {
        let pty = Pty::new(BAUD).unwrap();
        let is_held = || matches!(Tty::open(pty.path(), BAUD), Err(OpenError::Busy { .. }));
        let mut line = Line::new(Tty::open(pty.path(), BAUD).ok(), pty.path().to_owned(), BAUD);
        // Nothing reads the other end.
        let lost = loop {
            if let Err(lost) = line.send(&[0; 512], SHORT) {
                break lost;
            }
        };
        assert_eq!(lost, LineLostError::WriteTimeout);
        assert!(is_held(), "it was closed before anybody knew of it");
        line.close_lost();
        assert!(!is_held());
        let mut bin = [0; 1 << 16];
        while pty.read(&mut bin, Instant::EPOCH).unwrap() > 0 {}
        assert!(line.send(&[1; 8], SHORT).is_ok());
        assert!(is_held());
    }
}
