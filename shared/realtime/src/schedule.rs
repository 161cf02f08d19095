use std::io;

/// Sets the scheduling policy and priority of a thread; 0 is the calling thread.
pub(crate) fn schedule(thread: i32, policy: i32, priority: i32) -> io::Result<()> {
    let parameters = libc::sched_param { sched_priority: priority };
    // SAFETY: `parameters` lives across the call, which only reads it.
    if unsafe { libc::sched_setscheduler(thread, policy, &raw const parameters) } == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}

/// The scheduling policy of a thread; 0 is the calling thread.
pub(crate) fn policy(thread: i32) -> i32 {
    // SAFETY: sched_getscheduler(2) takes and returns plain numbers.
    unsafe { libc::sched_getscheduler(thread) }
}
