//! Reports of the beliefs over time, by perspective, and of the differences between perspectives.
//!
//! The input is belief buffers, instant by instant. For people there is a timeline with a final table ([`Timeline`]),
//! or live sentences about divergences between a partner and the robot ([`DivergenceReporter`]). For programs there are
//! JSON lines ([`JsonLines`]).

mod divergence;
mod json;
mod perspective_record;
mod phrases;
mod summary;
mod table;
#[cfg(test)]
mod tests;
mod timeline;

pub use divergence::DivergenceReporter;
pub use json::JsonLines;
pub use perspective_record::PerspectiveRecord;
pub use phrases::{PerceptPhrases, perspective_name};
pub use summary::{Refusal, Summary};
pub use timeline::Timeline;

/// A report of the beliefs over time, which grows instant by instant.
pub trait BeliefReport {
    /// Appends what is to be reported of an instant to `out`.
    fn append(&mut self, at_ns: u64, minds: &[PerspectiveRecord<'_>], out: &mut String);

    /// Appends the end of the report to `out`.
    fn finish(&self, minds: &[PerspectiveRecord<'_>], summary: &Summary, out: &mut String);
}
