use std::path::PathBuf;

use clock::{Duration, Instant};
use serial::{Lost, Tty};

use crate::{Port, Received, Sent};

/// A line that could not be opened is tried again after this long, and then after twice that ...
const REOPEN_AFTER: Duration = Duration::from_millis(50);
/// ... up to this.
const REOPEN_MOST: Duration = Duration::from_secs(1);
/// Pieces of stale bytes that are thrown away before a request at most.
const DRAINS: u32 = 8;

/// A line that is opened again when it was lost.
#[derive(Debug)]
pub struct Line {
    tty: Option<Tty>,
    path: PathBuf,
    baud: u32,
    reopen_at: Instant,
    wait: Duration,
}

impl Line {
    /// A line at a path, opened already or not yet.
    #[must_use]
    pub const fn new(tty: Option<Tty>, path: PathBuf, baud: u32) -> Self {
        Self { tty, path, baud, reopen_at: Instant::EPOCH, wait: REOPEN_AFTER }
    }

    fn reopen(&mut self, now: Instant) -> Result<&Tty, Lost> {
        if self.tty.is_none() && now >= self.reopen_at {
            self.tty = Tty::open(&self.path, self.baud).ok();
            self.wait = if self.tty.is_some() { REOPEN_AFTER } else { (2 * self.wait).min(REOPEN_MOST) };
            self.reopen_at = now + self.wait;
        }
        self.tty.as_ref().ok_or(Lost::HangUp)
    }

    fn note<T>(&mut self, result: Result<T, Lost>) -> Result<T, Lost> {
        if result.is_err() {
            self.tty = None;
        }
        result
    }
}

impl Port for Line {
    fn send(&mut self, bytes: &[u8], within: Duration) -> Result<Sent, Lost> {
        let at = clock::now();
        let tty = self.reopen(at)?;
        let sent = tty.drain(DRAINS).and_then(|late| tty.write(bytes, at + within).map(|()| late));
        self.note(sent).map(|late| Sent { at, late })
    }

    fn receive(&mut self, into: &mut [u8], within: Duration, until: Instant) -> Result<Received, Lost> {
        // What is there already is read also where the thread came late.
        let until = until.min(clock::now() + within);
        let received = self.tty.as_ref().ok_or(Lost::HangUp)?.read(into, until);
        self.note(received).map(|count| Received { count, at: clock::now() })
    }
}
