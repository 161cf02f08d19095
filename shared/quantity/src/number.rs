//! Conversions between number types, each named for what it does where the target is narrower.
//!
//! They exist so that a lossy `as` appears in this file alone.

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

/// The nearest `f32`; infinite where the value is out of its range.
#[must_use]
pub const fn single(value: f64) -> f32 {
    value as f32
}

/// Towards zero, saturating; zero for NaN and for negative numbers.
#[must_use]
pub const fn floor_u64(value: f64) -> u64 {
    value as u64
}

/// Towards zero, saturating; zero for NaN and for negative numbers.
#[must_use]
pub const fn floor_usize(value: f64) -> usize {
    value as usize
}

/// To the next whole number below, saturating; zero for NaN.
#[must_use]
pub const fn floor_i64(value: f64) -> i64 {
    // Towards zero, and one less where that was upwards: quicker than to floor a float.
    let truncated = value as i64;
    if value < truncated as f64 { truncated.saturating_sub(1) } else { truncated }
}

/// To the nearest whole number, halves away from zero, saturating; zero for NaN.
#[must_use]
pub fn round_i32(value: f64) -> i32 {
    value.round() as i32
}

/// To the nearest whole number, halves away from zero, saturating; zero for NaN.
#[must_use]
pub fn round_i64(value: f64) -> i64 {
    value.round() as i64
}

/// So many of something, in words.
///
/// ```
/// assert_eq!(quantity::number::counted(1, "example"), "1 example");
/// assert_eq!(quantity::number::counted(2, "example"), "2 examples");
/// ```
#[must_use]
pub fn counted(count: u32, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// The value, or `u32::MAX` where it does not fit.
#[must_use]
pub fn saturating_u32(value: usize) -> u32 {
    u32::try_from(value).unwrap_or(u32::MAX)
}

/// The value, or `u16::MAX` where it does not fit.
#[must_use]
pub fn saturating_u16(value: usize) -> u16 {
    u16::try_from(value).unwrap_or(u16::MAX)
}
