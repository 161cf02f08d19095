//! Tests that need a program or a right that a machine may lack.
//!
//! Such a test calls [`skip`] and returns. With [`NOTHING`] in its environment it fails instead, as continuous
//! integration wants.

use std::fmt::Display;

/// The environment variable with which no test may be skipped.
pub const NOTHING: &str = "LEO_SKIP_NOTHING";

/// Says on standard error why a test is skipped.
///
/// # Panics
///
/// [`NOTHING`] is set.
#[expect(clippy::print_stderr, reason = "the harness shows what a test prints there")]
pub fn skip(reason: impl Display) {
    assert!(std::env::var_os(NOTHING).is_none(), "nothing may be skipped here, and {reason}");
    eprintln!("SKIPPED: {reason}");
}
