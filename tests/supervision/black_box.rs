//! The black box: a file of what led to a failure, without a running recorder.

use std::fs;
use std::path::{Path, PathBuf};

use clock::{Duration, Instant};
use message::TopicId;
use recording::Reader;
use rustix::process::Signal;

use super::robot::{Robot, leo, signal, wait_until};

/// The incarnations of the belief process in a recording, and its extent before and after the second one's
/// first frame.
fn lives(file: &Path) -> (Vec<u64>, Duration, Duration) {
    let mut reader = Reader::open(file).expect("a recording");
    let mut lives = Vec::new();
    let (mut oldest, mut newest, mut second) = (None, 0, 0);
    for frame in reader.by_ref() {
        let frame = frame.expect("is whole");
        oldest.get_or_insert(frame.at_ns);
        newest = newest.max(frame.at_ns);
        if frame.topic == TopicId::Beliefs(0) && lives.last() != Some(&frame.header().incarnation) {
            lives.push(frame.header().incarnation);
            second = frame.at_ns;
        }
    }
    assert!(!reader.is_cut());
    let at = Instant::from_nanos;
    let oldest = oldest.expect("there are frames");
    (lives, at(second).since(at(oldest)), at(newest).since(at(second)))
}

/// Waits for a file of the robot whose name contains a word.
fn file_of(robot: &Robot, word: &str) -> PathBuf {
    let named = |file: &PathBuf| file.to_string_lossy().contains(word);
    let mut files = Vec::new();
    assert!(
        wait_until(|| {
            files = robot.black_boxes();
            files.iter().any(named)
        }),
        "{files:?}\n{}",
        robot.said()
    );
    files.into_iter().find(named).expect("is there")
}

fn asked(robot: &Robot) -> (Option<i32>, String, String) {
    let output = leo(&["record", "--black-box", "--domain"]).arg(robot.domain()).output().expect("runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_dump_contains_the_time_before_and_after_a_death() {
    let robot = Robot::ready("black-box", &[("black_box_files", "2")]);
    assert!(robot.works(), "{}", robot.said());
    let believes = || robot.cycles().get("belief").is_some_and(|cycles| *cycles > 600);
    assert!(wait_until(believes), "{}", robot.said());
    assert!(robot.black_boxes().is_empty(), "nothing has failed: {:?}", robot.black_boxes());
    signal(robot.processes()["belief"], Signal::KILL);
    assert!(wait_until(|| robot.said().contains("starts anew")), "{}", robot.said());
    // A requested dump does not cut off what follows the death.
    let (status, first, _) = asked(&robot);
    assert!(status == Some(0) && first.trim().ends_with("_asked.mcap"), "{first}");
    let file = file_of(&robot, "belief");
    let (of, before, after) = lives(&file);
    assert_eq!(of, [1, 2], "{file:?}");
    assert!(before > Duration::from_secs(1) && after > Duration::from_secs(1), "{before:?} {after:?}");
    // It can be requested repeatedly, and the oldest requested dump is removed.
    for _ in 0..2 {
        let (status, out, err) = asked(&robot);
        assert_eq!((status, err.as_str()), (Some(0), ""), "{out}");
        assert_eq!(lives(Path::new(out.trim())).0, [1, 2], "{out}");
    }
    assert!(wait_until(|| !Path::new(first.trim()).exists()), "{:?}", robot.black_boxes());
    assert!(
        robot.black_boxes().len() == 3 && file.exists(),
        "who asks takes no failure's: {:?}",
        robot.black_boxes()
    );
    let (status, said) = robot.stop(Signal::INT);
    assert!(status.success(), "{status}\n{said}");
}

#[test]
fn an_emergency_stop_and_a_silent_servo_are_failures() {
    let mut robot = Robot::ready("stopped-box", &[]);
    assert!(robot.works(), "{}", robot.said());
    fs::write(robot.domain().join("emergency-stop"), "a test\n").expect("raised");
    let file = file_of(&robot, "emergency-stop");
    fs::remove_file(robot.domain().join("emergency-stop")).expect("released");
    assert!(Reader::open(&file).expect("a recording").all(|frame| frame.is_ok()));
    signal(robot.pid(), Signal::INT);
    assert!(robot.end().success(), "{}", robot.said());
    assert_eq!(robot.black_boxes(), [file]);

    let mut robot = Robot::start("absent-box", &[("faults", r#"["drop bus=torso id=5 p=1"]"#)]);
    file_of(&robot, "quarantine");
    // At the end, the pending dump of the last failure is written without the usual minimum interval.
    signal(robot.processes()["sensor"], Signal::KILL);
    assert!(wait_until(|| robot.said().contains("starts anew")), "{}", robot.said());
    assert!(robot.works(), "{}", robot.said());
    signal(robot.pid(), Signal::INT);
    assert!(robot.end().success(), "{}", robot.said());
    file_of(&robot, "sensor");
}

#[test]
fn a_robot_without_a_black_box_reports_it() {
    let robot = Robot::ready("no-box", &[("black_box_s", "0.0")]);
    let (status, out, err) = asked(&robot);
    assert_eq!((status, out.as_str()), (Some(1), ""));
    assert!(err.contains("`console.black_box_s` is 0"), "{err}");
    signal(robot.processes()["sensor"], Signal::KILL);
    assert!(robot.works(), "{}", robot.said());
    let (status, said) = robot.stop(Signal::INT);
    assert!(status.success(), "{status}\n{said}");
}
