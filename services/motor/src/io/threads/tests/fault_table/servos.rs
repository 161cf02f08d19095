//! Servos with hardware faults, duplicate identifiers, or a wrong configuration.

use config::leo::OnAlert;
use servo::table::{MIN_VOLTAGE_LIMIT, TEMPERATURE_LIMIT, TORQUE_ENABLE};

use std::cell::RefCell;
use std::collections::BTreeSet;

use super::*;
use crate::JointFault;

const ALERTS: Counter = |counts| counts.alerts;
const RESTARTS: Counter = |counts| counts.restarts;
const DUPLICATES: Counter = |counts| counts.duplicates;

/// Checks that the groups of these joints hold, and no other joints do.
fn groups_hold(rig: &Rig, struck: &[usize]) -> Verdict {
    let companions = companions(rig, struck);
    for joint in (0..65).filter(|joint| !struck.contains(joint)) {
        let state = (rig.mode(joint), rig.cause(joint));
        let holds = matches!(state.0, JointMode::Decelerating | JointMode::Holding)
            && state.1 == JointCause::GroupStopped;
        let is_well = if companions.contains(&joint) { holds } else { state.0 == JointMode::Following };
        expect(is_well, || format!("{} is {state:?}", rig.robot.motor.joints[joint].name))?;
    }
    Ok(())
}

/// Whether a joint is back without torque, and the joints of its group without a fault hold.
fn holds_its_group(rig: &Rig, joint: usize, struck: &[usize]) -> bool {
    let holds = |companion: &usize| {
        let is_slow = matches!(rig.mode(*companion), JointMode::Decelerating | JointMode::Holding);
        is_slow && rig.cause(*companion) == JointCause::GroupStopped
    };
    let is_back = (rig.mode(joint), rig.cause(joint)) == (JointMode::Starting, JointCause::Restarted);
    let unstruck = |companion: &usize| !struck.contains(companion);
    is_back && companions(rig, &[joint]).iter().filter(|companion| unstruck(companion)).all(holds)
}

#[test]
fn an_alert_stops_its_group_in_its_cycle_and_reboots_as_configured() {
    for (kind, bit) in [("overload", 1 << 5), ("alert", 1)] {
        let mut rig = following_as(|robot| robot.leo.motor.on_alert = OnAlert::Reboot);
        in_turn(&mut rig, |rig, struck| {
            let before = counted(rig, ALERTS);
            rig.inject(kind, struck, "at=0s");
            rig.cycle();
            are(rig, struck, JointMode::Releasing, JointCause::Alert)?;
            for &joint in struck {
                let trouble = rig.motor.trouble(joint);
                let read = trouble == Some(JointFault::Alert(servo::HardwareErrors(bit)));
                expect(read, || format!("item 70 was not read: {trouble:?}"))?;
            }
            rig.inject("", &[], "");
            rig.cycle();
            groups_hold(rig, struck)?;
            within(rig, 4, |rig| {
                let torque = struck.iter().any(|&joint| rig.has_torque(joint));
                expect(!torque, || "it has torque".to_owned())?;
                are(rig, struck, JointMode::Limp, JointCause::Alert)
            })?;
            // One second, half a second of a reboot, and the time to come up.
            within(rig, cycles_in(Duration::from_millis(2000)), all_follow)?;
            counted_once(rig, struck, ALERTS, before)
        });
    }
}

#[test]
fn without_a_reboot_an_alert_stays_until_it_is_acknowledged() {
    let mut rig = following();
    let struck: Vec<usize> = (0..65).filter(|joint| joint % 4 == 0).collect();
    rig.inject("overload", &struck, "at=0s");
    rig.cycle();
    assert_eq!(are(&rig, &struck, JointMode::Releasing, JointCause::Alert), Ok(()));
    // The kind of the alert is known for all servos of a bus.
    for &joint in &struck {
        let trouble = rig.motor.trouble(joint).map(|trouble| trouble.to_string()).unwrap_or_default();
        assert!(trouble.starts_with("hardware alert: overload"), "{trouble}");
    }
    rig.inject("", &[], "");
    // Each servo is told separately.
    let holds = |rig: &Rig| are(rig, &struck, JointMode::Limp, JointCause::Alert);
    assert_eq!(within(&mut rig, 20, holds), Ok(()));
    for _ in 0..cycles_in(Duration::from_secs(2)) {
        rig.cycle();
        assert_eq!(holds(&rig).and(groups_hold(&rig, &struck)), Ok(()));
    }
    assert_eq!(counted_once(&rig, &struck, ALERTS, vec![0; 5]), Ok(()));
    // The operator reboots the servos by hand, and restarts the motor process.
    struck.iter().for_each(|&joint| rig.servo(joint, servo::mock::Servo::reboot));
    rig.motor.recover();
    assert_eq!(within(&mut rig, cycles_in(Duration::from_secs(3)), all_follow), Ok(()));
}

#[test]
fn a_servo_that_lost_its_settings_is_found_in_two_cycles() {
    let mut rig = following();
    in_turn(&mut rig, |rig, struck| {
        let before = counted(rig, RESTARTS);
        for &joint in struck {
            rig.servo(joint, servo::mock::Servo::restart);
        }
        within(rig, 2, |rig| are(rig, struck, JointMode::Starting, JointCause::Restarted))?;
        rig.cycle();
        groups_hold(rig, struck)?;
        within(rig, 60, all_follow)?;
        counted_once(rig, struck, RESTARTS, before)
    });
}

#[test]
fn a_restarted_servo_holds_its_group_until_it_is_up() {
    let mut rig = following();
    for (kind, more) in [("reboot", "at=0s"), ("brown-out", "at=0s for=150ms")] {
        in_turn(&mut rig, |rig, struck| {
            let before = counted(rig, RESTARTS);
            rig.inject(kind, struck, more);
            for _ in 0..3 {
                rig.cycle();
                others_go_on(rig, struck)?;
            }
            are(rig, struck, JointMode::Quarantined, JointCause::Silent)?;
            // Nothing more is known before it returns after 0.4 s. It is pinged after doubled waiting times, when its
            // bus has no other job.
            let held = RefCell::new(BTreeSet::<usize>::new());
            within(rig, cycles_in(Duration::from_millis(1600)), |rig| {
                held.borrow_mut().extend(struck.iter().filter(|joint| holds_its_group(rig, **joint, struck)));
                let all = held.borrow().len() == struck.len();
                expect(all, || format!("of {struck:?} only {:?} held their groups", held.borrow()))
            })?;
            within(rig, 60, all_follow)?;
            counted_once(rig, struck, RESTARTS, before)
        });
    }
}

#[test]
fn two_servos_of_one_identifier_switch_off_their_bus_and_are_named() {
    let mut rig = following();
    in_turn(&mut rig, |rig, struck| {
        let verdict = duplicated(rig, struck);
        rig.inject("", &[], "");
        rig.motor.recover();
        verdict
    });
}

fn duplicated(rig: &mut Rig, struck: &[usize]) -> Verdict {
    let before = counted(rig, DUPLICATES);
    rig.inject("duplicate-id", struck, "");
    let bus = |joint: usize| rig.robot.motor.joints[joint].bus;
    let twin = |joint: usize| struck.iter().copied().find(|&twin| bus(twin) == bus(joint));
    let (on_bus, others): (Vec<usize>, Vec<usize>) = (0..65).partition(|&joint| twin(joint).is_some());
    let ids: Vec<u8> =
        on_bus.iter().filter_map(|&joint| Some(rig.robot.motor.joints[twin(joint)?].id)).collect();
    // Three corrupt answers, and sixteen probes in cycles without other jobs.
    within(rig, 40, |rig| {
        let known = on_bus.iter().all(|&joint| rig.cause(joint) == JointCause::DuplicateId);
        expect(known, || "two of one identifier are not known".to_owned())
    })?;
    for (&joint, id) in on_bus.iter().zip(ids) {
        let (name, trouble) = (&rig.robot.motor.joints[joint].name, rig.motor.trouble(joint));
        expect(trouble == Some(JointFault::Duplicate(id)), || format!("{name}: {trouble:?}, not {id}"))?;
    }
    counted_once(rig, struck, DUPLICATES, before)?;
    // Each servo is told separately, and both servos of one identifier receive it. Their simultaneous answers confirm
    // nothing.
    let single: Vec<usize> = on_bus.iter().copied().filter(|joint| !struck.contains(joint)).collect();
    within(rig, 40, |rig| {
        let torque = on_bus.iter().find(|joint| rig.has_torque(**joint));
        expect(torque.is_none(), || format!("{torque:?} has torque"))?;
        for &joint in struck {
            let servos = rig.ptys.as_ref().unwrap().servos(rig.bus_of(joint)).unwrap();
            let duplicate_servos = servos.lock().unwrap().line.duplicate_servos.clone();
            let has_torque = |twin: &servo::mock::Servo| twin.read(TORQUE_ENABLE.address, 1) == Ok(&[1]);
            let limp = duplicate_servos.len() == 1 && !has_torque(&duplicate_servos[0]);
            expect(limp, || format!("the twin of {joint} has torque, of {} twins", duplicate_servos.len()))?;
        }
        are(rig, &single, JointMode::Limp, JointCause::DuplicateId)?;
        are(rig, struck, JointMode::Releasing, JointCause::DuplicateId)?;
        // Some groups are on two buses.
        let apart: Vec<usize> = companions(rig, &on_bus);
        let others: Vec<usize> = others.iter().copied().filter(|joint| !apart.contains(joint)).collect();
        are(rig, &others, JointMode::Following, JointCause::None)
    })
}

/// Brings half of the servos at a time into a condition in which they are derated, and out of it again.
fn spared(worsen: impl Fn(&mut servo::mock::Servo), mend: impl Fn(&mut servo::mock::Servo)) {
    let mut rig = following();
    let look = cycles_in(Duration::from_millis(500)) + 20;
    for rest in [0, 1] {
        let (poor, well): (Vec<usize>, Vec<usize>) = (0..65).partition(|joint| joint % 2 == rest);
        let derated = |rig: &Rig| {
            are(rig, &poor, JointMode::Following, JointCause::Derated)?;
            are(rig, &well, JointMode::Following, JointCause::None)
        };
        let mut before = vec![None; 65];
        for cycle in 0..3 * look {
            poor.iter().for_each(|&joint| rig.servo(joint, &worsen));
            // The joints are always in motion.
            rig.share = if cycle / 30 % 2 == 0 { 0.9 } else { -0.9 };
            rig.cycle();
            for &joint in &poor {
                let command = rig.state(joint).command_position_rad();
                let max = 0.6 * rig.robot.motor.joints[joint].max_velocity_rad_s * PERIOD.as_secs_f64();
                if let (Some(command), Some(before)) = (command, before[joint])
                    && cycle > 2 * look
                {
                    let step: f64 = command - before;
                    assert!(step.abs() <= max, "{joint}: {step} of {max}");
                }
                before[joint] = command;
            }
            assert!(cycle < look || derated(&rig) == Ok(()), "cycle {cycle}: {:?}", derated(&rig));
        }
        (0..65).for_each(|joint| rig.servo(joint, &mend));
        assert_eq!(within(&mut rig, look, all_follow), Ok(()));
    }
}

#[test]
fn a_hot_servo_is_slowed_down_before_it_trips() {
    // Seven degrees below its limit a servo has half of its speed.
    let limit = |servo: &servo::mock::Servo| f64::from(servo.read(TEMPERATURE_LIMIT.address, 1).unwrap()[0]);
    spared(|servo| servo.set_temperature(limit(servo) - 7.0), |servo| servo.set_temperature(30.0));
}

#[test]
fn a_servo_with_low_voltage_is_slowed_down_before_it_trips() {
    let min =
        |servo: &servo::mock::Servo| f64::from(servo.read(MIN_VOLTAGE_LIMIT.address, 1).unwrap()[0]) / 10.0;
    let nominal = |servo: &servo::mock::Servo| servo.model().nominal_volts();
    spared(
        |servo| servo.supply(min(servo) + 0.2 * (nominal(servo) - min(servo))),
        |servo| servo.supply(nominal(servo)),
    );
}
