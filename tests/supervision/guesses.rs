//! Names of shared memory: they are not predictable, and a guessed one costs one start of a process.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use rustix::process::Signal;

use super::PATIENT;
use super::robot::{Robot, leo, signal, wait_until};
use testkit::robot::left_behind;

/// The process that is killed.
const VICTIM: &str = "sensor";
/// Minimum number of shared memory files that each of its starts creates.
const MIN_CREATIONS: usize = 8;
/// Minimum number of guessed names with which a start must fail, so that the test is not vacuous.
const MIN_FAILED: usize = 5;

fn victim(robot: &Robot) -> Option<i32> {
    robot.processes().get(VICTIM).copied()
}

/// Kills the process; waits until another instance of it runs, and returns its process id.
fn replaced(robot: &Robot) -> i32 {
    let old = victim(robot).expect("it runs");
    signal(old, Signal::KILL);
    let mut new = None;
    let is_back = wait_until(|| {
        new = victim(robot).filter(|new| *new != old);
        let rows = robot.rows();
        let row = rows.iter().find(|row| row["process"] == VICTIM).cloned().unwrap_or_default();
        new.is_some_and(|new| row["pid"] == new) && row["state"] == "running"
    });
    assert!(is_back, "`{VICTIM}` is not replaced\n{}", robot.said());
    new.expect("it runs")
}

/// The files of shared memory that a process has mapped.
pub(super) fn mapped(robot: &Robot, pid: i32) -> BTreeSet<String> {
    let prefix = format!("{}_", robot.domain().display());
    let maps = fs::read_to_string(format!("/proc/{pid}/maps")).expect("it runs");
    maps.lines()
        .filter_map(|line| line.find(&prefix).and_then(|at| line.get(at..)))
        .map(str::to_owned)
        .collect()
}

/// Process id, count and time (seconds, nanoseconds) of each identifier in a file's name.
fn identifiers(name: &str) -> Vec<(u128, u128, (u128, u128))> {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let part = |identifier: u128, at: u32| (identifier >> (32 * at)) & u128::from(u32::MAX);
    let of = |id| (part(id, 2), part(id, 3), (part(id, 0), part(id, 1)));
    stem.split('_').filter_map(|word| word.parse().ok()).map(of).collect()
}

#[test]
fn successive_instances_of_a_process_share_no_name_of_their_segments() {
    let robot = Robot::ready("names", &PATIENT);
    assert!(robot.works(), "{}", robot.said());
    let mut known = BTreeSet::new();
    let mut pid = victim(&robot).expect("it runs");
    for instance in 0..4 {
        let number = u128::try_from(pid).expect("a process number");
        let made: BTreeSet<String> = mapped(&robot, pid)
            .into_iter()
            .filter(|name| identifiers(name).iter().any(|(of, ..)| *of == number))
            .collect();
        assert!(made.len() >= MIN_CREATIONS, "{made:?}");
        let shared: Vec<_> = made.intersection(&known).collect();
        assert!(shared.is_empty(), "instance {instance}: {shared:?}");
        // A process id can be used again, but the time is never the same.
        let own = made.iter().flat_map(|name| identifiers(name)).filter(|(of, ..)| *of == number);
        let own: BTreeSet<_> = own.collect();
        let times: BTreeSet<_> = own.iter().map(|(.., time)| *time).collect();
        let counts: BTreeSet<_> = own.iter().map(|(_, count, _)| *count).collect();
        assert!(times.len() > 2 && counts.len() > 1, "{own:?}");
        assert!(times.iter().any(|(_, nanoseconds)| nanoseconds % 1000 != 0), "coarse times: {times:?}");
        known.extend(made);
        pid = replaced(&robot);
    }
    let (status, said) = robot.stop(Signal::INT);
    assert!(status.success(), "{status}\n{said}");
}

/// The library that creates a file at a name before the process does. `None` if there is no C compiler.
fn library(folder: &Path) -> Option<PathBuf> {
    let library = folder.join("guess.so");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/supervision/guess_name.c");
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-o"]).arg(&library).arg(source);
    let is_compiled = compiler.status().is_ok_and(|status| status.success());
    if !is_compiled {
        skip::skip("a C compiler is needed to create files in time");
    }
    is_compiled.then_some(library)
}

#[test]
fn a_file_at_a_guessed_name_costs_one_start_of_a_process() {
    let files = tempfile::tempdir().expect("a folder");
    let Some(library) = library(files.path()) else { return };
    let mut command = leo(&[]);
    command.env("LD_PRELOAD", library).env("LEO_GUESSES", files.path());
    let robot = Robot::by(command, "guessed", &PATIENT, &[]);
    assert!(robot.works(), "{}", robot.said());
    let others = |robot: &Robot| {
        let mut others = robot.processes();
        others.remove(VICTIM);
        others
    };
    let before = others(&robot);
    let mut planted: Vec<String> = Vec::new();
    let starts = || robot.said().matches(&format!("starts anew process={VICTIM}")).count();
    // Each file that a start creates is guessed once; a start that creates fewer ends the loop.
    for number in 1.. {
        let known = starts();
        fs::write(files.path().join("next"), format!("{number}")).expect("writes");
        replaced(&robot);
        assert!(!files.path().join("next").exists(), "the process did not load the library");
        let Ok(name) = fs::read_to_string(files.path().join("guessed")) else { break };
        // Without a connection the process starts, and gets no frames of one writer.
        let wanted = known + if name.ends_with(".connection") { 1 } else { 2 };
        assert!(
            wait_until(|| starts() == wanted),
            "{name}: {known}, {wanted}, {}\n{}",
            starts(),
            robot.said()
        );
        fs::remove_file(files.path().join("guessed")).expect("is there");
        planted.push(name.trim_start_matches('/').to_owned());
    }
    let connections = planted.iter().filter(|name| name.ends_with(".connection")).count();
    assert!(connections > 0 && planted.len() - connections >= MIN_FAILED, "{planted:?}\n{}", robot.said());
    assert_eq!(others(&robot), before, "{}", robot.said());
    assert!(robot.works(), "{}", robot.said());
    // The last instance gets all frames again.
    let observations = || {
        let rows = robot.rows();
        let row = rows.iter().find(|row| row["process"] == VICTIM).cloned().unwrap_or_default();
        row["sources"][0]["observations"].as_u64().unwrap_or(0)
    };
    assert!(wait_until(|| observations() > 0), "{}", robot.said());
    let domain = robot.domain().to_owned();
    let (status, said) = robot.stop(Signal::INT);
    for name in &planted {
        let _gone = fs::remove_file(Path::new("/dev/shm").join(name));
    }
    assert!(status.success(), "{status}\n{said}");
    assert_eq!(left_behind(&domain), [""; 0]);
}
