//! Conversion of the robot's buffers into the state shown on the pages. No I/O.

mod arming;
mod belief;
mod history;
mod joints;
mod line;
mod scene;
mod task;

pub(crate) use arming::arming;
pub(crate) use belief::{BeliefRenderer, Seen, belief_in, counterpart};
pub(crate) use history::TimeLines;
pub(crate) use joints::joints;
pub(crate) use line::Lines;
pub(crate) use scene::{Thing, scene};
pub(crate) use task::tasks;

/// Positions are rounded to 0.1 mm.
const POSITION_PARTS: f64 = 1e4;

/// Rounds to `1 / parts`; `None` for NaN and infinities.
pub(crate) fn rounded(value: f64, parts: f64) -> Option<f64> {
    // Adding 0.0 turns -0 into 0.
    value.is_finite().then(|| (value * parts).round() / parts + 0.0)
}

/// Rounds each number to 1e-4.
pub(crate) fn numbers<const N: usize>(values: [f64; N]) -> [Option<f64>; N] {
    values.map(|value| rounded(value, POSITION_PARTS))
}
