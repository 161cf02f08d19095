use std::ffi::CString;
use std::fs;
use std::path::Path;

use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};
use rustix::thread::set_name;

/// Error while tying a process to its parent.
#[derive(Debug, thiserror::Error)]
pub enum ParentError {
    /// The kernel refused.
    #[error("cannot ask for a signal when the parent dies: {0}")]
    Refused(#[from] rustix::io::Errno),
    /// The parent had already died.
    #[error("the parent, process {expected}, is already dead")]
    Gone {
        /// The parent's process id.
        expected: i32,
    },
}

/// Arranges that this process is killed (`SIGKILL`) as soon as its parent `expected` dies.
///
/// To be called first in the main thread of a child, with the process id of its parent. If the parent has died before
/// this call, its process id is no longer that of the current parent, which is an error.
///
/// # Errors
///
/// The kernel refused, or the parent has died.
pub fn die_with_parent(expected: i32) -> Result<(), ParentError> {
    signal_at_parents_death(expected, Signal::KILL)
}

/// Arranges that this process gets `SIGTERM` as soon as its parent `expected` dies, so that it can shut down in
/// order. To be called like [`die_with_parent`], after a handler of `SIGTERM` is installed.
///
/// # Errors
///
/// The kernel refused, or the parent has died. In both cases no signal will arrive.
pub fn stop_with_parent(expected: i32) -> Result<(), ParentError> {
    signal_at_parents_death(expected, Signal::TERM)
}

fn signal_at_parents_death(expected: i32, signal: Signal) -> Result<(), ParentError> {
    set_parent_process_death_signal(Some(signal))?;
    if is_parent(expected) { Ok(()) } else { Err(ParentError::Gone { expected }) }
}

/// Whether the parent of this process is `expected`, so that the parent still runs.
#[must_use]
pub fn is_parent(expected: i32) -> bool {
    getppid().map(Pid::as_raw_pid) == Some(expected)
}

/// Makes the kernel kill this process before others of the robot if memory runs out. It needs no right, because a
/// process may always raise its own score. The processes that hold the servos' serial lines do not call it.
pub fn prefer_out_of_memory_kill() {
    const FILE: &str = "/proc/self/oom_score_adj";
    /// In thousandths of the memory: more than any difference in size on a machine that is large enough for the
    /// robot.
    const MORE: i32 = 300;
    const MAX_SCORE: i32 = 1000;
    let now = fs::read_to_string(FILE).ok().and_then(|text| text.trim().parse::<i32>().ok());
    // Without /proc, the kernel decides by size alone.
    let _written = fs::write(FILE, (now.unwrap_or(0) + MORE).min(MAX_SCORE).to_string());
}

/// Sets the process name for `ps` to that of the command line. For a process started from `/proc/self/exe`, the
/// kernel uses the name `exe`.
///
/// To be called in the main thread.
pub fn set_process_name() {
    let program = std::env::args_os().next().unwrap_or_default();
    let name = Path::new(&program).file_name().unwrap_or_default();
    // The name only informs people, so ignore errors.
    let _called = CString::new(name.as_encoded_bytes()).map(|name| set_name(&name));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_with_another_parent_is_refused() {
        assert!(matches!(die_with_parent(-7), Err(ParentError::Gone { expected: -7 })));
        assert!(matches!(stop_with_parent(-7), Err(ParentError::Gone { expected: -7 })));
        set_parent_process_death_signal(None).unwrap();
    }
}
