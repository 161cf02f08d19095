//! The files of Leo: configuration and lessons, typed.
//!
//! Every key is required, carries its unit in its name and is documented where it stands in
//! `config/`; an unknown key is an error with a suggestion. Every error names the file, the line
//! and the field, and says what would be right. Nothing is half-applied: a file is read whole or
//! refused whole.

pub mod campaign;
mod error;
pub mod faults;
mod files;
mod forward;
pub mod leo;
pub mod lesson;
mod load;
pub mod motor;
mod names;
pub mod number;
pub mod percepts;
pub mod perspective;
mod robot;

pub use error::ConfigError;
pub use files::Files;
pub use forward::Forward;
pub use load::{load, parse, suggest, text};
pub use names::Names;
pub use robot::Robot;
