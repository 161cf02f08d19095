//! Reports of the beliefs over time, by perspective, and of the differences between perspectives.
//!
//! The input is belief buffers, instant by instant. For people there is a timeline with a final table ([`Timeline`]),
//! or live sentences about divergences between a partner and the robot ([`DivergenceReporter`]); for programs there are
//! JSON lines ([`JsonLines`]). All write into strings and open no resources.

mod divide;
mod json;
mod mind;
mod summary;
mod table;
#[cfg(test)]
mod tests;
mod timeline;
mod words;

pub use divide::DivergenceReporter;
pub use json::JsonLines;
pub use mind::PerspectiveRecord;
pub use summary::{Refusal, Summary};
pub use timeline::Timeline;
pub use words::PerceptPhrases;
