//! Supervisor: starts, watches, restarts and stops the processes; the conductor of lockstep time.

mod caretaker;
mod children;
pub mod conductor;
pub mod policy;
mod run;
mod teach;

pub use children::Children;
pub use run::{ORDER, Orders, RunError, run};
pub use teach::{TeachError, Teaching, teach};
