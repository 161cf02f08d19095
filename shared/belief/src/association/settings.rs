//! The settings of the belief distance.

use std::time::Duration;

use serde::Deserialize;

/// The distance of two beliefs if no term applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoTermApplies {
    /// Infinite: such beliefs are never merged.
    Infinite,
    /// Zero: the empty sum, as in the paper.
    Zero,
}

/// One term w·q·d of the belief distance (Eq. 4).
#[derive(Clone, Debug, PartialEq)]
pub struct Distance {
    /// The percept that it compares; the term applies if both beliefs have it.
    pub percept: u16,
    /// The distance function.
    pub measure: Measure,
    /// w, zero or positive.
    pub weight: f64,
}

/// A belief distance function d.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Euclidean distance of two positions or of two extents.
    Metres,
    /// Angle between two orientations.
    AngleRad,
    /// Difference of two numbers.
    Difference,
    /// 1 for two different symbols, 0 for equal ones.
    Differs,
    /// A distance function that the program registers under this name.
    Plugin(String),
}

/// How the position of each belief is predicted for the instant of an observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracking {
    /// Process noise: standard deviation of the acceleration along each axis, in m/s².
    pub acceleration_sd_m_s2: f64,
    /// Standard deviation of the velocity of a thing seen once along each axis, in m/s.
    pub speed_sd_m_s: f64,
    /// Standard deviation of an observed position along each axis, in metres, if its source states none.
    pub position_sd_m: f64,
    /// The least standard deviation of an observed position, as a share of the thing's longest side.
    pub position_sd_of_size: f64,
    /// Gate of a thing seen in the previous frame: largest Mahalanobis distance of an observation.
    pub gate_sd: f64,
    /// How long a thing that is not observed is expected to move on.
    pub coast: Duration,
    /// How long a moving thing that is out of view is recognised along its way.
    pub reappear: Duration,
    /// Number of steps in a row in which one of two beliefs must be observed where the other, unobserved, is expected,
    /// before they are merged.
    pub merge_after: u32,
    /// Number of sightings after which a belief is announced: it becomes one of the system's beliefs for others. A belief
    /// that begins in one of the first so many frames of its source is announced at once.
    pub announce_after: u32,
    /// A single observation of at least this confidence announces its belief too.
    pub announce_confidence: f64,
}

/// All settings of the belief distance D (Eq. 4).
#[derive(Clone, Copy, Debug)]
pub(crate) struct MetricSettings<'a> {
    /// Two beliefs whose D is below it are merged.
    pub(crate) threshold: f64,
    /// Whether D is divided by the sum of the weights of the terms that apply.
    pub(crate) normalised: bool,
    pub(crate) no_term_applies: NoTermApplies,
    pub(crate) distance: &'a [Distance],
}
