//! Resource limits for untrusted input.
//!
//! A file or a pipe may come from an untrusted source. A few hundred kilobytes can expand to gigabytes, and a line
//! may never end. All readers use this crate: [`text`] for a file that is read as a whole, [`Lines`] for line by
//! line, and a [`Budget`] for data that is decompressed or kept. Exceeding a limit is a [`BudgetError`] that names
//! the limit and a remedy.

mod error;
mod lines;
mod spending;
mod text;

pub use error::BudgetError;
pub use lines::Lines;
pub use spending::Budget;
pub use text::{encoding_fault, other_encoding, read_text, text};

/// Maximum size of a configuration file in bytes, including lessons, bodies and tables. The largest one shipped with
/// the program has a fortieth of it.
pub const CONFIGURATION_BYTES: u64 = 4 << 20;
