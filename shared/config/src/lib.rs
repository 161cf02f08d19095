//! Leo's configuration files and lessons, parsed into typed values.
//!
//! Every key is required, has its unit in its name and is documented where it stands in `config/`. An unknown key is an
//! error with a suggestion, and the name of an older version an error with its successor. Every error names the file,
//! the line and the field, and states what would be valid. A file is accepted whole or rejected whole.

pub mod campaign;
mod error;
pub mod faults;
mod files;
pub mod leo;
pub mod lesson;
mod load;
mod migrated;
pub mod motor;
mod names;
pub mod number;
pub mod percepts;
pub mod perspective;
mod renamed;
mod robot;

pub use error::ConfigError;
pub use files::Files;
pub use load::{load, parse, suggest, text};
pub use migrated::Migration;
pub use names::Names;
pub use robot::Robot;
