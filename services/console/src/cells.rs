//! What the pages are shown, from what the robot's buffers hold: pure.

mod arming;
mod belief;
mod history;
mod joints;
mod line;
mod scene;
mod task;

pub(crate) use arming::arming;
pub(crate) use belief::{Minds, Seen, belief_in, twin};
pub(crate) use history::Histories;
pub(crate) use joints::joints;
pub(crate) use line::Lines;
pub(crate) use scene::{Thing, scene};
pub(crate) use task::tasks;

/// Places are shown to a tenth of a millimetre.
const PLACE: f64 = 1e4;

/// A number to so many parts of one; none where it is no number.
pub(crate) fn rounded(value: f64, parts: f64) -> Option<f64> {
    // What rounds to zero is zero, and never -0.
    value.is_finite().then(|| (value * parts).round() / parts + 0.0)
}

/// How far two points are apart.
fn far<const N: usize>(one: [f64; N], other: [f64; N]) -> f64 {
    one.iter().zip(other).map(|(one, other)| (one - other).powi(2)).sum::<f64>().sqrt()
}

/// Numbers to a tenth of a thousandth.
pub(crate) fn numbers<const N: usize>(values: [f64; N]) -> [Option<f64>; N] {
    values.map(|value| rounded(value, PLACE))
}
