//! Every fault of a servo, of a bus and of a commander, over pseudo-terminals to the mock servo bus. The tests check
//! how soon it is detected, the reaction, what is published and counted, and how it ends. Faults of a joint are
//! tested on each of the 65 joints.
//!
//! Time is simulated, so that the speed of the machine does not matter. One joint of every bus fails at a time. The
//! documentation of the servo bus lists these tests row by row.

use message::{BusHealth, JointCause, JointMode};
use servo::mock::FaultKind;

use super::rig::{PERIOD, Rig, Time};
use clock::Duration;

mod answers;
mod body;
mod refusals;
mod servos;

/// Firmware that does not support fast sync reads.
const OLD_FIRMWARE: u8 = 44;

/// A robot in simulated time with all joints following.
fn following() -> Rig {
    following_as(|_| {})
}

/// The same with other settings.
fn following_as(change: impl FnOnce(&mut config::Robot)) -> Rig {
    let mut robot = config::Robot::load(None).unwrap();
    let alert = &mut robot.leo.motor.alert;
    for reaction in [
        &mut alert.input_voltage,
        &mut alert.overheating,
        &mut alert.encoder,
        &mut alert.electrical_shock,
        &mut alert.overload,
    ] {
        *reaction = config::leo::AlertReaction::Limp;
    }
    change(&mut robot);
    let mut rig = Rig::of(robot, Time::Lockstep, &process::EmergencyFlag::default());
    calm(&mut rig);
    rig
}

/// A robot in simulated time whose servos do not support fast sync reads. All joints follow.
fn following_on_old_firmware() -> Rig {
    let robot = config::Robot::load(None).unwrap();
    let mut rig = Rig::of(robot, Time::Lockstep, &process::EmergencyFlag::default());
    for joint in everybody() {
        rig.servo(joint, |servo| *servo = servo.clone().with_firmware(OLD_FIRMWARE));
        assert!(!rig.servo(joint, |servo| servo.supports_fast_reads()));
    }
    calm(&mut rig);
    rig
}

/// Removes all faults, and cycles until all joints follow and are read.
fn calm(rig: &mut Rig) {
    rig.inject("", &[], "");
    rig.until_so("following", |rig| {
        let all = 0..rig.robot.motor.joints.len();
        all.into_iter().all(|joint| rig.mode(joint) == JointMode::Following && rig.is_read(joint))
    });
}

/// The joints that fail at a time: the first of every bus, then the second of every bus, and so on.
fn rounds(rig: &Rig) -> Vec<Vec<usize>> {
    let joints = &rig.robot.motor.joints;
    let of_bus = |bus| (0..joints.len()).filter(move |&joint| joints[joint].bus == bus);
    let rounds: Vec<Vec<usize>> = (0..)
        .map(|round| (0..rig.robot.motor.buses.len()).filter_map(|bus| of_bus(bus).nth(round)).collect())
        .take_while(|struck: &Vec<usize>| !struck.is_empty())
        .collect();
    let mut all: Vec<usize> = rounds.iter().flatten().copied().collect();
    all.sort_unstable();
    assert_eq!(all, everybody(), "every joint has its turn");
    rounds
}

fn everybody() -> Vec<usize> {
    (0..65).collect()
}

/// The first deviation from the expected state, if there is one.
type Verdict = Result<(), String>;

/// Runs a test row for every joint, one of every bus at a time, each time on a robot without faults.
fn in_turn(rig: &mut Rig, row: impl Fn(&mut Rig, &[usize]) -> Verdict) {
    for struck in rounds(rig) {
        calm(rig);
        // All joints are in motion.
        rig.share = -rig.share;
        let verdict = row(rig, &struck);
        let names: Vec<&str> = struck.iter().map(|joint| &*rig.robot.motor.joints[*joint].name).collect();
        assert_eq!(verdict, Ok(()), "{names:?}");
    }
    calm(rig);
    assert!(rig.compared.get() > 65, "nothing was read");
}

fn expect(holds: bool, what: impl FnOnce() -> String) -> Verdict {
    if holds { Ok(()) } else { Err(what()) }
}

/// A counter of a bus.
type Counter = fn(&BusHealth) -> u64;

/// The counter of each bus.
fn counted(rig: &Rig, of: Counter) -> Vec<u64> {
    (0..rig.robot.motor.buses.len()).map(|bus| of(&rig.motor.bus_health(bus))).collect()
}

/// Checks that the counter increased by one for each of these joints, on its bus, and not otherwise.
fn counted_once(rig: &Rig, joints: &[usize], of: Counter, mut before: Vec<u64>) -> Verdict {
    joints.iter().for_each(|&joint| before[rig.robot.motor.joints[joint].bus] += 1);
    let counts = counted(rig, of);
    expect(counts == before, || format!("counted {counts:?}, not {before:?}"))
}

/// The other joints of the groups of these joints.
fn companions(rig: &Rig, joints: &[usize]) -> Vec<usize> {
    let group = |joint: usize| rig.robot.motor.joints[joint].group;
    let groups: Vec<usize> = joints.iter().map(|&joint| group(joint)).collect();
    (0..65).filter(|joint| groups.contains(&group(*joint)) && !joints.contains(joint)).collect()
}

/// Checks that every joint without a fault was read in this cycle and follows. A joint whose group has a fault may
/// stand still.
fn others_go_on(rig: &Rig, struck: &[usize]) -> Verdict {
    let companions = companions(rig, struck);
    for joint in (0..65).filter(|joint| !struck.contains(joint)) {
        let (mode, is_read) = (rig.mode(joint), rig.is_read(joint));
        let stands = companions.contains(&joint)
            && matches!(mode, JointMode::Decelerating | JointMode::Holding | JointMode::Starting);
        expect((mode == JointMode::Following || stands) && is_read, || {
            let state = rig.state(joint);
            format!("{}: read: {is_read}, {state:?}", rig.robot.motor.joints[joint].name)
        })?;
    }
    Ok(())
}

/// Checks that joints are in a mode for a cause.
fn are(rig: &Rig, joints: &[usize], mode: JointMode, cause: JointCause) -> Verdict {
    for &joint in joints {
        let state = (rig.mode(joint), rig.cause(joint));
        expect(state == (mode, cause), || {
            format!("{} is {state:?}, not {:?}", rig.robot.motor.joints[joint].name, (mode, cause))
        })?;
    }
    Ok(())
}

fn all_follow(rig: &Rig) -> Verdict {
    are(rig, &everybody(), JointMode::Following, JointCause::None)
}

/// Cycles until the check passes, at most `cycles`.
fn within(rig: &mut Rig, cycles: u32, verdict: impl Fn(&Rig) -> Verdict) -> Verdict {
    for _ in 0..cycles {
        rig.cycle();
        if verdict(rig).is_ok() {
            return Ok(());
        }
    }
    verdict(rig).map_err(|wrong| format!("after {cycles} cycles: {wrong}"))
}

/// Number of cycles in a simulated time.
fn cycles_in(time: Duration) -> u32 {
    u32::try_from(time.as_millis() / PERIOD.as_millis()).unwrap()
}

/// Rows of the table in the documentation whose header begins with `head`, as cells.
fn table(head: &str) -> Vec<Vec<&'static str>> {
    let docs = include_str!("../../../../../../docs/servo-bus.md");
    let lines = docs.lines().skip_while(|line| !line.starts_with(head)).skip(2);
    let rows = lines.take_while(|line| line.starts_with('|'));
    rows.map(|row| row.trim_matches('|').split(" | ").map(str::trim).collect()).collect()
}

#[test]
fn the_docs_list_every_kind_in_its_order() {
    let rows = table("| kind |");
    let kinds: Vec<&str> = rows.iter().map(|row| row[0].trim_matches('`')).collect();
    assert_eq!(kinds, FaultKind::ALL.map(FaultKind::name));
}

#[test]
fn every_fault_in_the_docs_is_tested_by_tests_that_are_here() {
    let sources = [
        include_str!("fault_table/answers.rs"),
        include_str!("fault_table/body.rs"),
        include_str!("fault_table/refusals.rs"),
        include_str!("fault_table/servos.rs"),
        include_str!("../../../reporter.rs"),
        include_str!("../../../tests.rs"),
        include_str!("../../../tests/faults.rs"),
        include_str!("../../../tests/stubborn.rs"),
        include_str!("../../../tests/unbelieved.rs"),
        include_str!("../../../tests/torque.rs"),
        include_str!("../tests.rs"),
        include_str!("end.rs"),
        include_str!("../../../reply_timeout.rs"),
    ];
    let (faults, tested) = (table("| fault | noticed by"), table("| fault | tests |"));
    let first = |rows: &[Vec<&'static str>]| rows.iter().map(|row| row[0]).collect::<Vec<_>>();
    assert_eq!(first(&faults), first(&tested));
    assert!(faults.len() > 10);
    let mut names = 0;
    for name in tested.iter().flat_map(|row| row[1].split('`').skip(1).step_by(2)) {
        let is_here = sources.iter().any(|source| source.contains(&format!("fn {name}(")));
        assert!(is_here, "{name} is no test");
        names += 1;
    }
    assert!(names >= tested.len(), "only {names} tests of {} faults", tested.len());
}
