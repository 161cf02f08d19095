#![doc = include_str!("../README.md")]

mod assignment;
mod clear_mot;
mod hota;
mod identity;
mod sequence;
mod similarity;

pub use clear_mot::ClearMot;
pub use hota::{ALPHAS, Hota, HotaAtAlpha};
pub use identity::Identity;
pub use sequence::{FrameError, Sequence};
pub use similarity::{ImageBox, distance_similarity};

/// A similarity that misses a threshold by less than this still reaches it, as in `TrackEval`: rounding must not decide.
const TOLERANCE: f64 = f64::EPSILON;

/// `part / whole`; `None` if `whole` is zero.
fn ratio(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}
