//! Leo's configuration files and lessons, parsed into typed values.
//!
//! This crate composes a robot's files. The settings of a domain, such as those of [`belief`] or [`perspective`], are
//! types of that domain's crate, which also checks them.
//!
//! Every key is required, has its unit in its name and is documented where it stands in `config/`. An unknown key is an
//! error with a suggestion, and the name of an older version an error with its successor. Every error names the file,
//! the line and the field, and states what would be valid. A file is accepted whole or rejected whole.

pub mod campaign;
pub mod faults;
mod files;
pub mod leo;
pub mod lesson;
mod load;
mod migrated;
pub mod motor;
mod names;
mod overrides;
#[cfg(test)]
mod renamed_tests;
mod robot;
#[cfg(test)]
mod test_support;
mod unread;

pub use files::{FileSource, Files, read_files};
pub use load::{load, text};
pub use migrated::Migration;
pub use names::Names;
pub use robot::Robot;
pub use settings::{SettingsError, closest, parse, plain, suggest};
pub use unread::UnreadFile;
