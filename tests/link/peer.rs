//! A peer of another implementation: tests/link/peer.py.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::Value;

use crate::venv;

/// The ALPN protocol that the remote machine requests from a robot named as in `config/leo.toml`.
pub(crate) const TO_ROBOT: &str = "leo-link/leo/remote";
/// The ALPN protocol that the robot requests.
pub(crate) const OF_ROBOT: &str = "leo-link/leo/robot";

/// A Python interpreter with aioquic.
pub(crate) struct Peer(PathBuf);

/// A running peer command; dropping it ends it.
pub(crate) struct Running {
    child: Child,
    lines: BufReader<ChildStdout>,
    _input: Option<ChildStdin>,
}

impl Peer {
    pub(crate) fn or_skip() -> Option<Self> {
        venv::interpreter("aioquic==1.7.2", "aioquic").map(Self)
    }

    pub(crate) fn start(&self, words: &[&str]) -> Running {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/link/peer.py");
        let mut command = Command::new(&self.0);
        command.arg(script).args(words).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("starts");
        let lines = BufReader::new(child.stdout.take().expect("piped"));
        Running { _input: child.stdin.take(), child, lines }
    }

    /// Runs a command to its end; returns its output.
    pub(crate) fn run(&self, words: &[&str]) -> Vec<Value> {
        let mut running = self.start(words);
        running.rest()
    }
}

impl Running {
    /// Whether it is still running.
    pub(crate) fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("asked").is_none()
    }

    /// The remaining output, after the command has ended.
    pub(crate) fn rest(&mut self) -> Vec<Value> {
        let told = std::iter::from_fn(|| self.line()).collect();
        let status = self.child.wait().expect("ends");
        assert!(status.success(), "{status}");
        told
    }

    /// The next line of output, if any.
    pub(crate) fn line(&mut self) -> Option<Value> {
        let mut line = String::new();
        self.lines.read_line(&mut line).expect("reads");
        (!line.is_empty()).then(|| serde_json::from_str(&line).expect("JSON"))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // The process may have ended.
        let _ended = self.child.kill();
        let _ended = self.child.wait();
    }
}

/// A text field of a line.
pub(crate) fn word<'a>(line: &'a Value, key: &str) -> &'a str {
    line.get(key).and_then(Value::as_str).expect("a word")
}

/// A number field of a line.
pub(crate) fn number(line: &Value, key: &str) -> Option<u64> {
    line.get(key).and_then(Value::as_u64)
}
