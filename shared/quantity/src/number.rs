//! Number conversions, each named after its behaviour when the target type is narrower.
//!
//! Lossy `as` casts are allowed in this file only.

#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "this module is where such casts live: every function says what it does at the edges"
)]

/// The nearest `f64`; exact below 2^53.
#[must_use]
pub const fn float(value: u64) -> f64 {
    value as f64
}

/// The nearest `f64` of a count; exact below 2^53.
#[must_use]
pub const fn float_of_count(value: usize) -> f64 {
    value as f64
}

/// The nearest `f64` of a signed number; exact within ±2^53.
#[must_use]
pub const fn float_of_signed(value: i64) -> f64 {
    value as f64
}

/// The nearest `f32`; infinite if the value is out of range.
#[must_use]
pub const fn single(value: f64) -> f32 {
    value as f32
}

/// Rounds towards zero and saturates; zero for NaN and for negative numbers.
#[must_use]
pub const fn floor_usize(value: f64) -> usize {
    value as usize
}

/// Rounds down and saturates; zero for NaN.
#[must_use]
pub const fn floor_i64(value: f64) -> i64 {
    // Truncates, and corrects values that were rounded up: faster than `floor` of a float.
    let truncated = value as i64;
    if value < truncated as f64 { truncated.saturating_sub(1) } else { truncated }
}

/// Rounds to the nearest integer, halves away from zero, and saturates; zero for NaN.
#[must_use]
pub fn round_i32(value: f64) -> i32 {
    value.round() as i32
}

/// Rounds to the nearest integer, halves away from zero, and saturates; zero for NaN.
#[must_use]
pub fn round_i64(value: f64) -> i64 {
    value.round() as i64
}

/// A count with its noun, in the plural unless the count is one.
///
/// ```
/// assert_eq!(quantity::number::counted(1_u32, "example"), "1 example");
/// assert_eq!(quantity::number::counted(2_u64, "example"), "2 examples");
/// ```
#[must_use]
pub fn counted(count: impl Into<u64>, noun: &str) -> String {
    let count = count.into();
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// A count with words for one and words for another number.
///
/// ```
/// assert_eq!(quantity::number::counted_with(1_u32, "servo says", "servos say"), "1 servo says");
/// assert_eq!(quantity::number::counted_with(0_u32, "servo says", "servos say"), "0 servos say");
/// ```
#[must_use]
pub fn counted_with(count: impl Into<u64>, one: &str, other: &str) -> String {
    let count = count.into();
    format!("{count} {}", if count == 1 { one } else { other })
}

/// The value, saturating at `u64::MAX`.
#[must_use]
pub fn saturating_u64(value: usize) -> u64 {
    u64::try_from(value).unwrap_or(u64::MAX)
}

/// The value, saturating at `u32::MAX`.
#[must_use]
pub fn saturating_u32(value: usize) -> u32 {
    u32::try_from(value).unwrap_or(u32::MAX)
}

/// The value, saturating at `u16::MAX`.
#[must_use]
pub fn saturating_u16(value: usize) -> u16 {
    u16::try_from(value).unwrap_or(u16::MAX)
}
