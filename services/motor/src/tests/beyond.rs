//! A joint that is found beyond its limits returns to them, and stops on its way like any other.

use super::*;

use servo::mock::HardwareError;
use servo::table::{GOAL_POSITION, PROFILE_VELOCITY};

use JointMode::{Aligning, Decelerating, Following, Holding, Limp, Releasing};

/// A robot whose shoulder has just begun to return from beyond its limits. The brow is in another group.
fn coming_back() -> Rig {
    let mut rig = Rig::new();
    rig.servo(0, 0).displace(1.4);
    let from_rad = rig.lines[0].servos[0].position_rad();
    rig.until(300, 0.0, |rig| rig.lines[0].servos[0].position_rad() < from_rad - 0.1);
    assert_eq!(rig.modes()[0], Aligning);
    rig
}

/// Checks that the shoulder stops at once and holds its position with torque on.
fn stops(rig: &mut Rig, cause: JointCause, mut cycle: impl FnMut(&mut Rig)) {
    for _ in 0..40 {
        cycle(rig);
    }
    let at_rad = rig.lines[0].servos[0].position_rad();
    assert!(at_rad > 1.3, "it went on to {at_rad} rad");
    for _ in 0..150 {
        cycle(rig);
        assert_eq!((rig.modes()[0], rig.causes()[0], rig.torque(0, 0)), (Holding, cause, 1));
        let is_rad = rig.lines[0].servos[0].position_rad();
        assert!((is_rad - at_rad).abs() < 1e-3, "it moves, from {at_rad} to {is_rad} rad");
    }
}

#[test]
fn a_returning_joint_stops_while_a_line_is_lost() {
    let mut rig = coming_back();
    rig.lost = Some(1);
    stops(&mut rig, JointCause::BodyStopped, |rig| rig.commanded(1, 0.0, rig.now));
    rig.lost = None;
    rig.until(1500, 0.0, |rig| rig.modes() == [Following; 3] && rig.position(0).abs() < 0.003);
}

#[test]
fn a_returning_joint_stops_while_its_group_is_stopped() {
    let robot = ROBOT.replace("group = \"arm\"", "group = \"body\"");
    let mut rig = Rig::of(&robot, SETTINGS);
    rig.servo(0, 0).displace(1.4);
    rig.until(300, 0.0, |rig| rig.lines[0].servos[0].position_rad() < 1.6);
    rig.servo(1, 0).fail(HardwareError::Overheating);
    stops(&mut rig, JointCause::GroupStopped, |rig| rig.commanded(1, 0.0, rig.now));
}

#[test]
fn a_returning_joint_stops_without_a_commander_and_goes_limp_later() {
    let mut rig = coming_back();
    // Goals expire after 200 ms.
    for _ in 0..60 {
        rig.cycle();
    }
    stops(&mut rig, JointCause::CommandTimeout, Rig::cycle);
    let mut trace = vec![rig.modes()[0]];
    for _ in 0..300 {
        rig.cycle();
        if trace.last() != Some(&rig.modes()[0]) {
            trace.push(rig.modes()[0]);
        }
    }
    assert_eq!(trace, [Holding, Releasing, Limp]);
    rig.until(1500, 0.0, |rig| rig.modes() == [Following; 3] && rig.position(0).abs() < 0.003);
}

#[test]
fn a_returning_joint_stops_after_a_motor_restart_without_a_commander() {
    let mut rig = coming_back();
    let robot = config::motor::parse(ROBOT, "motor.toml".as_ref()).unwrap();
    rig.motor = Motor::new(&robot, &config::parse(SETTINGS, "leo.toml".as_ref()).unwrap()).unwrap();
    stops(&mut rig, JointCause::CommandTimeout, Rig::cycle);
    rig.until(1500, 0.0, |rig| rig.modes() == [Following; 3] && rig.position(0).abs() < 0.003);
}

#[test]
fn a_returning_joint_is_reported_as_decelerating_until_its_stop_is_confirmed() {
    let mut rig = coming_back();
    rig.inject(0, "drop id=1");
    rig.lost = Some(1);
    rig.commanded(2, 0.0, rig.now);
    assert_eq!((rig.modes()[0], rig.causes()[0]), (Decelerating, JointCause::BodyStopped));
}

#[test]
fn a_stop_is_repeated_while_the_servo_moves_on() {
    let mut rig = coming_back();
    rig.lost = Some(1);
    stops(&mut rig, JointCause::BodyStopped, |rig| rig.commanded(1, 0.0, rig.now));
    // As if it had received only the second half of the job.
    rig.servo(0, 0).write(GOAL_POSITION.address, &2048_i32.to_le_bytes()).unwrap();
    rig.until(60, 0.0, |rig| rig.modes()[0] == Decelerating);
    rig.until(60, 0.0, |rig| rig.modes()[0] == Holding);
    stops(&mut rig, JointCause::BodyStopped, |rig| rig.commanded(1, 0.0, rig.now));
    // And so slowly that its velocity looks like standing.
    rig.servo(0, 0).write(PROFILE_VELOCITY.address, &1_u32.to_le_bytes()).unwrap();
    rig.servo(0, 0).write(GOAL_POSITION.address, &2048_i32.to_le_bytes()).unwrap();
    rig.until(800, 0.0, |rig| rig.modes()[0] == Decelerating);
    rig.until(60, 0.0, |rig| rig.modes()[0] == Holding);
    stops(&mut rig, JointCause::BodyStopped, |rig| rig.commanded(1, 0.0, rig.now));
}

#[test]
fn a_servo_beyond_its_limits_does_not_move_before_its_joint_follows() {
    let mut rig = coming_back();
    rig.lost = Some(1);
    rig.commanded(100, 0.0, rig.now);
    rig.lost = None;
    let at_rad = rig.lines[0].servos[0].position_rad();
    let mut steps = 0;
    while rig.state(0).command_position_rad().is_none() {
        rig.commanded(1, 0.0, rig.now);
        let is_rad = rig.lines[0].servos[0].position_rad();
        assert!((is_rad - at_rad).abs() < 1e-3, "it moves, from {at_rad} to {is_rad} rad");
        steps += 1;
    }
    assert!(steps > 1, "{steps}");
}
