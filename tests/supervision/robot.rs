use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};

use clock::Duration;
use rustix::process::Signal;
use tempfile::TempDir;
use testkit::robot::{self, Said};
pub(crate) use testkit::robot::{PROCESSES, pause, signal};

/// Generous: the machine may be loaded.
pub(crate) const MAX_WAIT: Duration = Duration::from_secs(60);

/// A running robot in its own domain, as a user would start it. Dropping it kills it.
pub(crate) struct Robot {
    supervisor: Child,
    domain: PathBuf,
    said: Said,
    files: TempDir,
}

/// A `leo` command without `RUST_LOG`.
pub(crate) fn leo(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leo"));
    command.args(arguments).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// The root of a test's domain.
pub(crate) fn domain(name: &str) -> PathBuf {
    PathBuf::from(format!("/dev/shm/leo-{name}-{}", std::process::id()))
}

/// Waits until a condition holds; `false` on time-out.
pub(crate) fn wait_until(holds: impl FnMut() -> bool) -> bool {
    robot::wait_until(MAX_WAIT, holds)
}

impl Robot {
    /// Starts a robot that runs until it is stopped. `changes` are new values for keys of `leo.toml`, and
    /// `[[tables]]` with their lines to be appended.
    pub(crate) fn start(name: &str, changes: &[(&str, &str)]) -> Self {
        Self::with(name, changes, &[])
    }

    /// As [`Self::start`], with more arguments.
    pub(crate) fn with(name: &str, changes: &[(&str, &str)], more: &[&str]) -> Self {
        Self::by(leo(&[]), name, changes, more)
    }

    /// As [`Self::with`], with a prepared command.
    pub(crate) fn by(mut leo: Command, name: &str, changes: &[(&str, &str)], more: &[&str]) -> Self {
        let files = tempfile::tempdir().expect("a folder");
        let config = files.path().join("leo.toml");
        fs::write(&config, changed(changes)).expect("writes");
        let domain = domain(name);
        let mut supervisor = leo
            .args(["-v", "run", "--for", "3600"])
            .arg("--config")
            .arg(&config)
            .arg("--domain")
            .arg(&domain)
            .args(more)
            .env("XDG_STATE_HOME", files.path())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("starts");
        let said = Said::default();
        said.listen(supervisor.stderr.take().expect("piped"));
        Self { supervisor, domain, said, files }
    }

    /// Starts a robot and waits until all its processes run.
    pub(crate) fn ready(name: &str, changes: &[(&str, &str)]) -> Self {
        let robot = Self::start(name, changes);
        assert!(wait_until(|| robot.said().contains("the robot runs")), "{}", robot.said());
        robot
    }

    /// Its standard error so far.
    pub(crate) fn said(&self) -> String {
        self.said.text()
    }

    /// The path of its `leo.toml`.
    pub(crate) fn config(&self) -> PathBuf {
        self.files.path().join("leo.toml")
    }

    /// The files of its black box.
    pub(crate) fn black_boxes(&self) -> Vec<PathBuf> {
        let folder = fs::read_dir(self.files.path().join("leo/recordings")).into_iter().flatten();
        let files = folder.flatten().map(|entry| entry.path());
        files.filter(|file| file.extension().is_some_and(|extension| extension == "mcap")).collect()
    }

    pub(crate) fn domain(&self) -> &Path {
        &self.domain
    }

    pub(crate) fn pid(&self) -> i32 {
        i32::try_from(self.supervisor.id()).expect("a process number")
    }

    /// Number of open file descriptors of the supervisor.
    pub(crate) fn descriptors(&self) -> usize {
        fs::read_dir(format!("/proc/{}/fd", self.pid())).map_or(0, Iterator::count)
    }

    /// The live processes by name.
    pub(crate) fn processes(&self) -> BTreeMap<String, i32> {
        let mut processes = robot::processes_of(self.pid());
        processes.retain(|name, _| PROCESSES.contains(&name.as_str()));
        processes
    }

    /// The rows of `leo top`.
    pub(crate) fn rows(&self) -> Vec<serde_json::Value> {
        let shown = leo(&["top", "--json", "--domain"]).arg(&self.domain).output().expect("runs");
        serde_json::from_slice(&shown.stdout).unwrap_or_default()
    }

    /// Cycle counts of every running process.
    pub(crate) fn cycles(&self) -> BTreeMap<String, u64> {
        let rows = self.rows();
        let rows = rows.iter().filter(|row| row["state"] == "running");
        rows.filter_map(|row| Some((row["process"].as_str()?.to_owned(), row["cycles"].as_u64()?))).collect()
    }

    /// Whether all processes run and their cycles advance.
    pub(crate) fn works(&self) -> bool {
        wait_until(|| {
            let before = self.cycles();
            pause(Duration::from_millis(300));
            let after = self.cycles();
            PROCESSES
                .iter()
                .all(|name| matches!((before.get(*name), after.get(*name)), (Some(b), Some(a)) if a > b))
        })
    }

    /// Sends a signal to the supervisor and waits for its end.
    pub(crate) fn stop(mut self, how: Signal) -> (ExitStatus, String) {
        signal(self.pid(), how);
        let status = self.end();
        (status, self.said())
    }

    /// Waits for its end.
    pub(crate) fn end(&mut self) -> ExitStatus {
        let mut status = None;
        let ended = wait_until(|| {
            status = self.supervisor.try_wait().expect("asked");
            status.is_some()
        });
        assert!(ended, "the supervisor does not end: {}", self.said());
        status.expect("ended")
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        let _dead = self.supervisor.kill().and_then(|()| self.supervisor.wait());
        assert!(self.files.path().exists());
    }
}

/// The configuration with some changed values.
fn changed(changes: &[(&str, &str)]) -> String {
    let mut text = String::new();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/leo.toml");
    fs::File::open(file).and_then(|mut file| file.read_to_string(&mut text)).expect("the configuration");
    for (key, value) in changes {
        if key.starts_with("[[") {
            text.push_str(&format!("\n{key}\n{value}\n"));
            continue;
        }
        let line =
            text.lines().find(|line| line.starts_with(&format!("{key} = "))).expect("a key").to_owned();
        text = text.replace(&line, &format!("{key} = {value}"));
    }
    text
}
