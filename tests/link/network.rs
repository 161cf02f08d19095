//! Two network namespaces with a simulated network that delays, drops and breaks.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// Two namespaces and the process that connects them; removed on drop.
pub(crate) struct Network {
    between: Child,
    pub(crate) names: [String; 2],
}

impl Network {
    /// Creates a network with unique namespace names; skips with a message if that is impossible.
    pub(crate) fn or_skip(name: &str) -> Option<Self> {
        let skip = |why: &String| {
            skip::skip(format_args!(
                "two network namespaces with a network between them cannot be made here: {why}"
            ));
        };
        Self::make(name).inspect_err(skip).ok()
    }

    fn make(name: &str) -> Result<Self, String> {
        let names = ["a", "b"].map(|end| format!("leo-{name}-{end}-{}", std::process::id()));
        if !Path::new("/dev/net/tun").exists() {
            return Err("there is no /dev/net/tun".to_owned());
        }
        for name in &names {
            let made = Command::new("ip").args(["netns", "add", name]).output();
            let made = made.map_err(|error| format!("cannot run `ip`: {error}"))?;
            if !made.status.success() {
                return Err(format!("`ip netns add` says {}", String::from_utf8_lossy(&made.stderr)));
            }
        }
        let [a, b] = &names;
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/link/network.py");
        let between = Command::new("python3")
            .arg(script)
            .args([a, "10.77.0.1", b, "10.77.0.2"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| format!("cannot run `python3`: {error}"))?;
        let mut network = Self { between, names };
        if network.answer() == "ready" { Ok(network) } else { Err("no TUN device can be made".to_owned()) }
    }

    fn answer(&mut self) -> String {
        // Unbuffered is fast enough for these few words.
        let mut word = String::new();
        let out = self.between.stdout.as_mut().expect("piped");
        let _end = BufReader::with_capacity(1, out).read_line(&mut word);
        word.trim().to_owned()
    }

    /// Sets the delay and loss of packets.
    pub(crate) fn set(&mut self, words: &str) {
        // Written at once, because the script reads whole lines.
        let line = format!("{words}\n");
        self.between.stdin.as_mut().expect("piped").write_all(line.as_bytes()).expect("it lives");
        assert_eq!(self.answer(), "so");
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        let _dead = self.between.kill().and_then(|()| self.between.wait());
        for name in &self.names {
            let _gone = Command::new("ip").args(["netns", "del", name]).status();
        }
    }
}
