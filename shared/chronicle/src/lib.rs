//! What was believed when, by whom, and how the perspectives differ.
//!
//! Told from belief buffers, instant by instant: for people as a timeline with a table at its end
//! ([`Timeline`]) or, while it happens, as sentences about what divides a partner and the robot
//! ([`Divide`]); for programs as JSON lines ([`JsonLines`]). All write into strings and open nothing.

mod divide;
mod json;
mod mind;
mod summary;
mod table;
#[cfg(test)]
mod tests;
mod timeline;
mod words;

pub use divide::Divide;
pub use json::JsonLines;
pub use mind::Mind;
pub use summary::{Refusal, Summary};
pub use timeline::Timeline;
pub use words::Words;
