use std::ffi::CString;
use std::path::Path;

use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};
use rustix::thread::set_name;

/// Why a process cannot be tied to its parent.
#[derive(Debug, thiserror::Error)]
pub enum ParentError {
    /// The kernel refused.
    #[error("cannot ask to be killed when the parent dies: {0}")]
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
    set_parent_process_death_signal(Some(Signal::KILL))?;
    if getppid().map(Pid::as_raw_pid) == Some(expected) {
        Ok(())
    } else {
        Err(ParentError::Gone { expected })
    }
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
        set_parent_process_death_signal(None).unwrap();
    }
}
