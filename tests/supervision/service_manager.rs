//! The supervisor's messages to the service manager by the protocol of sd_notify(3), received by a socket of
//! this test.

use std::ffi::OsString;
use std::fs;
use std::os::linux::net::SocketAddrExt as _;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::sync::{Arc, Mutex};
use std::thread;

use rustix::process::Signal;
use tempfile::TempDir;

use crate::robot::{PROCESSES, Robot, leo, signal, wait_until};

/// A fake service manager.
struct Manager {
    address: OsString,
    /// Of a socket with a path.
    _folder: Option<TempDir>,
    heard: Arc<Mutex<Vec<String>>>,
}

impl Manager {
    fn listens() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("notify");
        Self { _folder: Some(folder), ..Self::over(&UnixDatagram::bind(&path).expect("binds"), path.into()) }
    }

    /// In the abstract namespace.
    fn listens_abstractly() -> Self {
        let name = format!("leo-service-manager-{}", std::process::id());
        let address = SocketAddr::from_abstract_name(&name).expect("a name");
        Self::over(&UnixDatagram::bind_addr(&address).expect("binds"), format!("@{name}").into())
    }

    fn over(socket: &UnixDatagram, address: OsString) -> Self {
        let socket = socket.try_clone().expect("a descriptor");
        let heard = Arc::new(Mutex::new(Vec::new()));
        let writer = Arc::clone(&heard);
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count) = socket.recv(&mut bytes) {
                let words = String::from_utf8_lossy(bytes.get(..count).unwrap_or(&[])).into_owned();
                writer.lock().expect("nobody panics with it").extend(words.lines().map(str::to_owned));
            }
        });
        Self { address, _folder: None, heard }
    }

    fn heard(&self) -> Vec<String> {
        self.heard.lock().expect("nobody panics with it").clone()
    }

    fn count(&self, word: &str) -> usize {
        self.heard().iter().filter(|heard| *heard == word).count()
    }

    /// Starts a robot that reports to this socket.
    fn starts(&self, name: &str, changes: &[(&str, &str)]) -> Robot {
        let mut command = leo(&[]);
        command.env("NOTIFY_SOCKET", &self.address);
        Robot::by(command, name, changes, &[])
    }
}

fn running(robot: &Robot) -> usize {
    robot.rows().iter().filter(|row| row["state"] == "running").count()
}

#[test]
fn the_service_manager_is_notified_of_ready_watchdog_and_stopping() {
    is_notified(&Manager::listens(), "notify");
}

#[test]
fn an_abstract_socket_is_notified_like_one_with_a_path() {
    is_notified(&Manager::listens_abstractly(), "notify-abstract");
}

fn is_notified(manager: &Manager, name: &str) {
    let robot = manager.starts(name, &[]);
    assert!(wait_until(|| manager.count("READY=1") > 0), "{:?}\n{}", manager.heard(), robot.said());
    assert_eq!(running(&robot), PROCESSES.len(), "ready before all are\n{}", robot.said());
    let heard = manager.heard();
    let ready = heard.iter().position(|word| word == "READY=1").expect("heard");
    let before: Vec<&String> = heard.iter().take(ready).collect();
    assert!(before.iter().all(|word| word.starts_with("STATUS=starting: ")), "{heard:?}");
    assert!(before.last().is_some_and(|word| word.contains(" 6 of 7 ")), "{heard:?}");
    assert!(wait_until(|| manager.count("WATCHDOG=1") > 3), "{:?}", manager.heard());
    assert_eq!(manager.count("STATUS=all 7 processes run"), 1);
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{said}");
    let heard = manager.heard();
    let stopping = heard.iter().position(|word| word == "STOPPING=1").expect("heard");
    assert!(heard.iter().skip(stopping).all(|word| word != "WATCHDOG=1"), "{heard:?}");
    assert_eq!(manager.count("READY=1"), 1);
}

#[test]
fn a_process_that_hangs_and_cannot_be_replaced_starves_the_watchdog() {
    let manager = Manager::listens();
    let never_tired = [("max_deaths", "1000000"), ("max_backoff_ms", "40.0")];
    let robot = manager.starts("starved", &never_tired);
    assert!(wait_until(|| manager.count("WATCHDOG=1") > 0), "{:?}\n{}", manager.heard(), robot.said());
    // No process can join the domain any more.
    fs::remove_file(robot.domain().join("iceoryx2.toml")).expect("was there");
    signal(robot.processes()["belief"], Signal::STOP);
    let failed = || robot.said().matches("starts anew").count();
    assert!(wait_until(|| failed() > 0), "{}", robot.said());
    let fed = manager.count("WATCHDOG=1");
    // A watchdog message is due every 250 ms, so many would be sent meanwhile.
    let seen = failed();
    assert!(wait_until(|| failed() > seen + 50), "{}", robot.said());
    assert_eq!(manager.count("WATCHDOG=1"), fed, "{:?}", manager.heard());
    let last = manager.heard().into_iter().rfind(|word| word.starts_with("STATUS="));
    assert!(last.as_deref().is_some_and(|word| word.starts_with("STATUS=6 of 7 ")), "{last:?}");
    robot.stop(Signal::TERM);
}
