//! The settings of the belief distance.

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
