//! However a robot ends, its servos have no torque afterwards. The servos outlive the robot and are read by
//! another master.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

#[path = "../masters/mock_bus.rs"]
#[expect(dead_code, reason = "other tests use the rest")]
mod mock_bus;
mod rig;

use std::fs;
use std::process::{Command, Stdio};

use clock::Duration;
use process::arming::{self, ArmOrder};
use rustix::process::Signal;

use torque::{Cause, Report, UnconfirmedServo};

use rig::{JOINTS, OFF_WITHIN, Rig, end_of, leo, program, remove_shared_memory, signal, until};

/// The message that every servo confirmed torque off.
fn confirmed() -> String {
    Report { confirmed: JOINTS, unconfirmed: Vec::new() }.to_string()
}

#[test]
fn an_orderly_end_leaves_no_torque_on() {
    let rig = Rig::new("end-order");
    let mut robot = rig.run();
    rig.follow();
    let ended_at = clock::now();
    signal(rig.pid("run"), Signal::TERM);
    assert!(end_of(&mut robot).is_some_and(|status| status.success()), "{}", rig.said());
    rig.is_off(ended_at);
    assert!(!rig.said().contains("torque"), "nothing is to be said: {}", rig.said());
}

#[test]
fn a_terminal_that_is_closed_leaves_no_torque_on() {
    let rig = Rig::new("end-terminal");
    let mut terminal = rig.run_in_terminal();
    rig.follow();
    let ended_at = clock::now();
    terminal.close();
    rig.is_off(ended_at);
    assert!(end_of(&mut terminal.shell).is_some());
    assert!(!rig.said().contains("killed"), "nobody was impatient: {}", rig.said());
}

#[test]
fn pressing_ctrl_c_twice_leaves_no_torque_on() {
    let rig = Rig::new("end-twice");
    let mut robot = rig.run();
    rig.follow();
    let (supervisor, motor) = (rig.pid("run"), rig.pid("motor"));
    let ended_at = clock::now();
    for _ in 0..2 {
        signal(supervisor, Signal::INT);
        // Before the motor process can have ended.
        clock::sleep_until(clock::now() + Duration::from_millis(5));
        // Further signals do not shorten the motor process's shutdown.
        signal(motor, Signal::INT);
        signal(motor, Signal::HUP);
        signal(motor, Signal::TERM);
    }
    assert!(end_of(&mut robot).is_some_and(|status| status.success()), "{}", rig.said());
    rig.is_off(ended_at);
    assert!(!rig.said().contains("no motor process runs"), "it was killed: {}", rig.said());
}

#[test]
fn a_killed_supervisor_leaves_no_torque_on() {
    let rig = Rig::new("end-supervisor");
    let mut robot = rig.run();
    rig.follow();
    let ended_at = clock::now();
    signal(rig.pid("run"), Signal::KILL);
    end_of(&mut robot);
    rig.is_off(ended_at);
    assert!(!rig.said().contains("torque"), "the motor process ends in order: {}", rig.said());
}

/// Whether a process has undelivered signals.
fn has_pending_signals(process: i32) -> bool {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let mut pending =
        status.lines().filter(|line| line.starts_with("SigPnd:") || line.starts_with("ShdPnd:"));
    pending.any(|line| !line.ends_with("\t0000000000000000"))
}

#[test]
fn a_supervisor_and_motor_process_killed_together_leave_no_torque_on() {
    let rig = Rig::new("end-both");
    let mut robot = rig.run();
    rig.follow();
    let (supervisor, motor, guard) = (rig.pid("run"), rig.pid("motor"), rig.pid("torque-guard"));
    // Signals do not end the guard, and a killed guard is replaced.
    for each in [Signal::TERM, Signal::INT, Signal::HUP] {
        signal(guard, each);
        assert!(until(OFF_WITHIN, || !has_pending_signals(guard)), "{each:?} is not delivered");
        assert_eq!(rig.processes().get("torque-guard"), Some(&guard), "{each:?} ended it");
    }
    signal(guard, Signal::KILL);
    let replaced = until(OFF_WITHIN, || rig.processes().get("torque-guard").is_some_and(|&pid| pid != guard));
    assert!(replaced, "{}", rig.said());
    let ended_at = clock::now();
    signal(supervisor, Signal::KILL);
    signal(motor, Signal::KILL);
    end_of(&mut robot);
    rig.is_off(ended_at);
    let said = rig.said();
    assert!(said.contains(&confirmed()), "{said}");
}

#[test]
fn a_supervisor_killed_between_motor_restarts_leaves_no_torque_on() {
    let rig = Rig::new("end-between");
    let mut robot = rig.run();
    rig.follow();
    let (supervisor, motor) = (rig.pid("run"), rig.pid("motor"));
    signal(motor, Signal::KILL);
    // The motor process is restarted and is still starting up.
    rig.pid("motor");
    let ended_at = clock::now();
    signal(supervisor, Signal::KILL);
    end_of(&mut robot);
    rig.is_off(ended_at);
}

#[test]
fn after_the_death_of_all_processes_torque_remains_only_with_watchdog() {
    let rig = Rig::new("end-watchdog");
    let mut with_torque = 0;
    // Each robot starts with the servos as the one before left them: with torque from the first robot that
    // got that far.
    for lives_ms in [1200, 150, 300, 450, 600, 800, 1000, 1500] {
        let mut robot = rig.run();
        let lives_until = clock::now() + Duration::from_millis(lives_ms);
        rig.pid("motor");
        until(lives_until.since(clock::now()), || {
            // The folder may not exist yet.
            let _ordered = arming::order(&rig.domain, ArmOrder { acknowledged_locks: None });
            false
        });
        rig.kill_all();
        end_of(&mut robot);
        assert!(until(OFF_WITHIN, || rig.processes().is_empty()), "{}", rig.said());
        for servo in rig.servos().unwrap_or_default().iter().filter(|servo| servo.has_torque) {
            with_torque += 1;
            assert!(servo.watchdog != 0, "after {lives_ms} ms: {}", servo.name);
        }
    }
    assert!(with_torque > 0 || rig.servos().is_none(), "no robot came so far");
}

#[test]
fn a_robot_with_a_full_log_disk_ends_in_order() {
    let rig = Rig::new("end-disk");
    let mut command = Command::new("/bin/sh");
    command.args(["-c", "exec \"$0\" \"$@\" >/dev/full 2>/dev/full"]).arg(program());
    let mut robot = rig.run_by(command);
    rig.follow();
    let ended_at = clock::now();
    signal(rig.pid("run"), Signal::TERM);
    assert!(end_of(&mut robot).is_some_and(|status| status.success()));
    rig.is_off(ended_at);
}

#[test]
fn a_motor_process_that_cannot_be_kept_alive_leaves_no_torque_on() {
    gives_up(&Rig::new("end-gave-up"));
}

#[test]
fn giving_up_on_the_mock_servo_bus_leaves_no_torque_on() {
    let rig = Rig::simulated("end-mock");
    gives_up(&rig);
    assert!(!rig.said().contains("guard"), "there is none where every servo is a mock: {}", rig.said());
}

/// Kills the motor process until the supervisor gives up.
fn gives_up(rig: &Rig) {
    let mut robot = rig.run();
    rig.follow();
    let mut killed = 0;
    while robot.try_wait().expect("ours").is_none() {
        if let Some(&motor) = rig.processes().get("motor").filter(|&&motor| motor != killed) {
            signal(motor, Signal::KILL);
            killed = motor;
        }
    }
    rig.is_off(clock::now());
    let said = rig.said();
    assert!(said.contains("gave up") && said.contains("`motor`"), "{said}");
    assert!(said.contains(&confirmed()), "{said}");
}

#[test]
fn a_hung_motor_process_during_shutdown_leaves_no_torque_on() {
    let said = stands_still(Signal::TERM);
    assert!(said.contains(": killed"), "{said}");
    assert!(said.contains(&confirmed()), "{said}");
}

#[test]
fn a_hung_motor_process_with_a_killed_supervisor_leaves_no_torque_on() {
    // The motor process may end before it is stopped again.
    let stood = (0..10).map(|_| stands_still(Signal::KILL)).find(|said| !said.is_empty());
    let said = stood.expect("it stood still once");
    assert!(said.contains(": killed"), "{said}");
    assert!(said.contains(&confirmed()), "{said}");
}

/// Stops the motor process, then ends the supervisor; returns the robot's log.
fn stands_still(how: Signal) -> String {
    let rig = Rig::new("end-still");
    let mut robot = rig.run();
    rig.follow();
    let (supervisor, motor) = (rig.pid("run"), rig.pid("motor"));
    let ended_at = clock::now();
    signal(motor, Signal::STOP);
    signal(supervisor, how);
    // The kernel continues the children of a dead parent, so the process is stopped again.
    while clock::now() < ended_at + Duration::from_millis(300) {
        signal(motor, Signal::STOP);
    }
    end_of(&mut robot);
    rig.is_off(ended_at);
    rig.said()
}

#[test]
fn a_restarted_robot_waits_for_the_killed_ones_motor_process() {
    let rig = Rig::new("end-again");
    let mut robot = rig.run();
    rig.follow();
    let motor = rig.pid("motor");
    signal(rig.pid("run"), Signal::KILL);
    let _killed = robot.wait().expect("ours");
    let mut robot = rig.run();
    assert!(
        until(OFF_WITHIN, || rig.processes().get("motor").is_some_and(|&pid| pid != motor)),
        "{}",
        rig.said()
    );
    rig.follow();
    let ended_at = clock::now();
    signal(rig.pid("run"), Signal::TERM);
    assert!(end_of(&mut robot).is_some_and(|status| status.success()), "{}", rig.said());
    rig.is_off(ended_at);
    assert!(!rig.domain.exists(), "{}", rig.said());
}

#[test]
fn a_servo_that_is_silent_at_the_end_is_named() {
    let mut rig = Rig::new("end-silent");
    let mut robot = rig.run();
    rig.follow();
    rig.mock.tell("fault drop bus=torso id=3");
    let ended_at = clock::now();
    signal(rig.pid("run"), Signal::TERM);
    assert!(end_of(&mut robot).is_some());
    rig.mock.tell("clear");
    rig.is_off(ended_at);
    let said = rig.said();
    let silent = UnconfirmedServo {
        joint: "torso_roll_joint".to_owned(),
        bus: "torso".to_owned(),
        id: 3,
        cause: Cause::Silent,
    };
    assert!(said.contains(&silent.to_string()), "{said}");
    assert!(said.contains(&Report::advice(Some(&rig.config()))), "{said}");
}

#[test]
fn removed_shared_memory_stops_the_robot_with_a_reason() {
    for is_all in [true, false] {
        let rig = Rig::new("end-memory");
        let mut robot = rig.run();
        rig.follow();
        let ended_at = clock::now();
        if is_all {
            fs::remove_dir_all(&rig.domain).expect("is there");
        }
        remove_shared_memory(&rig.domain);
        let status = end_of(&mut robot);
        assert_eq!(status.and_then(|status| status.code()), Some(1), "{}", rig.said());
        rig.is_off(ended_at);
        let said = rig.said();
        assert!(said.contains(&rig.domain.display().to_string()) && said.contains("RemoveIPC=no"), "{said}");
        assert!(said.contains("loginctl enable-linger") && !said.contains("refused"), "{said}");
    }
}

#[test]
fn an_emergency_stop_reaches_a_motor_process_whose_shared_memory_is_gone() {
    let rig = Rig::new("stop-memory");
    let mut robot = rig.run();
    rig.follow();
    let (supervisor, motor) = (rig.pid("run"), rig.pid("motor"));
    // Stopped, because the supervisor would react too.
    signal(supervisor, Signal::STOP);
    fs::remove_dir_all(&rig.domain).expect("is there");
    remove_shared_memory(&rig.domain);
    let stop =
        leo(&["emergency-stop", "--domain"]).arg(&rig.domain).stdout(Stdio::piped()).spawn().expect("runs");
    let stopped = until(OFF_WITHIN, || rig.said().contains("EMERGENCY STOP"));
    assert!(stopped, "{}", rig.said());
    let ended_at = clock::now();
    signal(supervisor, Signal::CONT);
    let output = stop.wait_with_output().expect("ends");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    end_of(&mut robot);
    rig.is_off(ended_at);
    let reached = format!("reached by the signal SIGUSR1 to its motor process {motor} and the file");
    assert!(said.contains(&reached), "{said}{}", rig.said());
}

#[test]
fn an_emergency_stop_without_a_motor_process_opens_the_buses() {
    let mut rig = Rig::new("stop-none");
    let mut robot = rig.run();
    rig.follow();
    rig.kill_all();
    end_of(&mut robot);
    assert!(until(OFF_WITHIN, || rig.processes().is_empty()));
    assert_eq!(rig.with_torque().len(), JOINTS, "the servos outlive the robot");
    for servo in rig.servos().unwrap_or_default() {
        assert!(servo.has_torque && servo.watchdog != 0, "{}: {}", servo.name, servo.watchdog);
    }
    let stop = || {
        let output = leo(&["emergency-stop", "--domain"]).arg(&rig.domain).output().expect("runs");
        (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    // The command finds the configuration with which the robot was started.
    let (status, said) = stop();
    assert_eq!(status, Some(0), "{said}");
    assert!(said.contains(&confirmed()), "{said}");
    assert_eq!(rig.with_torque(), []);
    rig.mock.tell("fault drop bus=torso id=3");
    let output = leo(&["emergency-stop", "--domain"]).arg(&rig.domain).output().expect("runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("NOT CONFIRMED") && said.contains("torso_roll_joint (bus torso, id 3)"), "{said}");
    rig.mock.tell("clear");

    // For a robot that never ran here, the configuration must be given.
    let never = rig.domain.with_extension("never");
    let never = std::path::PathBuf::from(never.to_str().expect("letters").replace('.', "-"));
    let stop = |more: &[&str]| {
        let output = leo(&["emergency-stop", "--domain"]).arg(&never).args(more).output().expect("runs");
        (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let (status, said) = stop(&["--config", rig.config().to_str().expect("letters")]);
    assert!(status == Some(0) && said.contains(&confirmed()), "{said}");
    let (status, said) = stop(&[]);
    assert!(status == Some(1) && said.contains("NOT CONFIRMED"), "{said}");
    assert_eq!(stop(&["--release"]).0, Some(0));
    assert!(!never.exists());
}
