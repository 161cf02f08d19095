//! A killed observer leaves nothing behind that affects others.

use std::fs;
use std::process::Stdio;

use rustix::process::Signal;

use super::robot::{Robot, leo, wait_until};

/// Number of nodes in the domain.
fn nodes(robot: &Robot) -> usize {
    let entries = fs::read_dir(robot.domain().join("nodes")).expect("is there").flatten();
    entries.filter(|entry| entry.path().is_dir()).count()
}

#[test]
fn a_killed_onlooker_is_cleaned_up_without_a_process_death() {
    let robot = Robot::ready("onlooker", &[]);
    let before = nodes(&robot);
    assert!(before > 0, "{}", robot.said());
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = leo(&["record", "--domain"]);
    command.arg(robot.domain()).arg(folder.path().join("a.mcap")).stdout(Stdio::null());
    let mut onlooker = command.spawn().expect("starts");
    assert!(wait_until(|| nodes(&robot) > before), "nobody looks on\n{}", robot.said());
    onlooker.kill().and_then(|()| onlooker.wait()).expect("ours");
    assert!(wait_until(|| nodes(&robot) == before), "{} of {before}\n{}", nodes(&robot), robot.said());
    assert!(!robot.said().contains("starts anew"), "{}", robot.said());
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{said}");
}
