//! The supervisor with real processes: whichever process is killed, the robot continues or ends cleanly.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "a test fails by panicking")]

mod black_box;
mod campaign;
mod emergency;
mod full_memory;
mod guesses;
mod journal;
mod live_top;
mod metrics;
mod onlookers;
mod refused_calls;
mod refused_memory;
mod robot;
mod service_manager;
mod upgrade;
#[path = "../sources/venv.rs"]
mod venv;

use std::fs;
use std::path::Path;
use std::process::Output;

use clock::Duration;
use rustix::process::Signal;

use robot::{PROCESSES, Robot, domain, leo, pause, signal, wait_until};
use testkit::robot::{is_alive, left_behind};

/// A supervisor that never gives up on processes that tests kill.
const PATIENT: [(&str, &str); 2] = [("max_deaths", "1000000"), ("max_backoff_ms", "40.0")];
/// Number of kills of each process.
const KILLS: u32 = 50;

/// A deterministic pseudo-random sequence.
struct Chance(u64);

impl Chance {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % bound
    }
}

#[test]
fn the_robot_survives_any_process_killed_at_any_moment() {
    // Long heartbeat time-outs, because the machine is busy: only killed processes shall be restarted.
    let [deaths, backoff] = PATIENT;
    let hearts = ["heartbeat_timeout_ms", "heartbeat_timeout_others_ms"].map(|key| (key, "30000.0"));
    let robot = Robot::ready("kill", &[deaths, backoff, hearts[0], hearts[1]]);
    assert!(robot.works(), "{}", robot.said());
    let held = |robot: &Robot| (left_behind(robot.domain()).len(), robot.descriptors());
    let (files, descriptors) = held(&robot);
    let mut chance = Chance(2006);
    let mut kills = 0;
    for _round in 0..KILLS {
        for name in PROCESSES {
            let mut victim = None;
            let lives = wait_until(|| {
                victim = robot.processes().get(name).copied();
                victim.is_some()
            });
            assert!(lives, "`{name}` was not started anew\n{}", robot.said());
            // Some kills fall into start-up, some into normal operation.
            pause(Duration::from_micros(chance.below(60_000)));
            signal(victim.expect("lives"), Signal::KILL);
            kills += 1;
        }
    }
    assert!(robot.works(), "after {kills} kills: {:?}\n{}", robot.cycles(), robot.said());
    let restarts = robot.said().matches("starts anew").count();
    assert!(restarts >= kills * 9 / 10, "{restarts} restarts after {kills} kills");
    // No process died because of another's death.
    assert!(restarts <= kills, "{restarts} restarts after {kills} kills\n{}", robot.said());
    // Board readers release those of dead processes at their next read.
    wait_until(|| held(&robot).0 <= files + 5);
    let now = held(&robot);
    let said = format!("{files} files in shared memory and {descriptors} descriptors became {now:?}");
    assert!(files > 0 && descriptors > 0 && now.0 <= files + 5 && now.1 <= descriptors + 5, "{said}");
    let domain = robot.domain().to_owned();
    let (status, said) = robot.stop(Signal::INT);
    assert!(status.success(), "{status}\n{said}");
    assert_eq!(left_behind(&domain), [""; 0]);
}

#[test]
fn a_process_that_hangs_is_replaced() {
    let robot = Robot::ready("hang", &PATIENT);
    for name in PROCESSES {
        let mut lives = None;
        wait_until(|| {
            lives = robot.processes().get(name).copied();
            lives.is_some()
        });
        let hung = lives.expect("it is started anew where it died");
        signal(hung, Signal::STOP);
        let replaced = wait_until(|| robot.processes().get(name).is_some_and(|&pid| pid != hung));
        assert!(replaced, "`{name}` hangs on\n{}", robot.said());
    }
    assert!(robot.works(), "{}", robot.said());
    assert_eq!(robot.said().matches("hangs").count(), PROCESSES.len(), "{}", robot.said());
}

#[test]
fn a_killed_supervisor_ends_every_process_and_the_next_run_cleans_up() {
    let robot = Robot::ready("orphan", &[]);
    let processes = robot.processes();
    assert_eq!(processes.len(), PROCESSES.len());
    let domain = robot.domain().to_owned();
    let (status, _) = robot.stop(Signal::KILL);
    assert!(!status.success());
    // Robots of parallel tests clean up too when they start.
    assert!(!left_behind(&domain).is_empty(), "nothing was left to clear up");
    assert!(wait_until(|| !processes.values().any(|&pid| is_alive(pid))), "{processes:?} live on");
    let next = Robot::ready("heir", &[]);
    assert_eq!(left_behind(&domain), [""; 0]);
    next.stop(Signal::TERM);
}

#[test]
fn two_robots_run_side_by_side_and_one_ends_without_the_other() {
    let (one, other) = (Robot::ready("one", &[]), Robot::ready("other", &[]));
    assert!(one.works() && other.works());
    let gone = one.domain().to_owned();
    let (status, said) = one.stop(Signal::TERM);
    assert!(status.success(), "{status}\n{said}");
    assert_eq!(left_behind(&gone), [""; 0]);
    assert!(other.works(), "{}", other.said());
    let gone = other.domain().to_owned();
    other.stop(Signal::TERM);
    assert_eq!(left_behind(&gone), [""; 0]);
}

#[test]
fn a_process_that_cannot_be_kept_alive_ends_the_run_loudly() {
    let mut robot = Robot::ready("giving-up", &[("max_deaths", "3")]);
    let domain = robot.domain().to_owned();
    for _death in 0..3 {
        let mut victim = None;
        let lives = wait_until(|| {
            victim = robot.processes().get("sensor").copied();
            victim.is_some()
        });
        assert!(lives, "{}", robot.said());
        signal(victim.expect("lives"), Signal::KILL);
        wait_until(|| !is_alive(victim.expect("lived")));
    }
    assert_eq!(robot.end().code(), Some(1), "{}", robot.said());
    assert!(robot.said().contains("sensor"), "{}", robot.said());
    assert_eq!(left_behind(&domain), [""; 0]);
}

#[test]
fn without_perspective_taking_no_perspective_but_the_robots_is_computed() {
    /// For each perspective its path, and its step and belief counts.
    fn computed(robot: &Robot) -> Vec<(String, u64, u64)> {
        let rows = robot.rows();
        let row = rows.iter().find(|row| row["process"] == "belief");
        let perspectives = row.and_then(|row| row["perspectives"].as_array()).cloned().unwrap_or_default();
        let count = |value: &serde_json::Value| value.as_u64().expect("a count");
        perspectives
            .iter()
            .map(|row| (row["path"].to_string(), count(&row["steps"]), count(&row["beliefs"])))
            .collect()
    }
    for (partners, paths) in [("0", ["[]"].as_slice()), ("1", &["[]", "[1]"])] {
        let robot = Robot::ready("perspectives", &[("partners", partners)]);
        let mut seen = Vec::new();
        let believes = wait_until(|| {
            seen = computed(&robot);
            !seen.is_empty() && seen.iter().all(|(_, steps, beliefs)| *steps > 0 && *beliefs > 0)
        });
        assert!(believes, "{partners} partners: {seen:?}\n{}", robot.said());
        let of: Vec<&str> = seen.iter().map(|(path, ..)| path.as_str()).collect();
        assert_eq!(of, paths, "{partners} partners");
        robot.stop(Signal::TERM);
    }
}

#[test]
fn the_cores_are_kept_awake_while_the_robot_runs_if_configured() {
    let request = Path::new("/dev/cpu_dma_latency");
    if fs::OpenOptions::new().write(true).open(request).is_err() {
        skip::skip(format_args!("needs the right to write to {}", request.display()));
        return;
    }
    for wanted in [true, false] {
        let robot = Robot::ready("awake", &[("keep_cores_awake", &wanted.to_string())]);
        let files = fs::read_dir(format!("/proc/{}/fd", robot.pid())).expect("it runs");
        let asks = files.flatten().any(|file| fs::read_link(file.path()).is_ok_and(|file| file == request));
        assert_eq!(asks, wanted);
        let (status, said) = robot.stop(Signal::INT);
        assert!(status.success(), "{status}\n{said}");
    }
}

/// The scheduling policy of every unbound kernel worker with default niceness: 0 is ordinary, 1 real-time.
fn policies_of_serial_workers() -> Vec<String> {
    let processes = fs::read_dir("/proc").expect("reads").flatten();
    let policy = |stat: String| {
        let (name, rest) = stat.rsplit_once(')')?;
        let fields: Vec<&str> = rest.split_whitespace().collect();
        let is_worker =
            name.contains("(kworker/u") && fields.get(1) == Some(&"2") && fields.get(16) == Some(&"0");
        is_worker.then(|| fields.get(38).map(ToString::to_string))?
    };
    processes.filter_map(|process| policy(fs::read_to_string(process.path().join("stat")).ok()?)).collect()
}

#[test]
fn serial_line_workers_do_not_wait_for_ordinary_work() {
    let check = leo(&["check", "--seconds", "0", "--json"]).output().expect("runs");
    let findings: Vec<serde_json::Value> = serde_json::from_slice(&check.stdout).expect("JSON");
    let lines = findings.iter().find(|finding| finding["about"] == "serial lines").expect("a finding");
    if lines["verdict"] != "good" {
        skip::skip("needs CAP_SYS_NICE, and to see the kernel's threads");
        return;
    }
    let robot = Robot::ready("carriers", &[]);
    let mut policies = Vec::new();
    // Another robot that ends on this machine resets them for a moment.
    let prompt = wait_until(|| {
        policies = policies_of_serial_workers();
        !policies.is_empty() && policies.iter().all(|policy| policy == "1")
    });
    assert!(prompt, "{policies:?}\n{}", robot.said());
    let (status, said) = robot.stop(Signal::INT);
    assert!(status.success(), "{status}\n{said}");
}

#[test]
fn a_run_ends_after_its_time_and_removes_all_files() {
    let domain = domain("timed");
    let state = tempfile::tempdir().expect("a folder");
    let ended = leo(&["run", "--for", "0.5", "--domain"])
        .arg(&domain)
        .env("XDG_STATE_HOME", state.path())
        .output()
        .expect("runs");
    assert!(ended.status.success(), "{}", said(&ended));
    assert_eq!(left_behind(&domain), [""; 0]);
}

#[test]
fn a_second_supervisor_in_a_domain_is_refused() {
    let robot = Robot::ready("taken", &[]);
    let second = leo(&["run", "--for", "1", "--domain"]).arg(robot.domain()).output().expect("runs");
    assert_eq!(second.status.code(), Some(1), "{}", said(&second));
    assert!(said(&second).contains("already runs"), "{}", said(&second));
    assert!(robot.works(), "the first one suffered\n{}", robot.said());
}

#[test]
fn a_wrong_or_missing_file_is_refused_before_anything_starts() {
    let files = tempfile::tempdir().expect("a folder");
    let wrong = files.path().join("leo.toml");
    fs::write(&wrong, "[buffers]\nobject = 3\n").expect("writes");
    let missing = files.path().join("nowhere.toml");
    let domain = domain("refused");
    for (flag, file, word) in [
        ("--config", &wrong, "leo.toml:2:1"),
        ("--config", &missing, "nowhere.toml"),
        ("--lesson", &missing, "nowhere.toml"),
    ] {
        let refused = leo(&["run", "--domain"]).arg(&domain).arg(flag).arg(file).output().expect("runs");
        assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
        assert!(said(&refused).contains(word), "{}", said(&refused));
        assert_eq!(left_behind(&domain), [""; 0]);
    }
}

fn said(ended: &Output) -> String {
    String::from_utf8_lossy(&ended.stderr).into_owned()
}
