//! Another program fills shared memory while the robot runs.

use std::collections::BTreeMap;
use std::env;
use std::fs::{self, File};
use std::io::Write as _;
use std::process::Command;

use rustix::process::Signal;

use super::PATIENT;
use super::guesses::mapped;
use super::robot::{Robot, signal, wait_until};
use testkit::robot::left_behind;

/// The environment variable with which this test runs itself again, with a small `/dev/shm` of its own.
const INSIDE: &str = "LEO_SMALL_SHARED_MEMORY";
const NAME: &str = "full_memory::full_shared_memory_keeps_processes_from_starting_and_is_named";
const FILE: &str = "/dev/shm/fill";

#[test]
fn full_shared_memory_keeps_processes_from_starting_and_is_named() {
    if env::var_os(INSIDE).is_some() {
        return in_small_shared_memory();
    }
    let script =
        r#"mount -t tmpfs -o size=64m tmpfs /dev/shm || exit 77; exec "$0" --exact --nocapture "$1""#;
    let inside = Command::new("unshare")
        .args(["--mount", "sh", "-c", script])
        .arg(env::current_exe().expect("this program"))
        .arg(NAME)
        .env(INSIDE, "1")
        .output();
    let Some(inside) = inside
        .ok()
        .filter(|inside| inside.status.code() != Some(77) && !inside.stderr.starts_with(b"unshare:"))
    else {
        skip::skip("needs `unshare --mount` and the right to mount a tmpfs");
        return;
    };
    let out = String::from_utf8_lossy(&inside.stdout);
    let err = String::from_utf8_lossy(&inside.stderr);
    assert!(inside.status.success() && out.contains("1 passed"), "{out}\n{err}");
}

/// Waits until each of some processes has waited and was woken a hundred times more.
fn goes_on(robot: &Robot, processes: &BTreeMap<String, i32>, is_full: impl Fn() -> bool) {
    assert!(!processes.is_empty(), "no process runs\n{}", robot.said());
    let begun: Vec<u64> = processes.values().map(|&pid| turns(pid)).collect();
    for ((name, &pid), begun) in processes.iter().zip(begun) {
        let goes_on = wait_until(|| is_full() && turns(pid) > begun + 100);
        assert!(goes_on, "`{name}` stands still\n{}", robot.said());
    }
}

/// Waits until no process opens ports any more: the console subscribes to topics as they appear.
fn settles(robot: &Robot) {
    let processes = robot.processes();
    let mapped = || -> Vec<usize> { processes.values().map(|&pid| mapped(robot, pid).len()).collect() };
    let is_settled = wait_until(|| {
        let before = mapped();
        goes_on(robot, &processes, || true);
        mapped() == before
    });
    assert!(is_settled, "ports are opened for ever\n{}", robot.said());
}

/// How often a process has waited and was woken.
fn turns(pid: i32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
    line.and_then(|number| number.trim().parse().ok()).unwrap_or_default()
}

fn in_small_shared_memory() {
    let robot = Robot::ready("full", &PATIENT);
    let fill = File::options().create(true).append(true).open(FILE).expect("writes");
    // A dead process frees its memory, so the file is extended again and again.
    let is_full = || {
        while (&fill).write_all(&[1; 4096]).is_ok() {}
        true
    };
    settles(&robot);
    // Most of the frames were never written before.
    assert!(is_full());
    let running = robot.processes();
    goes_on(&robot, &running, is_full);
    assert_eq!(robot.processes(), running, "a running process ended\n{}", robot.said());
    assert!(!robot.said().contains("starts anew"), "{}", robot.said());
    for victim in ["sensor", "learner"] {
        let before = robot.processes();
        assert_eq!(before.len(), 7, "{before:?}\n{}", robot.said());
        assert!(is_full());
        signal(before[victim], Signal::KILL);
        let said = || {
            let said = robot.said();
            said.lines().filter(|line| line.contains("/dev/shm") && line.contains("full")).count()
        };
        let known = said();
        let is_named = wait_until(|| is_full() && said() > known + 3);
        assert!(is_named, "the full memory is not named\n{}", robot.said());
        let mut others = before.clone();
        others.remove(victim);
        goes_on(&robot, &others, is_full);
        fill.set_len(0).expect("is its");
        assert!(robot.works(), "`{victim}` does not come back\n{}", robot.said());
        let mut after = robot.processes();
        after.insert(victim.to_owned(), before[victim]);
        assert_eq!(after, before, "a running process ended\n{}", robot.said());
    }
    fs::remove_file(FILE).expect("is there");
    let domain = robot.domain().to_owned();
    let (status, said) = robot.stop(Signal::INT);
    assert!(status.success(), "{status}\n{said}");
    assert_eq!(left_behind(&domain), [""; 0]);
}
