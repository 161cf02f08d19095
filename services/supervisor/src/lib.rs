//! The supervisor starts, monitors, restarts and stops the processes. It also conducts runs in lockstep time.

mod faults;
mod io;
pub mod policy;
pub mod readiness;
mod unlisted;

pub use faults::{ProcessFaults, UnknownProcessError};
pub use io::check::{ApplyError, CheckError, CheckOptions, CoreError, MachineChange, check, check_cores};
pub use io::children::Children;
pub use io::guard::guard;
pub use io::lockstep_processes::LockstepError;
pub use io::replay::{FrameCounts, Mismatch, ReplayOptions, ReplayReport, replay};
pub use io::roster_publisher::RosterPublisher;
pub use io::run::{ORDER, RunError, RunOptions, run};
pub use io::tape::Record;
pub use io::teach::{LessonOptions, teach};
pub use io::{bench, conductor};
