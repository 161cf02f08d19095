//! Two linked machines: a robot on one, its learner and its console on the other.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod certificates;
mod console;
mod disagreement;
mod flood;
mod machine;
mod names;
mod namespaces;
mod network;
mod peer;
mod strangers;
mod taught;
#[path = "../sources/venv.rs"]
mod venv;
mod wakeful;
mod yardstick;

use std::fs;
use std::net::UdpSocket;
use std::path::Path;
use std::process::Command;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rustix::process::{Signal, kill_process};
use tempfile::TempDir;

use machine::{Machine, wait_until};

/// The console's line when Task 1 was learned and performed as the teacher meant it.
pub(crate) const PERFORMED: &str = "filled 5 of 5";

/// Serialises the tests, because whole robots share the cores.
pub(crate) fn alone() -> MutexGuard<'static, ()> {
    static MACHINE: Mutex<()> = Mutex::new(());
    MACHINE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An unused port.
pub(crate) fn free_port() -> u16 {
    UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a port").port()
}

/// Creates keys for two machines as docs/more_than_one_machine.md describes; `names` are those of `robot`.
/// Skips with a message if openssl is missing.
pub(crate) fn keys_or_skip(names: &str) -> Option<TempDir> {
    if let Err(error) = Command::new("openssl").arg("version").output() {
        skip::skip(format_args!("the keys of a link are made with openssl: {error}"));
        return None;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("package/link_keys.sh");
    let made = Command::new(script)
        .arg(folder.path())
        .args([format!("robot={names}"), "remote=DNS:desk.local".to_owned()])
        .status()
        .expect("it is there");
    assert!(made.success());
    Some(folder)
}

/// The `[link]` configuration of one side, as changes of `leo.toml`.
pub(crate) struct Side(Vec<(&'static str, String)>);

impl Side {
    pub(crate) fn robot(listen: &str) -> Self {
        Self(vec![("side", quoted("robot")), ("listen", format!("[{}]", quoted(listen)))])
    }

    pub(crate) fn remote(connect: &str) -> Self {
        Self(vec![("side", quoted("remote")), ("connect", format!("[{}]", quoted(connect)))])
    }

    pub(crate) fn keyed(mut self, folder: &Path, name: &str) -> Self {
        for (key, file) in [
            ("ca_certificate", "authority.pem".to_owned()),
            ("certificate", format!("{name}.pem")),
            ("private_key", format!("{name}.key")),
        ] {
            self.0.push((key, quoted(&folder.join(file).display().to_string())));
        }
        self
    }

    pub(crate) fn with(mut self, key: &'static str, value: &str) -> Self {
        self.0.push((key, value.to_owned()));
        self
    }

    pub(crate) fn changes(&self) -> Vec<(&str, &str)> {
        self.0.iter().map(|(key, value)| (*key, value.as_str())).collect()
    }
}

fn quoted(text: &str) -> String {
    format!("\"{text}\"")
}

/// What a domain left in shared memory, its root included.
fn left_behind(domain: &Path) -> Vec<String> {
    let name = domain.file_name().expect("a name").to_string_lossy().into_owned();
    let is_its = |entry: &String| *entry == name || entry.starts_with(&format!("{name}_"));
    let entries = fs::read_dir("/dev/shm").expect("there is shared memory").flatten();
    entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).filter(is_its).collect()
}

#[test]
fn a_learner_on_another_machine_learns_task_1_and_performs_it() {
    let _alone = alone();
    let Some(keys) = keys_or_skip("DNS:localhost") else { return };
    let port = free_port();
    let away = Side::remote(&format!("quic/localhost:{port}")).keyed(keys.path(), "remote");
    let mut away = Machine::ready(None, "link-away", &away.changes());
    let robot = Side::robot(&format!("quic/127.0.0.1:{port}")).keyed(keys.path(), "robot");
    let mut robot = Machine::ready(None, "link-robot", &robot.changes());
    assert!(robot.process("learner").is_none() && robot.process("console").is_none());
    assert!(away.process("belief").is_none() && away.process("learner").is_some());

    assert!(
        wait_until(|| away.stdout().contains(PERFORMED)),
        "{}\n{}\n{}\n{:?}",
        away.stdout(),
        away.said(),
        robot.said(),
        away.metrics()
    );
    let fares = away.metrics();
    println!("away: {}", link(&fares));
    println!("robot: {}", link(&robot.metrics()));
    assert!(away.metric("leo_link_clock_error_seconds") > 0.0);
    assert!(away.metric("leo_link_delay_since_start_seconds_count{direction=\"received\"}") > 100.0);

    // The robot's link process dies: no other process is affected, and the connection is restored.
    let heard = away.metric("leo_link_sessions_total");
    let motor = robot.process("motor");
    kill_process(robot.process("link").expect("lives"), Signal::KILL).expect("lives");
    assert!(wait_until(|| away.metric("leo_link_sessions_total") > heard), "{}", away.said());
    assert_eq!(robot.process("motor"), motor);
    for machine in [&mut away, &mut robot] {
        let (status, said) = machine.stop();
        assert!(status.success(), "{status}\n{said}");
        assert_eq!(left_behind(machine.domain()), [""; 0]);
    }
    assert_eq!(away.learned(), [("task 1".to_owned(), 2)].into());
}

/// The link's metrics as one line.
pub(crate) fn link(metrics: &std::collections::BTreeMap<String, f64>) -> String {
    let of_link = |(name, value): (&String, &f64)| {
        let is_its = name.starts_with("leo_link_") && !name.contains("_bucket");
        is_its.then(|| format!("{}={value}", name.trim_start_matches("leo_link_")))
    };
    metrics.iter().filter_map(of_link).collect::<Vec<_>>().join(" ")
}
