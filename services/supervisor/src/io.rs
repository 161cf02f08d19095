//! All input and output of this process: shared memory, files, devices, the clock and other processes.

pub mod bench;
pub(crate) mod check;
pub(crate) mod children;
pub mod conductor;
pub(crate) mod guard;
pub(crate) mod janitor_thread;
pub(crate) mod lockstep_processes;
pub(crate) mod memory_watch;
pub(crate) mod replay;
pub(crate) mod roster_publisher;
pub(crate) mod run;
pub(crate) mod serial_lines;
pub(crate) mod service_manager;
pub(crate) mod signals;
pub(crate) mod stop_by_any_user;
pub(crate) mod system;
pub(crate) mod tape;
pub(crate) mod teach;
