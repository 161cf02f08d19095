//! Number conversions with defined behaviour at the limits, the distance of two points, and colours of sRGB.

pub mod number;
pub mod srgb;

/// The Euclidean distance of two points, in the unit of their coordinates.
///
/// ```
/// assert_eq!(quantity::distance(&[1.0_f32, 2.0], &[4.0, 6.0]), 5.0);
/// ```
#[must_use]
#[inline]
pub fn distance<T: Copy + Into<f64>, const N: usize>(one: &[T; N], other: &[T; N]) -> f64 {
    let squared = one.iter().zip(other).map(|(a, b)| ((*a).into() - (*b).into()).powi(2));
    squared.sum::<f64>().sqrt()
}
