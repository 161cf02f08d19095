//! Traces: recorded observations that can be replayed.
//!
//! A trace is a sequence of frames; a frame holds what one source observed at one instant. There are two formats with
//! the same content: JSON lines for people and scripts, and MCAP for common viewers. `docs/traces.md` describes both.
//!
//! A trace is untrusted input. What cannot be parsed is an error that names the file, the line or message, the column
//! and the field, and states what would be valid. What can be parsed but not used (a confidence of 7, a position that
//! is not a number, a frame out of order) is rejected with a reason and counted. Reading continues after it, as in the
//! robot's own sensor process.

mod error;
mod frame;
mod instants;
mod json;
mod lines;
mod playback;
mod reader;
mod records;
mod rejection;
mod serialized;
#[cfg(test)]
mod tests;

pub use error::{Place, TraceError};
pub use frame::Frame;
pub use instants::FramesByInstant;
pub use json::{JsonError, read_json};
pub use playback::{Playback, PlaybackError};
pub use reader::{Reader, Truncation};
pub use rejection::{Rejections, TraceRejectReason};
