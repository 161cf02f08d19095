use std::env;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use message::JointGoals;
use rustix::process::Signal;
use transport::{Domain, Node};

use super::robot::{Robot, pause, signal, wait_until};
use super::rogue::{QUEUES, Rogue};
use clock::Duration;

/// Publishers of a topic, as in `transport`.
const SLOTS: usize = 4;
/// Environment variables of the second process: the domain, and the file for the number of its slots.
const DOMAIN: &str = "LEO_TEST_DOMAIN";
const HELD: &str = "LEO_TEST_SLOTS";

/// The second process: takes every free slot of the learner's topic until it is killed.
#[test]
#[ignore = "it works until it is killed: the test below starts it"]
fn taker_of_slots() {
    let (Ok(root), Ok(file)) = (env::var(DOMAIN), env::var(HELD)) else {
        return skip::skip("another test has to start it");
    };
    let domain = Domain::at(Path::new(&root)).expect("a domain");
    let mut node = Node::join(&domain, "taker", 1, QUEUES).expect("joins");
    // A publisher beside that of the robot's process can be opened only where the roster decides.
    node.follow_roster().expect("a supervisor runs");
    let mut slots: Vec<Rogue<JointGoals>> = Vec::new();
    loop {
        if let Some(slot) = Rogue::open(&node, None) {
            slots.push(slot);
            fs::write(&file, slots.len().to_string()).expect("writes");
        }
        pause(Duration::from_micros(200));
    }
}

struct Taker(Child);

impl Drop for Taker {
    fn drop(&mut self) {
        let _dead = self.0.kill().and_then(|()| self.0.wait());
    }
}

#[test]
fn a_process_in_all_publisher_slots_is_named_by_the_restarted_one() {
    let files = tempfile::tempdir().expect("a folder");
    let held = files.path().join("slots");
    let robot = Robot::ready("slots", &[("max_deaths", "1000000"), ("max_backoff_ms", "40.0")]);
    assert!(robot.works(), "{}", robot.said());
    let before = robot.processes();
    let taker = Command::new(env::current_exe().expect("this program"))
        .args(["--exact", "--ignored", "slots::taker_of_slots"])
        .env(DOMAIN, robot.domain())
        .env(HELD, &held)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn();
    let taker = Taker(taker.expect("starts"));
    let slots = || fs::read_to_string(&held).ok().and_then(|text| text.parse().ok()).unwrap_or(0_usize);
    assert!(wait_until(|| slots() == SLOTS - 1), "{} slots", slots());
    // The last slot is the learner's. It is free after a death, and the learner often gets it again.
    let is_taken = wait_until(|| {
        if let Some(&pid) = robot.processes().get("learner") {
            signal(pid, Signal::KILL);
        }
        slots() == SLOTS
    });
    assert!(is_taken, "{} slots\n{}", slots(), robot.said());

    let pid = taker.0.id();
    let refusal = format!("cannot open `joint-goals` for writing: process {pid} publishes on it already");
    let is_named = wait_until(|| robot.said().contains(&refusal));
    assert!(is_named, "{refusal}\n{}", robot.said());
    let learner_of = |robot: &Robot| {
        let rows = robot.rows();
        rows.iter().find(|row| row["process"] == "learner").map(|row| row["state"].clone())
    };
    assert_ne!(learner_of(&robot), Some("running".into()), "{}", robot.said());
    drop(taker);
    assert!(robot.works(), "the learner does not come back\n{}", robot.said());
    let mut after = robot.processes();
    after.insert("learner".to_owned(), before["learner"]);
    assert_eq!(after, before, "a running process ended\n{}", robot.said());
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{status}\n{said}");
}
