//! A bus whose servos are in this process.

use clock::{Duration, Instant};
use motor_process::{Port, Received, Sent};
use serial::LineLostError;
use servo::mock::Line;

/// A bus without transmission times: answers arrive at once, without allocation.
pub(crate) struct Wire {
    pub(crate) line: Line,
    /// Time of the servos.
    pub(crate) now: Instant,
    /// Whether the answers of the servos are lost.
    pub(crate) mute: bool,
    said: Vec<u8>,
}

impl Wire {
    pub(crate) fn new(line: Line, now: Instant) -> Self {
        Self { line, now, mute: false, said: Vec::with_capacity(4096) }
    }
}

impl Port for Wire {
    fn send(&mut self, bytes: &[u8], _within: Duration) -> Result<Sent, LineLostError> {
        self.said.clear();
        self.line.hear(self.now, bytes, &mut self.said);
        Ok(Sent { at: self.now, late: 0 })
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        _within: Duration,
        _until: Instant,
    ) -> Result<Received, LineLostError> {
        let count = if self.mute { 0 } else { self.said.len().min(into.len()) };
        for (place, byte) in into.iter_mut().zip(self.said.drain(..count)) {
            *place = byte;
        }
        Ok(Received { count, at: self.now })
    }
}
