use std::ffi::CString;
use std::fs;
use std::path::Path;

use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};
use rustix::thread::set_name;

/// Why a process cannot be tied to its parent.
#[derive(Debug, thiserror::Error)]
pub enum ParentError {
    /// The kernel refused.
    #[error("cannot ask for a signal when the parent dies: {0}")]
    Refused(#[from] rustix::io::Errno),
    /// The parent died before it could be asked for.
    #[error("the parent, process {expected}, is already dead")]
    Gone {
        /// The parent's process number.
        expected: i32,
    },
}

/// Has this process killed (`SIGKILL`) as soon as its parent `expected` dies.
///
/// To be called first thing in the main thread of a child, with the process number that its
/// parent passed on: a parent that died between the start of the child and this call is noticed
/// by that number no longer being the parent's.
///
/// # Errors
///
/// The kernel refused, or the parent is dead.
pub fn die_with_parent(expected: i32) -> Result<(), ParentError> {
    signal_at_parents_death(expected, Signal::KILL)
}

/// Has this process told to stop (`SIGTERM`) as soon as its parent `expected` dies: it ends in order, and lives as long
/// as that takes. To be called as [`die_with_parent`], when `SIGTERM` is handled already.
///
/// # Errors
///
/// The kernel refused, or the parent is dead: then no signal comes.
pub fn stop_with_parent(expected: i32) -> Result<(), ParentError> {
    signal_at_parents_death(expected, Signal::TERM)
}

fn signal_at_parents_death(expected: i32, signal: Signal) -> Result<(), ParentError> {
    set_parent_process_death_signal(Some(signal))?;
    if is_parent(expected) { Ok(()) } else { Err(ParentError::Gone { expected }) }
}

/// Whether the parent of this process is `expected`, and therefore lives.
#[must_use]
pub fn is_parent(expected: i32) -> bool {
    getppid().map(Pid::as_raw_pid) == Some(expected)
}

/// Lets the kernel end this process before others of the robot when memory runs out. It needs no right: a process may
/// always make itself more killable. Processes that hold the servos' lines do not call it.
pub fn prefer_out_of_memory_kill() {
    const FILE: &str = "/proc/self/oom_score_adj";
    /// Of 1000: more than any difference in size on a machine that has room for the robot.
    const MORE: i32 = 300;
    const MOST: i32 = 1000;
    let now = fs::read_to_string(FILE).ok().and_then(|text| text.trim().parse::<i32>().ok());
    // Where /proc is not there, the kernel decides by size alone.
    let _written = fs::write(FILE, (now.unwrap_or(0) + MORE).min(MOST).to_string());
}

/// Calls this process what its command line does, for `ps` and the like: the kernel calls one that was
/// started from a running program `exe`, after the link that leads to it.
///
/// To be called in the main thread.
pub fn take_name() {
    let program = std::env::args_os().next().unwrap_or_default();
    let name = Path::new(&program).file_name().unwrap_or_default();
    // It is for people alone.
    let _called = CString::new(name.as_encoded_bytes()).map(|name| set_name(&name));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_whose_parent_is_another_is_told_so() {
        assert!(matches!(die_with_parent(-7), Err(ParentError::Gone { expected: -7 })));
        assert!(matches!(stop_with_parent(-7), Err(ParentError::Gone { expected: -7 })));
        set_parent_process_death_signal(None).unwrap();
    }
}
