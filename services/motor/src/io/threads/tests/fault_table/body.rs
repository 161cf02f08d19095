//! Faults that affect the whole body: commander, lines, and emergency stop.

use process::Emergency;
use servo::table::BUS_WATCHDOG;

use super::*;

fn all() -> std::ops::Range<usize> {
    0..65
}

#[test]
fn tripped_watchdogs_are_found_within_half_a_second_and_all_joints_continue() {
    let mut rig = following();
    // The whole machine stalled: no servo received an instruction for longer than 200 ms.
    rig.now += Duration::from_millis(300);
    rig.cycle();
    let watchdog =
        |rig: &Rig, joint| rig.servo(joint, |servo| servo.read(BUS_WATCHDOG.address, 1).unwrap()[0]);
    assert!(all().all(|joint| watchdog(&rig, joint) == 0xFF), "they have not tripped");
    let mut found = std::collections::BTreeSet::new();
    for _ in 0..cycles_in(Duration::from_millis(500)) + 130 {
        rig.cycle();
        found.extend(all().filter(|&joint| rig.cause(joint) == JointCause::Watchdog));
    }
    assert_eq!(found.len(), 65);
    assert_eq!(counted_once(&rig, &everybody(), |counts| counts.watchdogs, vec![0; 5]), Ok(()));
    // The joints of a group wait for each other.
    assert_eq!(within(&mut rig, 250, all_follow), Ok(()));
    assert!(all().all(|joint| watchdog(&rig, joint) == 10), "they are armed again");
    // Goals are followed again.
    let is_there = rig.is_there();
    rig.until("there", is_there);
}

#[test]
fn without_a_commander_joints_hold_first_and_release_5_s_later() {
    let mut rig = following();
    rig.share = -rig.share;
    for _ in 0..20 {
        rig.cycle();
    }
    rig.is_commanded = false;
    for _ in 0..cycles_in(Duration::from_millis(200)) {
        rig.cycle();
        assert_eq!(others_go_on(&rig, &[]), Ok(()));
    }
    rig.cycle();
    for joint in all() {
        let is_slowing = matches!(rig.mode(joint), JointMode::Decelerating | JointMode::Holding);
        assert!(is_slowing && rig.cause(joint) == JointCause::CommandTimeout, "{:?}", rig.state(joint));
    }
    for _ in 0..cycles_in(Duration::from_millis(4990)) {
        rig.cycle();
        assert!(all().all(|joint| rig.mode(joint) != JointMode::Limp), "too early");
    }
    assert_eq!(are(&rig, &everybody(), JointMode::Holding, JointCause::CommandTimeout), Ok(()));
    // Each servo is told separately.
    assert_eq!(
        within(&mut rig, 25, |rig| are(rig, &everybody(), JointMode::Limp, JointCause::CommandTimeout)),
        Ok(())
    );
    assert!(all().all(|joint| !rig.has_torque(joint)));
    rig.is_commanded = true;
    rig.until("following", |state| state.mode() == Some(JointMode::Following));
}

/// Hangs up a bus for one second. Returns the joints on it, and the others.
fn hang_up(rig: &mut Rig, bus: usize) -> (Vec<usize>, Vec<usize>) {
    let words = format!("hang-up bus={} at=0s for=1s", rig.robot.motor.buses[bus].name);
    rig.ptys.as_ref().unwrap().inject(&[words.parse().unwrap()]);
    all().partition(|&joint| rig.robot.motor.joints[joint].bus == bus)
}

#[test]
fn a_lost_line_stops_the_body_at_once_until_it_is_back() {
    for bus in 0..5 {
        let mut rig = following();
        rig.share = -rig.share;
        let (lost, others) = hang_up(&mut rig, bus);
        // It is detected in the middle of an answer, or by the next request.
        assert_eq!(
            within(&mut rig, 3, |rig| are(rig, &lost, JointMode::Quarantined, JointCause::BusLost)),
            Ok(())
        );
        assert!(rig.motor.is_lost(bus));
        assert_eq!(rig.motor.bus_health(bus).quarantined, u64::try_from(lost.len()).unwrap());
        rig.cycle();
        for &joint in &others {
            let state = (rig.mode(joint), rig.cause(joint));
            let is_slowing = matches!(state.0, JointMode::Decelerating | JointMode::Holding);
            assert!(is_slowing && state.1 == JointCause::BodyStopped, "{state:?}");
            assert!(rig.is_read(joint), "the other lines go on");
        }
        for _ in 0..100 {
            rig.cycle();
        }
        assert_eq!(are(&rig, &others, JointMode::Holding, JointCause::BodyStopped), Ok(()));
        rig.until("following", |state| state.mode() == Some(JointMode::Following));
        assert!(!rig.motor.is_lost(bus));
        assert_eq!(rig.motor.bus_health(bus).quarantined, 0);
        // Counted once, however long it lasted.
        assert_eq!(counted_once(&rig, &lost[..1], |counts| counts.hang_ups, vec![0; 5]), Ok(()));
    }
}

fn emergency(rig: &mut Rig, struck: &[usize]) -> Verdict {
    rig.inject("drop", struck, "");
    rig.motor.let_go(JointCause::Emergency);
    rig.cycle();
    let torque = all().find(|&joint| rig.has_torque(joint));
    expect(torque.is_none(), || format!("{torque:?} has torque after the first cycle"))?;
    rig.cycle();
    let others: Vec<usize> = all().filter(|joint| !struck.contains(joint)).collect();
    are(rig, &others, JointMode::Limp, JointCause::Emergency)?;
    are(rig, struck, JointMode::Releasing, JointCause::Emergency)?;
    expect(rig.motor.unconfirmed() == struck.len(), || format!("{} unconfirmed", rig.motor.unconfirmed()))?;
    rig.inject("", &[], "");
    within(rig, 3, |rig| are(rig, &everybody(), JointMode::Limp, JointCause::Emergency))
}

#[test]
fn an_emergency_stop_is_confirmed_by_every_reachable_servo_within_two_cycles() {
    let mut rig = following();
    in_turn(&mut rig, |rig, struck| {
        let verdict = emergency(rig, struck);
        rig.inject("", &[], "");
        rig.motor.recover();
        verdict
    });
}

#[test]
fn an_emergency_stop_reaches_all_buses_and_a_lost_one_later() {
    for bus in 0..5 {
        let mut rig = following();
        let (lost, others) = hang_up(&mut rig, bus);
        rig.until_so("lost", |rig| rig.motor.is_lost(bus));
        rig.motor.let_go(JointCause::Emergency);
        rig.cycle();
        rig.cycle();
        assert_eq!(are(&rig, &others, JointMode::Limp, JointCause::Emergency), Ok(()));
        assert_eq!(are(&rig, &lost, JointMode::Releasing, JointCause::Emergency), Ok(()));
        rig.until("limp", |state| state.mode() == Some(JointMode::Limp));
        assert!(all().all(|joint| !rig.has_torque(joint)));
    }
}

#[test]
fn an_emergency_stop_takes_every_torque_while_the_cycle_hangs() {
    let folder = tempfile::tempdir().unwrap();
    let emergency = Emergency::watch(folder.path()).unwrap();
    let robot = config::Robot::load(None).unwrap();
    let mut rig = Rig::of(robot, Time::Wall, &emergency.emergency_flag());
    rig.until("following", |state| state.mode() == Some(JointMode::Following));
    assert!(all().all(|joint| rig.has_torque(joint)));
    process::emergency::raise(folder.path(), "a test").unwrap();
    // There are no more cycles from here on.
    let give_up = clock::now() + super::super::rig::LONG;
    while all().any(|joint| rig.has_torque(joint)) {
        assert!(
            clock::now() < give_up,
            "{} have torque",
            all().filter(|&joint| rig.has_torque(joint)).count()
        );
        clock::sleep_until(clock::now() + PERIOD);
    }
}
