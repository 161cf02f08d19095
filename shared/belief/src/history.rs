//! History functions h and their generators G (Eq. 3): what a belief remembers of one percept.

mod low_pass;
mod series;
#[cfg(test)]
mod tests;

use clock::Instant;
use config::percepts::{self, WhenFull};
use low_pass::LowPass;
use message::Feature;
pub(crate) use series::{Series, Thinning};

use crate::sample::Sample;

/// h: the remembered evaluation of one percept at any instant.
///
/// Before the first sample there is none; between two the earlier holds; after the last it
/// holds while its confidence decays.
#[derive(Clone, Debug)]
pub(crate) enum History {
    /// Samples as they were: lossless, or thinned on a logarithmic time scale.
    Series(Series),
    /// The filtered present.
    LowPass(LowPass),
}

impl History {
    /// An empty history with room for all it will ever hold.
    pub(crate) fn new(generator: percepts::History) -> Self {
        match generator {
            percepts::History::Lossless { samples, when_full } => {
                let thinning = match when_full {
                    WhenFull::ForgetOldest => Thinning::ForgetOldest,
                    WhenFull::Thin => Thinning::ShortestGap,
                };
                Self::Series(Series::new(samples.get(), thinning))
            }
            percepts::History::LogTimescale { samples } => {
                Self::Series(Series::new(samples.get(), Thinning::Octaves))
            }
            percepts::History::LowPass { share } => Self::LowPass(LowPass::new(share.get())),
        }
    }

    /// How many samples it holds at most.
    pub(crate) fn room(&self) -> usize {
        match self {
            Self::Series(series) => series.room(),
            Self::LowPass(_) => 1,
        }
    }

    /// g(m, c, d) = h: begins anew with one sample.
    pub(crate) fn begin(&mut self, sample: Sample) {
        match self {
            Self::Series(series) => series.begin(sample),
            Self::LowPass(filter) => filter.begin(sample),
        }
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        match self {
            Self::Series(series) => series.clear(),
            Self::LowPass(filter) => filter.clear(),
        }
    }

    /// The union with another history of the same percept. `scratch` has room for both.
    pub(crate) fn merge(&mut self, other: &Self, scratch: &mut Vec<Sample>) {
        match (self, other) {
            (Self::Series(mine), Self::Series(other)) => mine.merge(other, scratch),
            (Self::LowPass(mine), Self::LowPass(other)) => mine.merge(other),
            // One percept has one generator in all beliefs of a system.
            (Self::Series(_), Self::LowPass(_)) | (Self::LowPass(_), Self::Series(_)) => {}
        }
    }

    /// h(t), and its sample's instant.
    pub(crate) fn at(&self, instant: Instant, decay_per_s: f64) -> Option<Sample> {
        match self {
            Self::Series(series) => series.at(instant, decay_per_s),
            Self::LowPass(filter) => filter.at(instant, decay_per_s),
        }
    }

    /// The newest evaluation, undecayed.
    pub(crate) fn newest(&self) -> Option<Sample> {
        match self {
            Self::Series(series) => series.newest(),
            Self::LowPass(filter) => filter.newest(),
        }
    }

    /// Replaces every remembered feature.
    pub(crate) fn map(&mut self, change: impl Fn(Feature) -> Feature) {
        match self {
            Self::Series(series) => series.map(change),
            Self::LowPass(filter) => filter.map(change),
        }
    }
}
