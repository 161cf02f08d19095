//! One request over one line: part by part, each answered before the next.

use clock::Duration;
use serial::Lost;
use servo::{Parser, Status};

use crate::{Replies, Request};

/// A servo bus, as bytes.
pub trait Port {
    /// Throws away what waits to be read and sends; the time for the answers begins: `within`.
    ///
    /// # Errors
    ///
    /// The line is gone.
    fn send(&mut self, bytes: &[u8], within: Duration) -> Result<(), Lost>;

    /// Waits for bytes: zero when the time for the answers is over.
    ///
    /// # Errors
    ///
    /// The line is gone.
    fn receive(&mut self, into: &mut [u8]) -> Result<usize, Lost>;
}

/// Carries out a request: sends each part, and collects its answers until all are there or
/// `patience` has passed beyond the time that they need on a wire of `baud` bits per second.
pub fn exchange(
    port: &mut impl Port,
    parser: &mut Parser,
    request: &Request,
    baud: u32,
    patience: Duration,
    replies: &mut Replies,
) {
    replies.clear();
    for (index, (part, bytes)) in request.parts().enumerate() {
        parser.clear();
        if let Err(lost) = port.send(bytes, part.time_on_wire(baud) + patience) {
            replies.lose(lost);
            return;
        }
        let mut missing = part.answers;
        while missing > 0 {
            let mut buffer = [0; 512];
            match port.receive(&mut buffer) {
                Ok(0) => break,
                Ok(count) => parser.push(buffer.get(..count).unwrap_or_default()),
                Err(lost) => {
                    replies.lose(lost);
                    return;
                }
            }
            while let Some(frame) = parser.next_frame() {
                // An adapter that echoes gives instructions back; those are not answers.
                if let Some(status) = Status::parse(&frame) {
                    replies.add(index, &status);
                    missing = missing.saturating_sub(1);
                }
            }
        }
    }
}
