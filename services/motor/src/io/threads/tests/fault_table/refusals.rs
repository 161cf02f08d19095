//! Servos that refuse instructions, for every error number that indicates an error in this program or in the
//! configuration.

use servo::Fault;
use servo::mock::Servo;
use servo::table::TORQUE_ENABLE;

use super::*;
use crate::{JointFault, Motor, PartKind};

/// Starts a new motor process with another configuration of some joints.
fn configured(rig: &mut Rig, struck: &[usize], change: impl Fn(&mut config::motor::Joint)) {
    let mut robot = rig.robot.motor.clone();
    struck.iter().for_each(|&joint| change(&mut robot.joints[joint]));
    rig.motor = Motor::new(&robot, &rig.robot.leo.motor).unwrap();
    // Some servos had the limits of another joint before.
    rig.motor.recover();
}

/// A limit beyond the range of position mode: a range error.
fn turns_too_far(rig: &mut Rig, struck: &[usize]) {
    configured(rig, struck, |joint| joint.max_rad = 7.0);
}

/// Another program switches torque on again and again during setup: an access error.
fn has_its_torque_switched_on(rig: &mut Rig, struck: &[usize]) {
    configured(rig, struck, |joint| joint.max_rad -= 0.01);
    for _ in 0..cycles_in(Duration::from_millis(2000)) {
        rig.cycle();
        let unfinished = struck.iter().filter(|joint| rig.cause(**joint) != JointCause::Refused);
        unfinished.for_each(|&joint| rig.servo(joint, on));
    }
}

fn on(servo: &mut Servo) {
    servo.write(TORQUE_ENABLE.address, &[1]).unwrap();
}

fn refused(rig: &mut Rig, struck: &[usize], fault: Fault) -> Verdict {
    let companions = companions(rig, struck);
    let others: Vec<usize> =
        (0..65).filter(|joint| !struck.contains(joint) && !companions.contains(joint)).collect();
    within(rig, 500, |rig| {
        are(rig, struck, JointMode::Limp, JointCause::Refused)?;
        are(rig, &companions, JointMode::Holding, JointCause::GroupStopped)?;
        are(rig, &others, JointMode::Following, JointCause::None)
    })?;
    for &joint in struck {
        let trouble = rig.motor.trouble(joint);
        expect(trouble == Some(JointFault::Refused(fault)), || format!("{trouble:?}, not {fault:?}"))?;
        expect(!rig.has_torque(joint), || "it has torque".to_owned())?;
    }
    for _ in 0..50 {
        rig.cycle();
        others_go_on(rig, struck)?;
        for &joint in struck {
            let settings = &rig.robot.motor.joints[joint];
            let exchange = rig.threads.workers[settings.bus].exchange.as_ref().unwrap();
            let mut jobs = exchange.request.parts().filter(|(part, _)| part.kind == PartKind::Job);
            let told = jobs.any(|(part, _)| part.ids().contains(&settings.id));
            expect(!told, || "it is told again".to_owned())?;
        }
    }
    counted_once(rig, struck, |counts| counts.fault_counters.refusals, vec![0; 5])
}

#[test]
fn a_servo_that_refuses_an_instruction_gets_no_torque_and_no_retry() {
    let mut rig = following();
    type Provoke = fn(&mut Rig, &[usize]);
    // Limits changed by another program are detected when torque is found off, and corrected.
    let ways: [(Fault, Provoke); 2] =
        [(Fault::Range, turns_too_far), (Fault::Access, has_its_torque_switched_on)];
    for (fault, provoke) in ways {
        in_turn(&mut rig, |rig, struck| {
            provoke(rig, struck);
            let verdict = refused(rig, struck, fault).map_err(|wrong| format!("{fault:?}: {wrong}"));
            rig.motor = Motor::new(&rig.robot.motor, &rig.robot.leo.motor).unwrap();
            rig.motor.recover();
            verdict.and_then(|()| within(rig, 500, all_follow))
        });
    }
}
