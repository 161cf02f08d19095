//! What tests and benchmarks of whole robots do with processes and their files.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead as _, BufReader, Read};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use clock::Duration;
use rustix::process::{Pid, Signal, kill_process};

/// The seven processes of a robot, by subcommand.
pub const PROCESSES: [&str; 7] = ["belief", "console", "learner", "mock-bus", "motor", "sensor", "simulator"];

/// Waits some time.
pub fn pause(time: Duration) {
    clock::sleep_until(clock::now() + time);
}

/// Waits until a condition holds; `false` on time-out.
pub fn wait_until(within: Duration, mut holds: impl FnMut() -> bool) -> bool {
    let end = clock::now() + within;
    while clock::now() < end {
        if holds() {
            return true;
        }
        pause(Duration::from_millis(10));
    }
    holds()
}

/// Signals a process, which may have ended in the meantime.
pub fn signal(pid: i32, signal: Signal) {
    let _sent = Pid::from_raw(pid).map(|pid| kill_process(pid, signal));
}

/// Whether a process lives; a zombie does not.
#[must_use]
pub fn is_alive(pid: i32) -> bool {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit(") ").next().is_some_and(|rest| !rest.is_empty() && !rest.starts_with(['Z', 'X']))
}

/// The live children of a supervisor, by subcommand.
#[must_use]
pub fn processes_of(supervisor: i32) -> BTreeMap<String, i32> {
    let children = fs::read_to_string(format!("/proc/{supervisor}/task/{supervisor}/children"));
    let children = children.unwrap_or_default();
    let named = children.split_whitespace().filter_map(|child| {
        let child: i32 = child.parse().ok()?;
        let line = fs::read_to_string(format!("/proc/{child}/cmdline")).ok()?;
        let name = line.split('\0').nth(1)?;
        is_alive(child).then(|| (name.to_owned(), child))
    });
    named.collect()
}

/// What a domain left in shared memory, its root included.
#[must_use]
pub fn left_behind(domain: &Path) -> Vec<String> {
    let name = domain.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let is_its = |entry: &String| *entry == name || entry.starts_with(&format!("{name}_"));
    let Ok(entries) = fs::read_dir("/dev/shm") else { return vec!["no shared memory".to_owned()] };
    entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).filter(is_its).collect()
}

/// The text that streams have delivered so far.
#[derive(Clone, Debug, Default)]
pub struct Said(Arc<Mutex<String>>);

impl Said {
    /// Reads a stream in a thread, to its end.
    pub fn listen(&self, stream: impl Read + Send + 'static) {
        let said = Arc::clone(&self.0);
        thread::spawn(move || {
            for line in BufReader::new(stream).lines().map_while(Result::ok) {
                let mut said = said.lock().unwrap_or_else(PoisonError::into_inner);
                said.push_str(&line);
                said.push('\n');
            }
        });
    }

    /// The text.
    #[must_use]
    pub fn text(&self) -> String {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
