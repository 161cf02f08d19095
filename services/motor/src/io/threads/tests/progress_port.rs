use std::sync::{Arc, Mutex};

use clock::{Duration, Instant};
use mock_bus_process::Servos;
use serial::LineLostError;

use crate::{Line, Port, Received, Sent};

/// Polling period of the servos' progress.
const LOOK: Duration = Duration::from_micros(100);

/// A line to servos in simulated time. A reply timeout occurs as soon as the servos have processed all bytes sent,
/// and all their bytes were received. So a slow machine never makes a servo look silent, and a silent servo costs no
/// waiting.
pub(super) struct ProgressPort {
    line: Line,
    servos: Arc<Mutex<Servos>>,
    sent: usize,
    received: usize,
}

impl ProgressPort {
    pub(super) const fn new(line: Line, servos: Arc<Mutex<Servos>>) -> Self {
        Self { line, servos, sent: 0, received: 0 }
    }

    /// Whether the servos have processed all bytes sent since the pseudo-terminal was opened, and all their replies were
    /// received.
    fn is_done(&self) -> bool {
        let servos = self.servos.lock().unwrap();
        let is_due = servos.line.arrives_at().zip(servos.simulated).is_some_and(|(at, now)| at <= now);
        !is_due && (servos.heard, servos.said) == (self.sent, self.received)
    }

    fn note<T>(&mut self, result: Result<T, LineLostError>) -> Result<T, LineLostError> {
        if result.is_err() {
            // A new line starts with new counters on both ends.
            (self.sent, self.received) = (0, 0);
        }
        result
    }
}

impl Port for ProgressPort {
    fn send(&mut self, bytes: &[u8], within: Duration) -> Result<Sent, LineLostError> {
        let mut late = 0;
        let give_up = clock::now() + within;
        // Bytes due meanwhile arrive before the request, or never.
        while !self.is_done() && clock::now() < give_up {
            let mut bin = [0; 512];
            let received = self.line.receive(&mut bin, LOOK, give_up);
            let count = self.note(received)?.count;
            self.received += count;
            late += count;
        }
        let sent = self.line.send(bytes, within);
        let sent = self.note(sent)?;
        self.sent += bytes.len();
        self.received += sent.late;
        Ok(Sent { late: late + sent.late, ..sent })
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        within: Duration,
        until: Instant,
    ) -> Result<Received, LineLostError> {
        let until = until.min(clock::now() + within);
        loop {
            let is_over = self.is_done() || clock::now() >= until;
            let received = self.line.receive(into, if is_over { Duration::ZERO } else { LOOK }, until);
            let received = self.note(received)?;
            self.received += received.count;
            if received.count > 0 || is_over {
                return Ok(received);
            }
        }
    }

    fn close_lost(&mut self) {
        self.line.close_lost();
    }
}
