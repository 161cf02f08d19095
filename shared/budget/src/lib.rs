//! Bounds on what is read from outside.
//!
//! A file or a pipe comes from a stranger. A few hundred kilobytes of it can expand to gigabytes, and a line need not
//! end. Everything that reads one goes through this crate: [`text`] for a file that is read whole, [`Lines`] for what is
//! read line by line, and a [`Budget`] for what is decompressed or kept. What exceeds its bound is a [`BudgetError`]
//! that names the bound and says what to do.

mod error;
mod lines;
mod spending;
mod text;

pub use error::BudgetError;
pub use lines::Lines;
pub use spending::Budget;
pub use text::{read_text, text};

/// The longest file of configuration that is read, in bytes: lessons, bodies and tables included. The longest one that
/// comes with the program needs a fortieth of it.
pub const CONFIGURATION_BYTES: u64 = 4 << 20;
