//! Torque off on servos that are well, silent, or unreachable because their line is in use or lost.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::thread;

use clock::Duration;
use config::Robot;
use mock_bus_process::{Faults, MockBuses, parse};
use serial::{Pty, Tty};
use torque::{Bus, Cause, LineError, Servo, buses, switch_off};

const SHORT: Duration = Duration::from_millis(50);

struct Rig {
    robot: Robot,
    folder: tempfile::TempDir,
    ptys: MockBuses,
}

/// The robot with torque on every servo, and with faults.
fn rig(faults: &[&str]) -> Rig {
    let robot = Robot::load(None).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let injections = faults.iter().map(|words| parse(words, &robot.motor).unwrap()).collect();
    let faults = Faults { injections, ..Faults::default() };
    let ptys = MockBuses::with_faults(&robot.motor, folder.path(), false, &faults).unwrap();
    for bus in &robot.motor.buses {
        let servos = ptys.servos(&bus.name).unwrap();
        servos.lock().unwrap().line.servos.iter_mut().for_each(|servo| servo.write(64, &[1]).unwrap());
    }
    Rig { robot, folder, ptys }
}

impl Rig {
    fn buses(&self) -> Vec<Bus> {
        buses(&self.robot.motor, Some(self.folder.path()))
    }

    fn with_torque(&self) -> usize {
        let on_bus = |bus: &config::motor::Bus| {
            let servos = self.ptys.servos(&bus.name).unwrap();
            let servos = servos.lock().unwrap();
            servos.line.servos.iter().filter(|servo| servo.read(64, 1).unwrap() != [0]).count()
        };
        self.robot.motor.buses.iter().map(on_bus).sum()
    }
}

#[test]
fn every_servo_confirms_that_its_torque_is_off() {
    let rig = rig(&[]);
    assert_eq!(rig.with_torque(), 65);
    let report = switch_off(&rig.buses(), SHORT);
    assert!(report.is_confirmed(), "{report:?}");
    assert_eq!((report.confirmed, rig.with_torque()), (65, 0));
    insta::assert_snapshot!(report);
}

#[test]
fn a_silent_servo_is_named_and_an_unreliable_one_is_retried() {
    let rig = rig(&["drop bus=torso id=3", "drop bus=torso id=5 p=0.5"]);
    let report = switch_off(&rig.buses(), SHORT);
    assert_eq!(report.confirmed, 64, "{report:?}");
    let [silent] = report.unconfirmed.as_slice() else { panic!("{report:?}") };
    assert_eq!((silent.joint.as_str(), silent.bus.as_str(), silent.id), ("torso_roll_joint", "torso", 3));
    assert_eq!(silent.cause, Cause::Silent);
    insta::assert_snapshot!(silent);
}

#[test]
fn a_busy_line_is_awaited_and_then_named() {
    let rig = rig(&[]);
    let all = rig.buses();
    let torso = all.iter().find(|bus| bus.name == "torso").unwrap();
    let other = Tty::open(&torso.path, torso.baud).unwrap();
    let report = switch_off(&all, SHORT);
    assert_eq!((report.confirmed, report.unconfirmed.len(), rig.with_torque()), (58, 7, 7));
    let busy = &report.unconfirmed[0];
    assert_eq!((busy.bus.as_str(), busy.id), ("torso", 1));
    // The sentence is that of the line.
    let busy_line = Tty::open(&torso.path, torso.baud).unwrap_err();
    assert!(matches!(busy_line, serial::OpenError::Busy { .. }), "{busy_line:?}");
    assert_eq!(busy.cause, Cause::Line(LineError::Open(busy_line.to_string())));
    let report = thread::scope(|scope| {
        scope.spawn(move || {
            clock::sleep_until(clock::now() + SHORT);
            drop(other);
        });
        switch_off(&all, 100 * SHORT)
    });
    assert!(report.is_confirmed(), "{report:?}");
}

#[test]
fn a_lost_or_absent_line_does_not_affect_other_buses() {
    let rig = rig(&["hang-up bus=torso at=0s for=60s"]);
    let mut all = rig.buses();
    let absent = Servo { joint: "absent_joint".to_owned(), id: 1 };
    all.push(Bus {
        name: "absent".to_owned(),
        path: "/dev/nowhere".into(),
        baud: 1_000_000,
        servos: vec![absent],
    });
    // A line whose other end neither reads nor answers.
    let deaf = Pty::new(1_000_000).unwrap();
    let servo = Servo { joint: "deaf_joint".to_owned(), id: 1 };
    all.push(Bus {
        name: "deaf".to_owned(),
        path: deaf.path().to_owned(),
        baud: 1_000_000,
        servos: vec![servo],
    });
    let report = switch_off(&all, SHORT);
    let cause =
        |joint: &str| report.unconfirmed.iter().find(|servo| servo.joint == joint).map(|servo| &servo.cause);
    assert!(matches!(cause("absent_joint"), Some(Cause::Line(_))), "{report:?}");
    assert_eq!(cause("deaf_joint"), Some(&Cause::Silent));
    assert!(report.confirmed >= 58, "{report:?}");
}
