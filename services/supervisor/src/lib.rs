//! Supervisor: starts, watches, restarts and stops the processes; the conductor of lockstep time.

mod caretaker;
mod check;
mod children;
pub mod policy;
pub mod readiness;
mod run;

pub use check::check;
pub use children::Children;
pub use run::{ORDER, Orders, RunError, run};
