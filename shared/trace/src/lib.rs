//! Traces: recorded observations, to be believed again.
//!
//! A trace holds frames, each what one source observed at one instant. It has two forms with the
//! same content: JSON lines for people and scripts, and MCAP, which common viewers open.
//! `docs/traces.md` describes both for whoever makes one.
//!
//! A trace comes from a stranger. What cannot be read is one error that names the file, the line
//! or message, the column and the field, and says what would be right. What can be read but not
//! be used (a confidence of 7, a place that is no number, a frame out of order) is refused with
//! its reason, counted, and the rest goes on, as in the robot's own sensor process.

mod error;
mod frame;
mod instants;
mod json;
mod lines;
mod playback;
mod reader;
mod records;
mod refusal;
#[cfg(test)]
mod tests;
mod writer;
mod written;

pub use error::{Place, TraceError};
pub use frame::Frame;
pub use instants::Instants;
pub use playback::{Playback, PlaybackError};
pub use reader::Reader;
pub use refusal::{Reason, Refused};
pub use writer::Writer;
