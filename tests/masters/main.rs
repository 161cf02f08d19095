//! Other masters on `leo mock-bus`: the vendor's SDK in Python, and the crate rustypot.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod bench_tool;
mod commission;
mod mock_bus;
mod moving;
#[path = "../sources/venv.rs"]
mod venv;
mod wire;

use std::process::{Command, Stdio};

use clock::Duration;
use rustypot::DynamixelProtocolHandler;
use serialport::SerialPort;

use mock_bus::MockBus;

/// The maximum of the vendor's SDK.
const BAUD: u32 = 4_000_000;
const TORSO: [u8; 7] = [1, 2, 3, 4, 5, 6, 7];
const GOAL_POSITION: u8 = 116;
const PRESENT_POSITION: u8 = 132;
const HARDWARE_ERROR_STATUS: u8 = 70;

pub(crate) fn open(mock: &MockBus, bus: &str) -> Box<dyn SerialPort> {
    let path = mock.path(bus).to_str().expect("a path of letters").to_owned();
    serialport::new(path, BAUD).timeout(Duration::from_millis(500)).open().expect("opens")
}

/// Polls until a condition holds, at most 500 times.
pub(crate) fn comes(mut looks: impl FnMut() -> bool) -> bool {
    (0..500).any(|_| {
        let is_so = looks();
        if !is_so {
            clock::sleep_until(clock::now() + Duration::from_millis(10));
        }
        is_so
    })
}

/// The buses of the built-in robot, with the sorted IDs of the servos on each.
fn buses() -> Vec<(String, Vec<u8>)> {
    let robot = config::Robot::load(None).expect("is built in").motor;
    let on = |bus| {
        let joints = robot.joints.iter().filter(|joint| joint.bus == bus);
        let mut ids: Vec<_> = joints.map(|joint| joint.id).collect();
        ids.sort_unstable();
        ids
    };
    let buses: Vec<_> =
        robot.buses.iter().enumerate().map(|(bus, settings)| (settings.name.clone(), on(bus))).collect();
    assert_eq!(buses.iter().map(|(_, ids)| ids.len()).sum::<usize>(), 65);
    buses
}

#[test]
fn the_vendors_sdk_scans_reads_writes_and_reboots_every_servo() {
    let Some(python) = venv::interpreter("dynamixel-sdk==4.1.0", "dynamixel_sdk") else { return };
    let mock = MockBus::start(&[]);
    // One master for each bus, all in parallel, because a scan waits for most of a second.
    let masters: Vec<_> = buses()
        .into_iter()
        .map(|(bus, servos)| {
            let mut master = Command::new(&python);
            master
                .arg("-B")
                .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/masters/master.py"))
                .arg(mock.path(&bus))
                .arg(BAUD.to_string())
                .args(servos.iter().map(u8::to_string))
                .stdout(Stdio::null())
                .stderr(Stdio::piped());
            (bus, master.spawn().expect("starts"))
        })
        .collect();
    for (bus, master) in masters {
        let output = master.wait_with_output().expect("ends");
        assert!(output.status.success(), "{bus}: {}", String::from_utf8_lossy(&output.stderr));
    }
    assert!(mock.stop().success());
}

/// Checks with another master that all servos of a bus are found, follow goals, report their positions, and
/// reboot without torque.
fn speaks_to_all(bus: &str, servos: &[u8], port: &mut dyn SerialPort) {
    let master = DynamixelProtocolHandler::v2();
    assert_eq!(master.broadcast_ping(port).expect("answers"), servos, "{bus}");
    for &id in servos {
        assert!(master.ping(port, id).expect("answers"), "{bus}, servo {id}");
        master.write(port, id, 9, &[0]).expect("answers");
        master.write(port, id, 64, &[1]).expect("answers");
    }
    let goals: Vec<_> = servos.iter().map(|id| (2000 + i32::from(*id)).to_le_bytes().to_vec()).collect();
    master.sync_write(port, servos, GOAL_POSITION, &goals).expect("is sent");
    let there = comes(|| master.sync_read(port, servos, PRESENT_POSITION, 4).expect("answers") == goals);
    assert!(there, "{bus}: they do not go to their goals");
    let read = master.fast_sync_read(port, servos, PRESENT_POSITION, 4).expect("answers");
    assert_eq!(read, goals, "{bus}");
    for &id in servos {
        assert!(master.reboot(port, id).expect("answers"), "{bus}, servo {id}");
    }
    let back = comes(|| master.broadcast_ping(port).is_ok_and(|found| found == servos));
    assert!(back, "{bus}: they do not come back");
    let torque = master.sync_read(port, servos, 64, 1).expect("answers");
    assert!(torque.iter().all(|torque| *torque == [0]), "{bus}: {torque:?}");
}

#[test]
fn rustypot_scans_reads_writes_and_reboots_every_servo() {
    let mock = MockBus::start(&[]);
    std::thread::scope(|threads| {
        for (bus, servos) in buses() {
            let mut port = open(&mock, &bus);
            threads.spawn(move || speaks_to_all(&bus, &servos, port.as_mut()));
        }
    });
}

#[test]
fn faults_are_switched_on_and_off_while_it_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("faults.toml");
    std::fs::write(&file, "faults = []").expect("writes");
    let mut mock = MockBus::start(&["--seed", "7", "--faults", file.to_str().expect("letters")]);
    let (master, mut port) = (DynamixelProtocolHandler::v2(), open(&mock, "torso"));
    let found = |port: &mut Box<dyn SerialPort>| master.broadcast_ping(port.as_mut()).unwrap_or_default();
    assert_eq!(found(&mut port), TORSO);

    let mut wording = vec![mock.tell("fault drop bus=torso id=5")];
    assert!(comes(|| found(&mut port) == [1, 2, 3, 4, 6, 7]));
    for (command, word) in [("fault drop bus=torsoo", "`bus=torsoo`"), ("dance", "`dance`")] {
        let said = mock.tell(command);
        assert!(said.contains(word), "{said}");
        wording.push(said);
    }
    assert!(comes(|| found(&mut port) == [1, 2, 3, 4, 6, 7]), "a refused command changes nothing");
    wording.push(mock.tell("clear"));
    insta::assert_snapshot!(wording.join("\n"));
    assert!(comes(|| found(&mut port) == TORSO));

    // The file is accepted as a whole or not at all.
    std::fs::write(&file, "faults = [\n\"drop id=1\",\n\"dorp\",\n]").expect("writes");
    let said = mock.next_line();
    assert!(said.contains("faults.toml:3:1: `dorp` "), "{said}");
    assert_eq!(found(&mut port), TORSO);
    std::fs::write(&file, "faults = [\"drop id=1\", \"alert id=2\"]").expect("writes");
    assert!(mock.next_line().ends_with("faults.toml: 2 faults"));
    assert!(comes(|| found(&mut port) == [2, 3, 4, 5, 6, 7]));
    let errors = master.read(port.as_mut(), 2, HARDWARE_ERROR_STATUS, 1).expect("answers");
    assert_eq!(errors, [1]);
    assert_eq!(mock.tell("list"), "on: drop id=1");
    assert_eq!(mock.next_line(), "on: alert id=2");
}

#[test]
fn a_lost_line_reappears_at_the_same_path() {
    let mut mock = MockBus::start(&[]);
    let path = mock.path("torso").to_owned();
    let master = DynamixelProtocolHandler::v2();
    let mut port = open(&mock, "torso");
    assert!(master.ping(port.as_mut(), 1).expect("answers"));
    let fault = "hang-up bus=torso at=0s for=300ms";
    assert!(mock.tell(&format!("fault {fault}")).ends_with(fault));
    assert!(comes(|| !path.exists()), "the link is still there");
    assert!(!master.ping(port.as_mut(), 1).unwrap_or(false));
    assert!(comes(|| path.exists()), "the link does not come back");
    let mut port = open(&mock, "torso");
    assert!(comes(|| master.ping(port.as_mut(), 1).unwrap_or(false)));
    let folder = path.parent().expect("a folder").to_owned();
    assert!(mock.stop().success());
    assert!(!folder.exists(), "{} is left behind", folder.display());
}

#[test]
fn leftovers_of_a_killed_process_are_removed_at_the_next_start() {
    let killed = MockBus::start(&[]);
    let living = MockBus::start(&[]);
    let folder = |mock: &MockBus| mock.path("torso").parent().expect("a folder").to_owned();
    let (left, kept) = (folder(&killed), folder(&living));
    killed.kill();
    assert!(left.exists(), "nothing was left behind");
    let next = MockBus::start(&[]);
    assert!(!left.exists(), "{} is left behind", left.display());
    assert!(kept.exists() && folder(&next).exists());
}

#[test]
fn invalid_mock_bus_faults_are_refused_before_anything_runs() {
    let said = |arguments: &[&str]| {
        let mut leo = Command::new(env!("CARGO_BIN_EXE_leo"));
        let output = leo.arg("mock-bus").args(arguments).output().expect("starts");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned(), output.stdout.len())
    };
    let (code, words, printed) = said(&["--fault", "drop p=7"]);
    assert_eq!((code, printed), (Some(2), 0));
    assert!(words.starts_with("leo: `p=7` ") && words.lines().count() == 1, "{words}");
    let (code, missing, _) = said(&["--faults", "/nowhere/faults.toml"]);
    assert!(code == Some(2) && missing.contains("/nowhere/faults.toml"), "{missing}");
    insta::assert_snapshot!(words + &missing);
}

#[test]
fn configured_faults_are_injected_and_invalid_ones_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    for file in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/config")).expect("a folder").flatten()
    {
        if file.path().is_file() {
            std::fs::copy(file.path(), folder.path().join(file.file_name())).expect("copies");
        }
    }
    let leo = folder.path().join("leo.toml");
    let text = std::fs::read_to_string(&leo).expect("reads");
    let configure = |faults: &str| {
        let changed = text.replace("\nfaults = []", &format!("\nfaults = [\"{faults}\"]"));
        assert_ne!(changed, text);
        std::fs::write(&leo, changed).expect("writes");
    };
    let config = leo.to_str().expect("letters");

    configure("drop bus=torso id=3");
    let mock = MockBus::start(&["--config", config]);
    let found = DynamixelProtocolHandler::v2().broadcast_ping(open(&mock, "torso").as_mut());
    assert_eq!(found.expect("answers"), [1, 2, 4, 5, 6, 7]);

    configure("dorp");
    for command in ["mock-bus", "check", "run"] {
        let output = Command::new(env!("CARGO_BIN_EXE_leo")).args([command, "--config", config]).output();
        let output = output.expect("starts");
        let words = String::from_utf8_lossy(&output.stderr);
        let says = words.starts_with(&format!("leo: {config}:")) && words.contains(": `dorp` is no kind");
        assert!(output.status.code() == Some(2) && says, "{command}: {words}");
    }
}
