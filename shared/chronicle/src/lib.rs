//! What was believed when, by whom, and how the perspectives differ.
//!
//! Told from belief buffers, instant by instant: for people as a timeline with a table at its end
//! ([`Timeline`]), for programs as JSON lines ([`JsonLines`]). Both write into a string and open
//! nothing.

mod json;
mod mind;
mod summary;
mod table;
#[cfg(test)]
mod tests;
mod timeline;
mod words;

pub use json::JsonLines;
pub use mind::Mind;
pub use summary::{Refusal, Summary};
pub use timeline::Timeline;
