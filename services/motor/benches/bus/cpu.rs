//! Processor time of threads as counted by the kernel, including time in the kernel.

use std::fs;
use std::path::Path;

use clock::Duration;

/// Processor time of a thread so far.
fn of(task: &Path) -> Option<Duration> {
    let said = fs::read_to_string(task.join("schedstat")).ok()?;
    Some(Duration::from_nanos(said.split(' ').next()?.parse().ok()?))
}

/// Processor time of this thread so far.
pub(crate) fn of_this_thread() -> Option<Duration> {
    of(Path::new("/proc/thread-self"))
}

/// Processor time so far of all threads whose names begin with `name`.
pub(crate) fn of_threads(name: &str) -> Option<Duration> {
    let mut all = Duration::ZERO;
    for task in fs::read_dir("/proc/self/task").ok()? {
        let task = task.ok()?.path();
        if fs::read_to_string(task.join("comm")).is_ok_and(|comm| comm.starts_with(name)) {
            all += of(&task)?;
        }
    }
    Some(all)
}
