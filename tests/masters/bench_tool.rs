//! `leo bus` on `leo mock-bus`: an engineer's work at the bench.

use std::path::Path;
use std::process::Command;

use clock::Duration;

use crate::mock_bus::MockBus;

/// Runs `leo bus` on the torso's bus; returns exit status, standard output and standard error.
pub(crate) fn bus(mock: &MockBus, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_leo"))
        .arg("bus")
        .args(arguments)
        .args(["--bus", "torso", "--device"])
        .arg(mock.path("torso"))
        .env_remove("RUST_LOG")
        .output()
        .expect("runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// Reads a file of the repository.
pub(crate) fn read(file: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).expect("reads")
}

/// As [`bus`], and checks for success.
pub(crate) fn well(mock: &MockBus, arguments: &[&str]) -> String {
    let (status, said, wrong) = bus(mock, arguments);
    assert_eq!(status, Some(0), "{arguments:?}: {said} {wrong}");
    said
}

/// As [`bus`], and checks that it is refused with this status and names this word. Returns the message for a snapshot,
/// without the path of the device.
pub(crate) fn refused(mock: &MockBus, arguments: &[&str], expected: (i32, &str)) -> String {
    let (status, said, wrong) = bus(mock, arguments);
    assert_eq!(status, Some(expected.0), "{arguments:?}: {said} {wrong}");
    assert!(wrong.contains(expected.1), "{arguments:?}: {wrong}");
    without_devices(mock, &wrong)
}

/// A text for a snapshot: the paths of the devices are replaced by the names of the buses.
fn without_devices(mock: &MockBus, text: &str) -> String {
    ["face_left", "face_right", "left_arm", "right_arm", "torso"].iter().fold(text.to_owned(), |text, bus| {
        text.replace(&mock.path(bus).display().to_string(), &format!("[device of {bus}]"))
    })
}

#[test]
fn servos_are_found_read_written_and_released() {
    let mock = MockBus::start(&[]);
    let said = well(&mock, &["scan"]);
    assert!(said.contains("7 servos") && said.contains("torso_yaw_joint"), "{said}");
    let json: serde_json::Value = serde_json::from_str(&well(&mock, &["scan", "--json"])).expect("JSON");
    assert_eq!(json.as_array().map(Vec::len), Some(7));

    let yaw = "torso_yaw_joint";
    assert!(well(&mock, &["read", yaw, "present_temperature"]).ends_with("degC"));
    assert!(well(&mock, &["read", "--id", "1"]).lines().count() > 40, "all items");
    let written = well(&mock, &["write", yaw, "profile_velocity", "20"]);
    assert!(written.contains("profile_velocity") && written.contains(" 20 "), "{written}");
    assert!(well(&mock, &["write", "--id", "1", "return_delay_time", "4us"]).contains(" 2 "));
    well(&mock, &["torque", "on", yaw]);
    assert!(well(&mock, &["write", yaw, "goal_position", "10deg"]).contains("is at 10.0 deg (0.17"));
    let locked = refused(&mock, &["write", yaw, "min_position_limit", "5"], (1, "`leo bus torque off`"));
    let off = well(&mock, &["torque", "off"]);
    assert!(off.contains("7 servos"), "{off}");
    insta::assert_snapshot!([written, locked, without_devices(&mock, &off)].join("\n"));
    let table = well(&mock, &["monitor", "--once"]);
    assert!(table.lines().filter(|line| line.contains("off")).count() == 7, "{table}");
}

#[test]
fn torque_off_names_every_joint_that_does_not_confirm_it() {
    let mut mock = MockBus::start(&[]);
    let fault = "drop bus=torso id=3";
    assert!(mock.tell(&format!("fault {fault}")).ends_with(fault));
    let (status, said, wrong) = bus(&mock, &["torque", "off"]);
    assert_eq!(status, Some(1), "{said} {wrong}");
    assert!(said.contains("6 servos"), "{said}");
    assert!(wrong.contains("torso_roll_joint (id 3)") && wrong.matches("_joint").count() == 1, "{wrong}");
    let mut wording = without_devices(&mock, &format!("{said}\n{wrong}"));
    mock.tell("clear");
    assert!(well(&mock, &["torque", "off"]).contains("7 servos"));

    // Without a configuration no servo is known to be missing, but at least one must confirm.
    mock.tell("fault drop bus=torso");
    let output = Command::new(env!("CARGO_BIN_EXE_leo"))
        .args(["bus", "torque", "off", "--baud", "4000000", "--device"])
        .arg(mock.path("torso"))
        .output()
        .expect("runs");
    let wrong = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{wrong}");
    wording += &format!("\n{}", without_devices(&mock, &wrong));
    insta::assert_snapshot!(wording);
}

#[test]
fn torque_goes_off_on_every_bus_despite_a_fault_on_one() {
    let mock = MockBus::start(&[]);
    let hangs_up = serial::Pty::new(4_000_000).expect("there are pseudo-terminals");
    let dies_at = hangs_up.path().to_owned();
    // The first line hangs up after the instructions, the second does not exist, the third is a mock.
    let devices: [(&str, &Path); 4] = [
        ("face_left", &dies_at),
        ("face_right", Path::new("/dev/nowhere")),
        ("right_arm", mock.path("right_arm")),
        ("torso", mock.path("torso")),
    ];
    let mut motor = read("config/motor.toml");
    for (bus, device) in devices {
        let of = |device: &str| format!("name = \"{bus}\"\ndevice = \"{device}\"");
        assert!(motor.contains(&of("mock")), "{bus}");
        motor = motor.replace(&of("mock"), &of(device.to_str().expect("letters")));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let leo = folder.path().join("leo.toml");
    for (name, text) in [("leo.toml", read("config/leo.toml")), ("motor.toml", motor)] {
        std::fs::write(folder.path().join(name), text).expect("writes");
    }
    well(&mock, &["torque", "on", "torso_yaw_joint"]);
    let listener = std::thread::spawn(move || {
        let (mut bytes, mut heard) = ([0; 64], 0);
        let until = clock::now() + Duration::from_secs(60);
        // Three broadcast Write packets of one byte.
        while heard < 3 * 13 && clock::now() < until {
            heard += hangs_up.read(&mut bytes, until).expect("works");
        }
        heard
    });
    let output = Command::new(env!("CARGO_BIN_EXE_leo"))
        .args(["bus", "torque", "off", "--config"])
        .arg(&leo)
        .output()
        .expect("runs");
    assert!(listener.join().expect("ends") >= 3 * 13, "it was never told");
    let said = String::from_utf8_lossy(&output.stdout);
    let wrong = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said} {wrong}");
    for (bus, servos) in [("right_arm", 13), ("torso", 7)] {
        let all = format!("{}: {servos} servos", mock.path(bus).display());
        assert!(said.contains(&all), "{said}");
    }
    assert_eq!(said.lines().count(), 2, "{said}");
    let line = |begins: &str| wrong.lines().find(|line| line.trim_start_matches("leo: ").starts_with(begins));
    let closed = serial::LineLostError::HangUp;
    assert!(line(&format!("face_left: {closed}")).is_some(), "{wrong}");
    assert!(line("face_right: ").is_some_and(|line| line.contains("/dev/nowhere")), "{wrong}");
    assert!(line("left_arm: ").is_some_and(|line| line.contains("`left_arm`")), "{wrong}");
    let dead = [dies_at.to_str().expect("letters"), "/dev/nowhere", "bus `left_arm`"];
    for (bus, servos) in dead.into_iter().zip([16, 16, 13]) {
        let names = |line: &str| line.matches("_joint (id ").count();
        let of_bus = wrong.lines().filter(|line| line.trim_start_matches("leo: ").starts_with(bus));
        let doubtful = of_bus.max_by_key(|line| names(line)).expect("is named");
        assert_eq!(names(doubtful), servos, "{doubtful}");
    }
}

#[test]
fn an_alert_is_shown_and_a_reboot_clears_it() {
    let mut mock = MockBus::start(&[]);
    mock.tell("fault overload bus=torso id=3 at=0s");
    let table = well(&mock, &["monitor", "--once"]);
    assert!(table.lines().any(|line| line.contains("overload")), "{table}");
    mock.tell("clear");
    assert!(well(&mock, &["reboot", "--id", "3"]).contains("has rebooted"));
    let table = well(&mock, &["monitor", "--once"]);
    assert!(!table.contains("overload"), "{table}");
}

#[test]
fn a_servo_changes_id_and_speed_only_with_confirmation() {
    let mock = MockBus::start(&[]);
    let mut wording = vec![
        refused(&mock, &["set-id", "--id", "7", "--to", "6", "--yes"], (1, "id 6 ")),
        refused(&mock, &["set-id", "--id", "7", "--to", "77"], (2, "--yes")),
    ];
    well(&mock, &["set-id", "--id", "7", "--to", "77", "--yes"]);
    let (status, said, _) = bus(&mock, &["scan"]);
    assert_eq!(status, Some(1), "one of motor.toml is missing");
    assert!(said.contains("id  77") && said.contains("not in motor.toml"), "{said}");
    assert!(said.lines().any(|line| line.contains("id   7") && line.contains("does not answer")), "{said}");
    well(&mock, &["set-baud", "--id", "77", "--to", "1000000", "--yes"]);
    wording.push(refused(&mock, &["read", "--id", "77", "model_number"], (1, "id 77 ")));
    insta::assert_snapshot!(wording.join("\n"));
    assert!(well(&mock, &["read", "--id", "77", "model_number", "--baud", "1000000"]).contains("1020"));
}

#[test]
fn impossible_arguments_are_refused_with_alternatives() {
    let mock = MockBus::start(&[]);
    refused(&mock, &["read", "--id", "1", "goal_positon"], (2, "goal_"));
    let mut wording = vec![
        refused(&mock, &["read", "nose_joint"], (2, "`nose_joint`")),
        refused(&mock, &["read", "--id", "99"], (1, "id 99 ")),
        refused(&mock, &["write", "--id", "1", "goal_position", "12V"], (2, "`12V`")),
        refused(&mock, &["write", "--id", "1", "led", "7"], (2, "from 0 to 1")),
        refused(&mock, &["write", "--id", "1", "present_position", "7"], (2, "present_position")),
    ];
    let output = Command::new(env!("CARGO_BIN_EXE_leo")).args(["bus", "scan"]).output().expect("runs");
    let wrong = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(wrong.contains("`leo mock-bus`"), "{wrong}");
    wording.push(wrong.into_owned());
    let output =
        Command::new(env!("CARGO_BIN_EXE_leo")).args(["bus", "torque", "off"]).output().expect("runs");
    let wrong = String::from_utf8_lossy(&output.stderr);
    assert_eq!((output.status.code(), wrong.lines().count()), (Some(2), 1), "{wrong}");
    assert!(wrong.contains("`leo mock-bus`"), "{wrong}");
    wording.push(wrong.into_owned());
    insta::assert_snapshot!(wording.join("\n"));
}
