//! Supervisor: starts, watches, restarts and stops the processes; the conductor of lockstep time.

pub mod bench;
mod caretaker;
mod check;
mod children;
pub mod conductor;
mod faults;
pub mod policy;
pub mod readiness;
mod run;
mod service_manager;
mod teach;

pub use check::{ApplyError, CheckError, Deed, Inquiry, check};
pub use children::Children;
pub use faults::{ProcessFaults, UnknownProcess};
pub use run::{ORDER, Orders, RunError, run};
pub use teach::{TeachError, Teaching, teach};
