//! Typed settings from TOML.
//!
//! A domain crate defines its settings as types that implement [`serde::Deserialize`], and checks them where they are
//! defined. This crate parses them from text; the caller reads the file. An error about the text gives the file, the
//! line, the column and what would be valid. The types in [`number`] carry their range.

mod error;
pub mod number;
mod parse;
mod plain;
mod renamed;
mod similar;

pub use error::{SettingsError, SpannedError};
pub use parse::{error_at, parse, suggest, value_span};
pub use plain::plain;
pub use renamed::{RENAMED, renaming};
pub use similar::closest;
pub use toml::Spanned;
