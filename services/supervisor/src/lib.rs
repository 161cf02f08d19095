//! The supervisor starts, monitors, restarts and stops the processes. It also conducts runs in lockstep time.

mod faults;
mod io;
pub mod policy;
pub mod readiness;

pub use faults::{ProcessFaults, UnknownProcess};
pub use io::check::{ApplyError, CheckError, Deed, Inquiry, check};
pub use io::children::Children;
pub use io::class::ClassError;
pub use io::guard::guard;
pub use io::lives::Lives;
pub use io::replay::{Paired, Played, ReplayError, Replaying, Wrong, replay};
pub use io::run::{ORDER, Orders, RunError, run};
pub use io::tape::Record;
pub use io::teach::{TeachError, Teaching, teach};
pub use io::{bench, conductor};
