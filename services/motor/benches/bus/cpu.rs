//! The processor's time that threads had, as the kernel counts it: its own part of it too.

use std::fs;
use std::path::Path;

use clock::Duration;

/// What a thread has had so far.
fn of(task: &Path) -> Option<Duration> {
    let said = fs::read_to_string(task.join("schedstat")).ok()?;
    Some(Duration::from_nanos(said.split(' ').next()?.parse().ok()?))
}

/// What this thread has had so far.
pub(crate) fn of_this_thread() -> Option<Duration> {
    of(Path::new("/proc/thread-self"))
}

/// What all threads whose names begin so have had so far.
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
