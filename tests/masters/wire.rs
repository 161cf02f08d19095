//! Timing of `leo mock-bus`, and how `leo bus` reports faulty lines.

use std::io::{Read as _, Write as _};

use clock::Duration;
use rustypot::DynamixelProtocolHandler;
use servo::{Address, Id, Instruction};

use crate::bench_tool::{bus, read, refused, well};
use crate::mock_bus::MockBus;
use crate::open;

/// Wire time of a 14-byte Read and its 15-byte status packet at 4,000,000 baud, ten bits a byte.
const ON_WIRE: Duration = Duration::from_nanos(72_500);

#[test]
fn no_reply_arrives_before_its_transmission_time() {
    let mock = MockBus::start(&[]);
    let mut port = open(&mock, "torso");
    DynamixelProtocolHandler::v2().write(port.as_mut(), 1, 9, &[0]).expect("answers");
    let mut bytes = [0; 64];
    let read = Instruction::Read { address: 132, length: 4 };
    let length = read.encode(Address::One(Id::new(1).expect("an id")), &mut bytes).expect("fits");
    let mut answer = [0; 15];
    let mut ask = || {
        let asked_at = clock::now();
        port.write_all(&bytes[..length]).expect("writes");
        port.read_exact(&mut answer).expect("answers");
        clock::now().since(asked_at)
    };
    let times: Vec<_> = (0..3000).map(|_| ask()).collect();
    let shortest = times.iter().min().copied().expect("3000");
    println!(
        "{shortest:?} to {:?}, {:?} on average",
        times.iter().max(),
        times.iter().sum::<Duration>() / 3000
    );
    assert!(shortest >= ON_WIRE, "{shortest:?} of {ON_WIRE:?}");
}

#[test]
fn a_new_identifier_is_acknowledged_with_the_old_one() {
    let mock = MockBus::start(&[]);
    let (master, mut port) = (DynamixelProtocolHandler::v2(), open(&mock, "torso"));
    master.write(port.as_mut(), 7, 7, &[77]).expect("the servo that was written to answers");
    assert!(master.ping(port.as_mut(), 77).expect("answers"));
}

#[test]
fn every_bus_command_reports_a_hardware_alert_with_the_remedy() {
    let mock = MockBus::start(&["--fault", "overload bus=torso id=5 at=0s"]);
    let says = "`leo bus reboot --id 5`";
    for words in
        [&["scan"][..], &["read", "--id", "5", "present_position"], &["write", "--id", "5", "led", "1"]]
    {
        let said = well(&mock, words);
        assert_eq!(said.matches(says).count(), 1, "{words:?}: {said}");
        assert_eq!(said.matches("overload").count(), 1, "{words:?}: {said}");
    }
    let json: serde_json::Value = serde_json::from_str(&well(&mock, &["scan", "--json"])).expect("JSON");
    let alerts: Vec<_> = json.as_array().expect("rows").iter().map(|row| row["alert"].as_str()).collect();
    assert_eq!(alerts, [None, None, None, None, Some("overload"), None, None]);
    refused(&mock, &["torque", "on", "--id", "5"], (1, says));
    refused(&mock, &["torque", "on", "neck_pitch_joint"], (1, says));
    assert!(!well(&mock, &["read", "--id", "4", "present_position"]).contains("alert"));
}

#[test]
fn an_echoing_line_is_used_and_reported() {
    let mock = MockBus::start(&["--fault", "echo bus=torso"]);
    let said = well(&mock, &["scan"]);
    assert!(said.contains("7 servos") && said.contains("echoes"), "{said}");
    assert!(well(&mock, &["read", "--id", "5", "model_number"]).contains("1020"));
    well(&mock, &["torque", "on", "neck_pitch_joint"]);
    well(&mock, &["write", "neck_pitch_joint", "goal_position", "3deg"]);
    well(&mock, &["reboot", "--id", "5"]);
    well(&mock, &["set-id", "--id", "7", "--to", "77", "--yes"]);
    well(&mock, &["torque", "off", "--id", "77"]);
}

#[test]
fn servos_at_another_speed_are_found_and_reported() {
    let folder = tempfile::tempdir().expect("a folder");
    let motor = read("config/motor.toml");
    let slow = motor.replace(
        "name = \"torso\"\ndevice = \"mock\"\nbaud = 4000000",
        "name = \"torso\"\ndevice = \"mock\"\nbaud = 1000000",
    );
    assert_ne!(slow, motor);
    for (name, text) in [("leo.toml", read("config/leo.toml")), ("motor.toml", slow)] {
        std::fs::write(folder.path().join(name), text).expect("writes");
    }
    let config = folder.path().join("leo.toml");
    let overload = ["--fault", "overload bus=torso id=5 at=0s"];
    let mock = MockBus::start(&[&["--config", config.to_str().expect("letters")][..], &overload].concat());
    let (status, said, wrong) = bus(&mock, &["scan"]);
    assert_eq!(status, Some(1), "{said} {wrong}");
    assert!(said.contains("4000000 baud"), "{said}");
    let at_slow = said.lines().find(|line| line.contains(" 1000000: ")).expect("is said");
    assert_eq!(at_slow.matches("_joint (id ").count(), 7, "{at_slow}");
    assert!(at_slow.contains("7 servos") && at_slow.contains("torso_pitch_joint (id 2)"), "{at_slow}");
    // The remedy for a hardware alert names the speed at which the servo is reached.
    assert!(
        said.contains("hardware alert (overload); `leo bus reboot --id 5 --baud 1000000` clears it"),
        "{said}"
    );
    // A servo at another speed is searched for on request.
    let at_slow = |words: &[&'static str]| well(&mock, &[words, &["--baud", "1000000"]].concat());
    at_slow(&["set-baud", "--id", "3", "--to", "57600", "--yes"]);
    let (_, said, _) = bus(&mock, &["scan", "--baud", "1000000"]);
    assert!(said.contains("6 servos") && !said.contains("57600"), "{said}");
    let (_, said, _) = bus(&mock, &["scan", "--baud", "1000000", "--all-speeds"]);
    let found = said.lines().find(|line| line.contains(" 57600: ")).expect("is said");
    assert!(found.contains("1 servo ") && found.ends_with("torso_roll_joint (id 3)"), "{found}");
}

#[test]
fn a_bus_without_a_servo_at_any_speed_is_reported() {
    let mock = MockBus::start(&["--fault", "drop bus=torso"]);
    let (status, said, wrong) = bus(&mock, &["scan"]);
    assert_eq!(status, Some(1), "{said} {wrong}");
    for words in ["no servo answers at 4000000 baud; the other speeds of servos are tried", "at any speed"] {
        assert!(said.contains(words), "{said}");
    }
    // A device alone is scanned at 1000000 baud first.
    let scan = |arguments: &[&str]| {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_leo"))
            .args(["bus", "scan", "--device"])
            .arg(mock.path("right_arm"))
            .args(arguments)
            .output()
            .expect("runs");
        (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let (status, said) = scan(&[]);
    assert!(said.contains("no servo answers at 1000000 baud") && !said.contains("at any speed"), "{said}");
    let found = said.lines().find(|line| line.contains(" at 4000000: ")).expect("is said");
    assert!(found.contains("13 servos"), "{found}");
    assert_eq!(status, Some(1), "{said}");
    assert_eq!(scan(&["--baud", "4000000"]).0, Some(0));
}
