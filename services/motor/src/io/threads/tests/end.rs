//! The orderly end of the motor process.

use message::JointCause;
use process::{Emergency, EmergencyFlag};

use super::rig::{PERIOD, Rig, Time};
use crate::io::run::shutdown;

/// A robot in motion, whose joints need longer to stop than an orderly end may take.
fn on_the_move(emergency_flag: &EmergencyFlag) -> Rig {
    let mut robot = config::Robot::load(None).unwrap();
    robot.motor.joints.iter_mut().for_each(|joint| joint.max_acceleration_rad_s2 = 0.05);
    let mut rig = Rig::of(robot, Time::Wall, emergency_flag);
    rig.share = 0.9;
    // Decelerating takes two seconds.
    rig.until_so("on the move", |rig| {
        rig.motor.states().any(|state| state.present_velocity_rad_s().is_some_and(|speed| speed.abs() > 0.1))
    });
    rig
}

#[test]
fn an_emergency_stop_is_heeded_at_once_in_an_orderly_end() {
    let folder = tempfile::tempdir().unwrap();
    let emergency = Emergency::watch(folder.path()).unwrap();
    let emergency_flag = emergency.emergency_flag();
    let Rig { mut motor, mut threads, ptys: _ptys, folder: _folder, .. } = on_the_move(&emergency_flag);
    process::emergency::raise(folder.path(), "a test").unwrap();
    while !emergency_flag.is_raised() {
        clock::sleep_until(clock::now() + PERIOD);
    }
    let mut causes = Vec::new();
    shutdown(&mut motor, &mut threads, PERIOD, &emergency_flag, |motor, _| {
        causes.push(motor.letting_go());
        Ok(())
    })
    .unwrap();
    assert_eq!(causes.first(), Some(&Some(JointCause::Emergency)));
}

#[test]
fn an_orderly_end_leaves_no_torque_on_a_joint_that_cannot_stop() {
    let Rig { mut motor, mut threads, ptys: _ptys, folder: _folder, .. } =
        on_the_move(&EmergencyFlag::default());
    let mut causes = Vec::new();
    shutdown(&mut motor, &mut threads, PERIOD, &EmergencyFlag::default(), |motor, _| {
        causes.push(motor.letting_go());
        Ok(())
    })
    .unwrap();
    assert_eq!(causes.first(), Some(&None), "they slow down first");
    assert_eq!(causes.last(), Some(&Some(JointCause::Stopped)));
    assert_eq!(motor.unconfirmed(), 0, "each servo has said that its torque is off");
}
