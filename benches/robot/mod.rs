//! A whole robot for benchmarks.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use clock::{Duration, Instant};
use rustix::process::Signal;
use serde_json::Value;
pub(crate) use testkit::robot::{PROCESSES, pause, signal};
use testkit::robot::{Said, processes_of};

/// A `leo` command without `RUST_LOG`; `LEO` overrides the program.
pub(crate) fn leo(arguments: &[&str]) -> Command {
    let program = std::env::var_os("LEO").unwrap_or_else(|| env!("CARGO_BIN_EXE_leo").into());
    let mut command = Command::new(program);
    command.args(arguments).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// Waits until a condition holds; returns the time taken, or `None` on time-out.
pub(crate) fn wait_until(within: Duration, mut holds: impl FnMut() -> bool) -> Option<Duration> {
    let began = clock::now();
    loop {
        if holds() {
            return Some(clock::now().since(began));
        }
        if clock::now().since(began) > within {
            return None;
        }
        pause(Duration::from_millis(10));
    }
}

/// Number and total bytes of the files below a folder.
pub(crate) fn files_below(folder: &Path) -> (usize, u64) {
    let mut sum = (0, 0);
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let Ok(about) = entry.metadata() else { continue };
        let (files, bytes) = if about.is_dir() { files_below(&entry.path()) } else { (1, about.len()) };
        sum = (sum.0 + files, sum.1 + bytes);
    }
    sum
}

/// Files and bytes of a domain in shared memory, its folder included.
pub(crate) fn shared_memory(domain: &Path) -> (usize, u64) {
    let name = domain.file_name().and_then(OsStr::to_str).expect("a name");
    let (mut files, mut bytes) = files_below(domain);
    for entry in fs::read_dir("/dev/shm").expect("there is shared memory").flatten() {
        if entry.file_name().to_string_lossy().starts_with(&format!("{name}_")) {
            files += 1;
            bytes += entry.metadata().map_or(0, |about| about.len());
        }
    }
    (files, bytes)
}

/// Number of open file descriptors of a process.
pub(crate) fn descriptors(pid: i32) -> usize {
    fs::read_dir(format!("/proc/{pid}/fd")).map_or(0, Iterator::count)
}

/// A robot in its own domain; dropping it kills it.
pub(crate) struct Robot {
    supervisor: Child,
    pub(crate) domain: PathBuf,
    pub(crate) began: Instant,
    said: Said,
}

impl Robot {
    /// Starts `leo run` with a configuration and a state directory.
    pub(crate) fn start(domain: &Path, folder: &Path, more: &[&str]) -> Self {
        let mut supervisor = leo(&["run", "--stay", "--config"])
            .arg(folder.join("leo.toml"))
            .arg("--domain")
            .arg(domain)
            .args(more)
            .env("XDG_STATE_HOME", folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("starts");
        let said = Said::default();
        said.listen(supervisor.stdout.take().expect("piped"));
        said.listen(supervisor.stderr.take().expect("piped"));
        Self { supervisor, domain: domain.to_owned(), began: clock::now(), said }
    }

    /// Its output so far, on both streams.
    pub(crate) fn said(&self) -> String {
        self.said.text()
    }

    /// Address and token of its page, once printed.
    pub(crate) fn page(&self) -> Option<(String, String)> {
        let said = self.said();
        let page = said.lines().find_map(|line| line.strip_prefix("the page is at http://"))?;
        page.split_once("/?token=").map(|(host, token)| (host.to_owned(), token.to_owned()))
    }

    pub(crate) fn pid(&self) -> i32 {
        i32::try_from(self.supervisor.id()).expect("a process number")
    }

    /// The live processes by name.
    pub(crate) fn processes(&self) -> BTreeMap<String, i32> {
        let mut processes = processes_of(self.pid());
        processes.retain(|name, _| PROCESSES.contains(&name.as_str()));
        processes
    }

    /// The rows of `leo top`. It runs with real-time priority if permitted, so that a loaded machine does not
    /// delay it.
    pub(crate) fn rows(&self) -> Vec<Value> {
        let top = leo(&["top", "--json", "--domain"]);
        let mut first = Command::new("chrt");
        first.args(["--fifo", "1"]).arg(top.get_program()).args(top.get_args()).arg(&self.domain);
        let shown = first.env_remove("RUST_LOG").stdin(Stdio::null()).output();
        let shown = shown.ok().filter(|shown| shown.status.success());
        let shown = shown
            .unwrap_or_else(|| leo(&["top", "--json", "--domain"]).arg(&self.domain).output().expect("runs"));
        serde_json::from_slice(&shown.stdout).unwrap_or_default()
    }

    /// Whether every process runs and none is one of the killed ones.
    pub(crate) fn is_back(&self, killed: &[i32]) -> bool {
        let living = self.processes();
        if living.len() < PROCESSES.len() || living.values().any(|pid| killed.contains(pid)) {
            return false;
        }
        let rows = self.rows();
        PROCESSES.iter().all(|name| {
            rows.iter().any(|row| {
                let is_its = row["pid"].as_i64() == living.get(*name).map(|pid| i64::from(*pid));
                is_its && row["state"] == "running" && row["cycles"].as_u64() > Some(0)
            })
        })
    }

    /// Sends a signal to the supervisor and waits; returns whether it ended successfully.
    pub(crate) fn end(&mut self, how: Signal) -> bool {
        signal(self.pid(), how);
        self.supervisor.wait().is_ok_and(|status| status.success())
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        let _dead = self.supervisor.kill().and_then(|()| self.supervisor.wait());
    }
}
