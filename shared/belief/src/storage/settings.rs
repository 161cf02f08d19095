//! The settings of the histories.

use serde::Deserialize;
use settings::number::{Capacity, UnitInterval};

/// A history generator g of G (between Eqs. 3 and 4).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum History {
    /// Every sample, exactly, up to the capacity.
    Lossless {
        /// Maximum number of samples.
        samples: Capacity,
        /// Which sample is dropped when full.
        when_full: WhenFull,
    },
    /// y = a·x + (1 − a)·y: the current value only, no past.
    LowPass {
        /// a: the weight of the newest sample.
        alpha: UnitInterval,
    },
    /// Samples thinned with age: a query for any age returns a sample whose age is within a factor of two.
    LogTimescale {
        /// Maximum number of samples; two per octave of age are needed.
        samples: Capacity,
    },
    /// A history generator that the program registers under this name.
    Plugin(String),
}

/// Which sample a full lossless history drops.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WhenFull {
    /// The oldest sample.
    ForgetOldest,
    /// The inner sample whose removal leaves the shortest gap; among equal ones the oldest.
    Thin,
}
