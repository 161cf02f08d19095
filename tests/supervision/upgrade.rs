//! Replacing the program and its files does not affect a running robot.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::process::{Command, Stdio};

use rustix::process::Signal;

use super::robot::{PROCESSES, Robot, left_behind, leo, signal, wait_until};

#[test]
fn a_process_restarts_with_its_original_program_and_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("leo");
    fs::copy(env!("CARGO_BIN_EXE_leo"), &program).expect("copies");
    let (lesson, campaign) = (folder.path().join("lesson.toml"), folder.path().join("campaign.toml"));
    let root = env!("CARGO_MANIFEST_DIR");
    fs::copy(format!("{root}/config/lessons/task1.toml"), &lesson).expect("copies");
    fs::write(&campaign, "seed = 7\n").expect("writes");
    let mut command = Command::new(&program);
    command.env_remove("RUST_LOG").stdin(Stdio::null());
    let [played, faults] = [&lesson, &campaign].map(|file| file.to_str().expect("is text"));
    let robot = Robot::by(command, "upgraded", &[], &["--lesson", played, "--faults", faults]);
    assert!(wait_until(|| robot.said().contains("the robot runs")), "{}", robot.said());

    // As a package manager does: a new file of the same name.
    let other = folder.path().join("other");
    fs::write(&other, "#!/bin/sh\nexit 2\n").expect("writes");
    fs::set_permissions(&other, fs::Permissions::from_mode(0o755)).expect("ours");
    fs::rename(&other, &program).expect("replaces");
    // The configuration is being edited.
    for file in [robot.config(), lesson, campaign] {
        fs::write(file, "[sens").expect("writes");
    }
    fs::write(robot.config().with_file_name("percepts.toml"), "[sens").expect("writes");

    for name in PROCESSES {
        let before = robot.processes().get(name).copied().expect("lives");
        signal(before, Signal::KILL);
        let anew = || robot.processes().get(name).is_some_and(|&pid| pid != before);
        assert!(wait_until(anew), "`{name}` does not start anew\n{}", robot.said());
    }
    assert!(robot.works(), "{}", robot.said());
    // Process names still show what they are.
    for (name, pid) in robot.processes() {
        let line = fs::read_to_string(format!("/proc/{pid}/cmdline")).expect("lives");
        let expected = format!("{}\0{name}\0", program.display());
        assert!(line.starts_with(&expected), "{line}");
        assert_eq!(fs::read_to_string(format!("/proc/{pid}/comm")).expect("lives"), "leo\n");
    }
    let domain = robot.domain().to_owned();
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{said}");
    assert_eq!(left_behind(&domain), [""; 0]);
}

#[test]
fn a_program_with_other_messages_can_still_stop_the_robot() {
    let robot = Robot::ready("other", &[]);
    // As an older program would have left it.
    fs::write(robot.domain().join("program"), "Leo 0.0.1\n0123456789abcdef\n").expect("writes");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("x.mcap");
    let domain = robot.domain().to_str().expect("is text");
    for arguments in [
        vec!["top", "--domain", domain],
        vec!["top", "--openmetrics", "--domain", domain],
        vec!["record", file.to_str().expect("is text"), "--for", "1", "--domain", domain],
    ] {
        let output = leo(&arguments).output().expect("runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{output:?}");
        assert!(output.stdout.is_empty() && said.lines().count() == 1, "{output:?}");
        assert!(said.contains("runs Leo 0.0.1 with other messages, and this is Leo "), "{said}");
        assert!(said.contains("restart it, or use its own program"), "{said}");
    }
    assert!(!file.exists(), "nothing is recorded, and no file made");
    let output = leo(&["emergency-stop", "--domain", domain]).output().expect("runs");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success() && said.contains("all 65 servos say that their torque is off"),
        "{output:?}"
    );
    let domain = robot.domain().to_owned();
    let (_, said) = robot.stop(Signal::TERM);
    assert!(said.contains("EMERGENCY STOP"), "{said}");
    // The stop would remain for the next robot of that name.
    fs::remove_dir_all(domain).expect("the emergency stop outlives its robot");
}
