use std::fmt::{self, Display, Formatter};
use std::fs;
use std::io::{BufRead as _, BufReader};
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use clock::Duration;
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

/// Patience with a loaded machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// Where a page is, and what lets somebody in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Host {
    /// Host and port.
    name: String,
    pub(crate) token: String,
}

impl Host {
    /// The whole address of the page.
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

/// A robot whose page is open to us. Dropping it kills it.
pub(crate) struct Robot {
    supervisor: Child,
    /// Where its page is.
    pub(crate) host: Host,
    state: TempDir,
    name: String,
}

/// A command of `leo`.
pub(crate) fn leo(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leo"));
    command.args(arguments).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

impl Robot {
    /// Starts a robot and waits until it says where its page is.
    pub(crate) fn start(name: &str) -> Self {
        Self::configured(name, |leo| leo)
    }

    /// The same of one whose `leo.toml` is another.
    pub(crate) fn configured(name: &str, change: impl Fn(String) -> String) -> Self {
        let state = tempfile::tempdir().expect("a folder");
        let config = state.path().join("leo.toml");
        let built_in = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/leo.toml");
        fs::write(&config, change(fs::read_to_string(built_in).expect("reads"))).expect("writes");
        let (supervisor, host) = launched(name, state.path());
        Self { supervisor, host, state, name: name.to_owned() }
    }

    /// Ends it as Ctrl-C does, and starts it again with the same settings over what it remembers.
    pub(crate) fn restart(&mut self) {
        self.stop();
        (self.supervisor, self.host) = launched(&self.name, self.state.path());
    }

    /// Its state directory's parent, as `XDG_STATE_HOME`.
    pub(crate) fn state(&self) -> &Path {
        self.state.path()
    }

    /// The folder of its domain.
    pub(crate) fn domain(&self) -> PathBuf {
        domain_of(&self.name)
    }

    /// Stops it as Ctrl-C does; what it remembers stays.
    pub(crate) fn stop(&mut self) {
        let pid = i32::try_from(self.supervisor.id()).expect("a process number");
        kill_process(Pid::from_raw(pid).expect("a process number"), Signal::INT).expect("it lives");
        let status = self.supervisor.wait().expect("it ends");
        assert!(status.success(), "{status}");
    }

    /// The lessons that were written down.
    pub(crate) fn lessons(&self) -> Vec<PathBuf> {
        let folder = fs::read_dir(self.state.path().join("leo/lessons")).into_iter().flatten();
        folder.map(|entry| entry.expect("readable").path()).collect()
    }
}

/// The folder of the domain of a robot of a name.
fn domain_of(name: &str) -> PathBuf {
    format!("/dev/shm/leo-{name}-{}", std::process::id()).into()
}

/// A robot with the settings in the folder of its state, and where its page is.
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
    // What it says further is read, so that nothing stops for it.
    std::thread::spawn(move || lines.map_while(Result::ok).count());
    (supervisor, host)
}

impl Drop for Robot {
    fn drop(&mut self) {
        let _dead = self.supervisor.kill().and_then(|()| self.supervisor.wait());
        // A stop outlives its robot, and nobody would sweep its folder.
        let _released = fs::remove_file(self.domain().join("emergency-stop"));
    }
}
