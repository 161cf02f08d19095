//! Moving joints by hand with `leo bus`: in joint coordinates, slowly, within limits.

use std::io::{BufRead as _, BufReader, Read as _};
use std::process::{Command, Stdio};

use rustix::process::{Pid, Signal, kill_process};
use servo::{position_count, velocity_count};
use tempfile::TempDir;

use crate::bench_tool::{read, refused, well};
use crate::mock_bus::MockBus;

const YAW: &str = "torso_yaw_joint";

/// A configuration with a reversed torso yaw joint and an offset.
fn turned() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let motor = read("config/motor.toml");
    let (before, rest) = motor.split_once("name = \"torso_yaw_joint\"").expect("is there");
    let rest = rest.replacen("sign = 1\noffset_rad = 0.0", "sign = -1\noffset_rad = 0.3", 1);
    let motor = format!("{before}name = \"torso_yaw_joint\"{rest}");
    assert_ne!(motor, read("config/motor.toml"));
    for (name, text) in [("leo.toml", read("config/leo.toml")), ("motor.toml", motor)] {
        std::fs::write(folder.path().join(name), text).expect("writes");
    }
    folder
}

/// The raw value of a register of the torso yaw servo.
fn count(mock: &MockBus, item: &str) -> i32 {
    let said = well(mock, &["read", "--id", "1", item]);
    said.split_whitespace().nth(1).and_then(|count| count.parse().ok()).expect("a count")
}

/// Whether the bus watchdog of the torso yaw servo trips during silence. Reading it counts as communication.
fn trips(mock: &MockBus) -> bool {
    crate::comes(|| {
        clock::sleep_until(clock::now() + clock::Duration::from_millis(250));
        count(mock, "bus_watchdog") == -1
    })
}

#[test]
fn a_joint_moves_slowly_within_its_limits_in_its_own_frame() {
    let mock = MockBus::start(&[]);
    let folder = turned();
    let leo = folder.path().join("leo.toml");
    let config = ["--config", leo.to_str().expect("letters")];
    let with = |words: &[&'static str]| [words, &config].concat();
    let mut wording = vec![refused(
        &mock,
        &with(&["write", YAW, "goal_position", "10deg"]),
        (1, "`leo bus torque on torso_yaw_joint`"),
    )];
    // The servo's centre is at 0.3 rad.
    let said = well(&mock, &with(&["torque", "on", YAW]));
    assert!(said.contains("17.2 deg (0.300 rad)"), "{said}");
    let said = well(&mock, &with(&["write", YAW, "goal_position", "-10deg"]));
    assert!(said.contains("from 17.2 deg (0.300 rad) to -10.0 deg"), "{said}");
    assert!(said.contains("is at -10.0 deg (-0.17"), "{said}");
    let expected = position_count(0.3 + 10_f64.to_radians());
    assert!((count(&mock, "present_position") - expected).abs() <= 1, "the servo turns the other way");
    assert_eq!(count(&mock, "profile_velocity"), velocity_count(0.5));
    assert!((1..10).contains(&count(&mock, "profile_acceleration")));
    assert!(trips(&mock), "it stops by itself once the tool has ended");
    // The motion is longer than the watchdog time-out; the tool feeds the watchdog and clears it first.
    let said = well(&mock, &with(&["write", YAW, "goal_position", "40deg"]));
    assert!(said.contains("is at 40.0 deg (0.69"), "{said}");

    let before = count(&mock, "present_position");
    let limits = "from -45.8 deg (-0.800 rad) to 45.8 deg (0.800 rad), and -170.0 deg (-2.967 rad)";
    wording.push(refused(&mock, &with(&["write", YAW, "goal_position", "-170deg"]), (1, limits)));
    wording.push(refused(&mock, &with(&["write", YAW, "goal_position", "2048"]), (2, "`2048`")));
    assert_eq!(count(&mock, "present_position"), before);
    well(&mock, &["torque", "off", YAW]);
    well(&mock, &["write", YAW, "homing_offset", "100"]);
    wording.push(refused(&mock, &with(&["torque", "on", YAW]), (1, "homing_offset is 100")));
    insta::assert_snapshot!(wording.join("\n"));
}

#[test]
fn torque_comes_on_where_a_joint_stands_and_not_beyond_its_limits() {
    let mock = MockBus::start(&[]);
    well(&mock, &["write", YAW, "profile_velocity", "0"]);
    let mut wording = vec![
        refused(&mock, &["torque", "on", "--id", "1"], (2, "--raw")),
        refused(&mock, &["write", "--id", "1", "torque_enable", "1"], (2, "--raw")),
        refused(&mock, &["torque", "on", "--id", "1", "--raw"], (2, "--yes")),
    ];
    well(&mock, &["torque", "on", "--id", "1", "--raw", "--yes"]);
    assert_eq!((count(&mock, "goal_position"), count(&mock, "present_position")), (2048, 2048));
    // Past the limit of 0.8 rad, which only raw values allow.
    well(&mock, &["write", "--id", "1", "bus_watchdog", "0"]);
    well(&mock, &["write", "--id", "1", "goal_position", "2048", "--raw", "--yes"]);
    let far = position_count(1.2);
    well(&mock, &["write", "--id", "1", "goal_position", &far.to_string(), "--raw", "--yes"]);
    assert!(crate::comes(|| count(&mock, "present_position") == far));
    let stands = (1, "68.7 deg (1.200 rad)");
    wording.push(refused(&mock, &["write", YAW, "goal_position", "0deg"], stands));
    well(&mock, &["torque", "off"]);
    wording.push(refused(&mock, &["torque", "on", YAW], stands));
    wording.push(refused(&mock, &["write", YAW, "torque_enable", "1"], stands));
    assert_eq!(count(&mock, "torque_enable"), 0);
    insta::assert_snapshot!(wording.join("\n"));
}

#[test]
fn moving_a_servo_past_its_limits_needs_confirmation() {
    let mock = MockBus::start(&[]);
    let mut wording = Vec::new();
    for item in ["goal_velocity", "goal_pwm", "goal_current", "goal_position", "indirect_data_1"] {
        wording.push(refused(&mock, &["write", "--id", "1", item, "1"], (2, item)));
        wording.push(refused(&mock, &["write", "--id", "1", item, "1", "--raw"], (2, "--yes")));
        well(&mock, &["write", "--id", "1", item, "1", "--raw", "--yes"]);
        if item != "goal_position" {
            wording.push(refused(&mock, &["write", YAW, item, "1"], (2, item)));
        }
    }
    insta::assert_snapshot!(wording.join("\n"));
    well(&mock, &["write", "--id", "1", "led", "1"]);
}

#[test]
fn a_goal_refused_by_a_tripped_watchdog_is_reported_with_the_remedy() {
    let mock = MockBus::start(&[]);
    well(&mock, &["torque", "on", YAW]);
    assert!(trips(&mock));
    insta::assert_snapshot!(refused(
        &mock,
        &["write", "--id", "1", "goal_position", "2050", "--raw", "--yes"],
        (1, "`leo bus write --id 1 bus_watchdog 0`"),
    ));
}

#[test]
fn ctrl_c_stops_a_joint_where_it_is() {
    let mock = MockBus::start(&[]);
    well(&mock, &["torque", "on", YAW]);
    let mut tool = Command::new(env!("CARGO_BIN_EXE_leo"))
        .args(["bus", "write", YAW, "goal_position", "45deg", "--bus", "torso", "--device"])
        .arg(mock.path("torso"))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    let mut said = String::new();
    BufReader::new(tool.stdout.as_mut().expect("piped")).read_line(&mut said).expect("it says where it goes");
    let id = i32::try_from(tool.id()).ok().and_then(Pid::from_raw).expect("a process");
    kill_process(id, Signal::INT).expect("it runs");
    let mut wrong = String::new();
    tool.stderr.take().expect("piped").read_to_string(&mut wrong).expect("reads");
    assert_eq!(tool.wait().expect("ends").code(), Some(1), "{said} {wrong}");
    assert!(wrong.contains("torso_yaw_joint") && wrong.contains(" deg ("), "{wrong}");
    let before = count(&mock, "present_position");
    assert!(before < position_count(40_f64.to_radians()), "{before}");
    assert_eq!(count(&mock, "present_velocity"), 0);
    assert_eq!((count(&mock, "present_position"), count(&mock, "torque_enable")), (before, 1));
}

#[test]
fn a_blocked_joint_is_reported_and_stopped() {
    let mut mock = MockBus::start(&[]);
    well(&mock, &["torque", "on", YAW]);
    mock.tell("fault blocked bus=torso id=1");
    let held = refused(&mock, &["write", YAW, "goal_position", "5deg"], (1, "PWM limit"));
    mock.tell("clear");
    mock.tell("fault overload bus=torso id=1 at=0s");
    let alert = refused(&mock, &["torque", "on", YAW], (1, "`leo bus reboot --id 1`"));
    insta::assert_snapshot!([held, alert].join("\n"));
    well(&mock, &["reboot", YAW]);
    well(&mock, &["torque", "on", YAW]);
}
