//! The supervisor starts, monitors, restarts and stops the processes. It also conducts runs in lockstep time.

pub mod bench;
mod caretaker;
mod check;
mod children;
mod class;
pub mod conductor;
mod faults;
mod guard;
mod lives;
mod memory_watch;
pub mod policy;
pub mod readiness;
mod replay;
mod run;
mod serial_lines;
mod service_manager;
mod signals;
mod stop_by_any_user;
mod tape;
mod teach;

pub use check::{ApplyError, CheckError, Deed, Inquiry, check};
pub use children::Children;
pub use class::ClassError;
pub use faults::{ProcessFaults, UnknownProcess};
pub use guard::guard;
pub use lives::Lives;
pub use replay::{Paired, Played, ReplayError, Replaying, Wrong, replay};
pub use run::{ORDER, Orders, RunError, run};
pub use tape::Record;
pub use teach::{TeachError, Teaching, teach};
