use std::fmt::{self, Display, Formatter};
use std::fs;
use std::io::{BufRead as _, BufReader};
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use clock::Duration;
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

/// Generous: the machine may be loaded.
pub(crate) const MAX_WAIT: Duration = Duration::from_secs(60);

/// Address and token of a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Host {
    /// Host and port.
    name: String,
    pub(crate) token: String,
}

impl Host {
    /// The full address of the page.
    pub(crate) fn url(&self) -> String {
        format!("http://{}/?token={}", self.name, self.token)
    }
}

impl Deref for Host {
    type Target = str;

    fn deref(&self) -> &str {
        &self.name
    }
}

impl Display for Host {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        out.write_str(&self.name)
    }
}

/// A robot with a page; dropping it kills it.
pub(crate) struct Robot {
    supervisor: Child,
    /// Where its page is.
    pub(crate) host: Host,
    state: TempDir,
    name: String,
}

/// A `leo` command without `RUST_LOG`.
pub(crate) fn leo(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leo"));
    command.args(arguments).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

impl Robot {
    /// Starts a robot and waits until it prints the address of its page.
    pub(crate) fn start(name: &str) -> Self {
        Self::configured(name, |leo| leo)
    }

    /// As [`Self::start`], with a changed `leo.toml`.
    pub(crate) fn configured(name: &str, change: impl Fn(String) -> String) -> Self {
        let state = tempfile::tempdir().expect("a folder");
        let config = state.path().join("leo.toml");
        let built_in = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/leo.toml");
        fs::write(&config, change(fs::read_to_string(built_in).expect("reads"))).expect("writes");
        let (supervisor, host) = launched(name, state.path());
        Self { supervisor, host, state, name: name.to_owned() }
    }

    /// Stops it as Ctrl-C does, and restarts it with the same settings and state.
    pub(crate) fn restart(&mut self) {
        self.stop();
        (self.supervisor, self.host) = launched(&self.name, self.state.path());
    }

    /// The parent of its state directory, for `XDG_STATE_HOME`.
    pub(crate) fn state(&self) -> &Path {
        self.state.path()
    }

    /// The folder of its domain.
    pub(crate) fn domain(&self) -> PathBuf {
        domain_of(&self.name)
    }

    /// Stops it as Ctrl-C does; its state is kept.
    pub(crate) fn stop(&mut self) {
        let pid = i32::try_from(self.supervisor.id()).expect("a process number");
        kill_process(Pid::from_raw(pid).expect("a process number"), Signal::INT).expect("it lives");
        let status = self.supervisor.wait().expect("it ends");
        assert!(status.success(), "{status}");
    }

    /// The saved lessons.
    pub(crate) fn lessons(&self) -> Vec<PathBuf> {
        let folder = fs::read_dir(self.state.path().join("leo/lessons")).into_iter().flatten();
        folder.map(|entry| entry.expect("readable").path()).collect()
    }
}

/// The domain folder of a robot.
fn domain_of(name: &str) -> PathBuf {
    format!("/dev/shm/leo-{name}-{}", std::process::id()).into()
}

/// Starts a robot with the settings in its state folder; returns the address of its page.
fn launched(name: &str, state: &Path) -> (Child, Host) {
    let mut supervisor = leo(&["run", "--for", "3600", "--domain"])
        .arg(domain_of(name))
        .arg("--config")
        .arg(state.join("leo.toml"))
        .env("XDG_STATE_HOME", state)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("starts");
    let mut lines = BufReader::new(supervisor.stdout.take().expect("piped")).lines();
    let first = lines.next().expect("it says something").expect("text");
    let host = first.strip_prefix("the page is at http://").expect("where the page is");
    let (name, token) = host.split_once("/?token=").expect("the token");
    let host = Host { name: name.to_owned(), token: token.to_owned() };
    // Further output is drained, so that the robot never blocks on it.
    std::thread::spawn(move || lines.map_while(Result::ok).count());
    (supervisor, host)
}

impl Drop for Robot {
    fn drop(&mut self) {
        let _dead = self.supervisor.kill().and_then(|()| self.supervisor.wait());
        // A stop outlives its robot; its file would never be removed.
        let _released = fs::remove_file(self.domain().join("emergency-stop"));
    }
}
