use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};

use clock::Duration;
use quantity::number::floor_usize;
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;
pub(crate) use testkit::robot::pause;
use testkit::robot::{self, Said};

/// Generous: the machine may be loaded.
const MAX_WAIT: Duration = Duration::from_secs(90);

/// One of two linked machines: a `leo run` with its own domain and state directory. Dropping it kills it.
pub(crate) struct Machine {
    supervisor: Child,
    domain: PathBuf,
    stdout: Said,
    said: Said,
    files: TempDir,
}

/// A `leo` command without `RUST_LOG`, in a network namespace or in this one.
pub(crate) fn leo(namespace: Option<&str>) -> Command {
    let program = env!("CARGO_BIN_EXE_leo");
    let mut command = match namespace {
        Some(namespace) => {
            let mut command = Command::new("ip");
            command.args(["netns", "exec", namespace, program]);
            command
        }
        None => Command::new(program),
    };
    command.env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// Waits until a condition holds; `false` on time-out.
pub(crate) fn wait_until(holds: impl FnMut() -> bool) -> bool {
    robot::wait_until(MAX_WAIT, holds)
}

/// The configuration with some changed values. A key of `leo.toml` is prefixed by its section if it is
/// ambiguous (`motor.realtime.cores`).
pub(crate) fn changed(changes: &[(&str, &str)]) -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/leo.toml");
    let mut text = fs::read_to_string(file).expect("the configuration");
    for (key, value) in changes {
        let (section, key) = key.rsplit_once('.').unwrap_or(("", key));
        let from = if section.is_empty() { Some(0) } else { text.find(&format!("\n[{section}]\n")) };
        let rest = text.split_off(from.expect("a section"));
        let line = rest.lines().find(|line| line.starts_with(&format!("{key} = "))).expect("a key");
        text.push_str(&rest.replacen(line, &format!("{key} = {value}"), 1));
    }
    text
}

impl Machine {
    /// Starts a machine that runs until it is stopped.
    pub(crate) fn start(namespace: Option<&str>, name: &str, changes: &[(&str, &str)]) -> Self {
        Self::start_with(namespace, name, changes, &[])
    }

    /// As [`Self::start`], with more arguments for `leo run`.
    pub(crate) fn start_with(
        namespace: Option<&str>,
        name: &str,
        changes: &[(&str, &str)],
        arguments: &[&str],
    ) -> Self {
        let files = tempfile::tempdir().expect("a folder");
        let config = files.path().join("leo.toml");
        fs::write(&config, changed(&[&[("address", "\"none\"")], changes].concat())).expect("writes");
        let domain = PathBuf::from(format!("/dev/shm/leo-{name}-{}", std::process::id()));
        let mut supervisor = leo(namespace)
            .args(["-v", "run", "--stay", "--config"])
            .arg(&config)
            .arg("--domain")
            .arg(&domain)
            .args(arguments)
            .env("XDG_STATE_HOME", files.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("starts");
        let (stdout, said) = (Said::default(), Said::default());
        stdout.listen(supervisor.stdout.take().expect("piped"));
        said.listen(supervisor.stderr.take().expect("piped"));
        Self { supervisor, domain, stdout, said, files }
    }

    /// Starts a machine and waits until all its processes run.
    pub(crate) fn ready(namespace: Option<&str>, name: &str, changes: &[(&str, &str)]) -> Self {
        Self::start(namespace, name, changes).when_ready()
    }

    /// Waits until all its processes run.
    pub(crate) fn when_ready(self) -> Self {
        assert!(wait_until(|| self.said().contains("the robot runs")), "{}", self.said());
        self
    }

    /// Its standard error so far.
    pub(crate) fn said(&self) -> String {
        self.said.text()
    }

    /// The output of its console so far.
    pub(crate) fn stdout(&self) -> String {
        self.stdout.text()
    }

    pub(crate) fn domain(&self) -> &Path {
        &self.domain
    }

    /// The learned tasks with their numbers of examples, from `leo tasks list` after the machine has stopped.
    pub(crate) fn learned(&self) -> BTreeMap<String, u64> {
        let mut tasks = leo(None);
        tasks.args(["tasks", "list", "--json"]).env("XDG_STATE_HOME", self.files.path());
        let out = tasks.output().expect("runs");
        let known: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
        let task = |known: &serde_json::Value| {
            Some((known.get("name")?.as_str()?.to_owned(), known.get("examples")?.as_u64()?))
        };
        known.as_array().expect("a list").iter().filter_map(task).collect()
    }

    /// Its metrics from `leo top`, by name with labels.
    pub(crate) fn metrics(&self) -> BTreeMap<String, f64> {
        let mut top = leo(None);
        let out = top.args(["top", "--openmetrics", "--domain"]).arg(&self.domain).output().expect("runs");
        let text = String::from_utf8_lossy(&out.stdout).into_owned();
        let sample = |line: &str| {
            let (name, value) = line.rsplit_once(' ')?;
            Some((name.to_owned(), value.parse().ok()?))
        };
        text.lines().filter_map(sample).collect()
    }

    /// A metric; zero if it is missing.
    pub(crate) fn metric(&self, name: &str) -> f64 {
        self.metrics().get(name).copied().unwrap_or(0.0)
    }

    /// A metric as a whole number.
    pub(crate) fn count(&self, name: &str) -> usize {
        floor_usize(self.metric(name))
    }

    fn pid(&self) -> Pid {
        Pid::from_child(&self.supervisor)
    }

    /// The PID of one of its processes.
    pub(crate) fn process(&self, name: &str) -> Option<Pid> {
        robot::processes_of(self.pid().as_raw_nonzero().get()).get(name).copied().and_then(Pid::from_raw)
    }

    /// Stops it regularly.
    pub(crate) fn stop(&mut self) -> (ExitStatus, String) {
        kill_process(self.pid(), Signal::TERM).expect("it lives");
        let mut status = None;
        let ended = wait_until(|| {
            status = self.supervisor.try_wait().expect("asked");
            status.is_some()
        });
        assert!(ended, "the supervisor does not end: {}", self.said());
        (status.expect("ended"), self.said())
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        let _dead = self.supervisor.kill().and_then(|()| self.supervisor.wait());
    }
}
