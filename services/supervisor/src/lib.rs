//! Supervisor: starts, watches, restarts and stops the processes; the conductor of lockstep time.

mod caretaker;
mod children;
pub mod policy;
mod run;

pub use children::Children;
pub use run::{ORDER, Orders, RunError, run};
