//! Supervision: blocked joints, joints that carry others, and how torque goes off.

use super::*;

use message::{JointArming, JointMotion};
use servo::mock::HardwareError;

use JointMode::{Aligning, Decelerating, Following, Holding, Limp, Lowering, Quarantined, Releasing};

/// An obstacle at the shoulder: the shaft stays where it is, whatever the servo does.
struct Obstacle {
    at_rad: f64,
}

impl Obstacle {
    fn at(rig: &Rig) -> Self {
        Self { at_rad: rig.lines[0].servos[0].position_rad() }
    }

    fn hold(&self, rig: &mut Rig) {
        let servo = rig.servo(0, 0);
        let by_rad = self.at_rad - servo.position_rad();
        servo.displace(by_rad);
    }
}

#[test]
fn a_command_is_bounded_and_a_blocked_joint_stops_pressing() {
    let mut rig = following();
    rig.commanded(150, 0.3, rig.now);
    let obstacle = Obstacle::at(&rig);
    let mut cycles = 0;
    while rig.causes()[0] != JointCause::Blocked {
        obstacle.hold(&mut rig);
        rig.commanded(1, -0.9, rig.now);
        let command = rig.state(0).command_position_rad().unwrap();
        assert!((command - rig.position(0)).abs() <= 0.31, "{command} of {}", rig.position(0));
        cycles += 1;
        assert!(cycles < 400, "nobody noticed");
    }
    // It took 0.3 s to get there, and half a second more to detect the block.
    assert!(cycles > 125, "{cycles} cycles");
    let said = rig.motor.trouble(0).unwrap().to_string();
    assert!(said.starts_with("blocked: it was"), "{said}");
    for _ in 0..50 {
        obstacle.hold(&mut rig);
        rig.commanded(1, -0.9, rig.now);
    }
    assert_eq!((rig.modes()[0], rig.causes()[0], rig.torque(0, 0)), (Holding, JointCause::Blocked, 1));
    assert_eq!(rig.state(0).machines().unwrap().arming, JointArming::Locked);
    // Once released it stays: the servo's goal is its position.
    let at_rad = rig.position(0);
    rig.commanded(300, -0.9, rig.now);
    assert!((rig.position(0) - at_rad).abs() < 0.01, "from {at_rad} to {}", rig.position(0));
    rig.motor.arm(rig.now, Some(rig.motor.counts().locks));
    rig.until(600, -0.9, |rig| (rig.position(0) + 0.9).abs() < 0.003);
}

#[test]
fn a_freed_joint_catches_up_within_its_speed_limit() {
    let mut rig = following();
    rig.commanded(150, 0.3, rig.now);
    // The servo's own trajectory continues while an obstacle holds the shaft.
    rig.servo(0, 0).block(true);
    rig.commanded(150, -0.9, rig.now);
    assert_eq!(rig.modes()[0], Following);
    rig.servo(0, 0).block(false);
    let (mut fastest, mut before) = (0.0_f64, rig.lines[0].servos[0].position_rad());
    for _ in 0..300 {
        rig.commanded(1, -0.9, rig.now);
        let is_rad = rig.lines[0].servos[0].position_rad();
        fastest = fastest.max((is_rad - before).abs() / PERIOD.as_secs_f64());
        before = is_rad;
    }
    // 2 rad/s, although the servo could do 4.8; one count of PWM is 0.1 %.
    assert!((1.0..2.02).contains(&fastest), "{fastest} rad/s");
    assert!((rig.position(0) + 0.9).abs() < 0.003);
    // It may use its full PWM again.
    let pwm = rig.lines[0].servos[0].read(table::GOAL_PWM.address, 2).unwrap();
    assert_eq!(pwm, 885_u16.to_le_bytes());
}

#[test]
fn a_joint_may_have_its_own_tracking_error_limit() {
    let robot = ROBOT.replacen("group = \"body\"", "group = \"body\"\nmax_tracking_error_rad = 0.05", 1);
    let mut rig = Rig::of(&robot, SETTINGS);
    rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
    rig.commanded(150, 0.3, rig.now);
    let obstacle = Obstacle::at(&rig);
    for _ in 0..100 {
        obstacle.hold(&mut rig);
        rig.commanded(1, -0.9, rig.now);
        let command = rig.state(0).command_position_rad().unwrap();
        assert!((command - rig.position(0)).abs() <= 0.06);
    }
}

#[test]
fn a_joint_far_beyond_its_limits_is_locked() {
    let settings = SETTINGS.replace("max_beyond_limits_rad = 1.0", "max_beyond_limits_rad = 0.2");
    let mut rig = Rig::with(&settings);
    // From 0.3 to 1.4 rad; the limit is 1.
    rig.servo(0, 0).displace(1.1);
    rig.commanded(300, 0.0, rig.now);
    assert_eq!((rig.modes()[0], rig.causes()[0], rig.torque(0, 0)), (Limp, JointCause::BeyondLimits, 0));
    let said = rig.motor.trouble(0).unwrap().to_string();
    assert!(said.starts_with("it stands 0.4") && said.contains("a slipped horn"), "{said}");
    // Acknowledged while it is still there, it stays locked.
    rig.motor.arm(rig.now, Some(u64::MAX));
    rig.commanded(300, 0.0, rig.now);
    assert_eq!(rig.modes()[0], Limp);
    // Moved back by hand to a little beyond.
    rig.servo(0, 0).displace(-0.25);
    rig.commanded(100, 0.0, rig.now);
    assert_eq!(rig.modes()[0], Limp, "nobody has acknowledged it");
    rig.motor.arm(rig.now, Some(u64::MAX));
    let mut modes = BTreeSet::new();
    for _ in 0..600 {
        rig.commanded(1, 0.0, rig.now);
        if rig.lines[0].servos[0].position_rad() > 1.101 {
            modes.insert(format!("{:?}", rig.modes()[0]));
        }
    }
    assert_eq!(rig.modes()[0], Following);
    assert!(modes.contains("Aligning") && !modes.contains("Following"), "{modes:?}");
}

#[test]
fn joints_attached_to_a_failed_joint_stop_whatever_their_group() {
    let fail: [fn(&mut Rig); 4] = [
        |rig| rig.servo(0, 0).fail(HardwareError::Overload),
        |rig| _ = rig.mute.insert((0, 1)),
        |rig| rig.inject(0, "error id=1 is=7"),
        |rig| rig.servo(0, 0).restart(),
    ];
    for (kind, fail) in fail.iter().enumerate() {
        for (parents, held) in [([None, Some(0), None], [1].as_slice()), ([None, None, Some(1)], &[])] {
            let settings = SETTINGS.replace("\"simulated\"", "[\"start\"]");
            // Three groups: body, arm, and brow.
            let at = ROBOT.rfind("group = \"arm\"").unwrap();
            let robot = format!("{}group = \"brow\"{}", &ROBOT[..at], &ROBOT[at + 13..]);
            let mut rig = Rig::of(&robot, &settings);
            rig.motor = rig.motor.clone().with_parents(&parents);
            rig.until(300, 0.3, |rig| rig.modes() == [Following; 3]);
            rig.now += Duration::from_millis(1);
            fail(&mut rig);
            rig.commanded(30, -0.6, rig.now);
            for joint in [1, 2] {
                let is_held = held.contains(&joint);
                let wanted = if is_held { JointCause::GroupStopped } else { JointCause::None };
                assert_eq!(rig.causes()[joint], wanted, "fault {kind}, {parents:?}: {:?}", rig.causes());
            }
        }
    }
}

#[test]
fn a_limp_joint_is_still_read() {
    let mut rig = following();
    rig.servo(0, 1).fail(HardwareError::Overload);
    rig.until(10, 0.3, |rig| rig.modes()[1] == Limp);
    for _ in 0..50 {
        rig.servo(0, 1).displace(0.001);
        rig.commanded(1, 0.3, rig.now);
        assert_eq!(rig.state(1).sampled_at_ns, rig.now.as_nanos());
        assert_eq!(rig.modes()[1], Limp);
    }
}

/// Settings in which an undervoltage lowers the joints.
fn lowering() -> String {
    SETTINGS.replace("input_voltage = \"limp\"", "input_voltage = \"lower\"")
}

#[test]
fn after_an_undervoltage_a_joint_is_lowered_slowly_and_released() {
    let mut rig = Rig::with(&lowering());
    rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
    rig.commanded(500, 0.8, rig.now);
    // An XM430 keeps its torque when its supply is out of its limits.
    rig.servo(0, 0).fail(HardwareError::InputVoltage);
    let (mut trace, mut fastest, mut before) = (Vec::new(), 0.0_f64, rig.lines[0].servos[0].position_rad());
    while rig.modes()[0] != Limp {
        rig.commanded(1, 0.8, rig.now);
        let mode = rig.modes()[0];
        if trace.last() != Some(&mode) {
            trace.push(mode);
        }
        let is_rad = rig.lines[0].servos[0].position_rad();
        fastest = fastest.max((is_rad - before).abs() / PERIOD.as_secs_f64());
        before = is_rad;
        assert!(trace.len() < 9, "{trace:?}");
    }
    // It stood already, or came to a stop in a cycle.
    assert!(trace.ends_with(&[Holding, Lowering, Limp]), "{trace:?}");
    assert!(rig.position(0).abs() < 0.03, "it rests at {} rad", rig.position(0));
    assert!(fastest < 0.55, "{fastest} rad/s");
    assert_eq!((rig.causes()[0], rig.torque(0, 0)), (JointCause::Alert, 0));
}

#[test]
fn an_alert_of_two_kinds_gets_the_weaker_reaction() {
    let settings = lowering().replace("groups = {}", "groups = { body = \"limp\" }");
    let mut rig = Rig::with(&settings);
    rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
    rig.servo(0, 0).fail(HardwareError::InputVoltage);
    rig.commanded(1, 0.3, rig.now);
    assert_eq!(rig.modes()[0], Releasing);
    // The elbow is in another group.
    rig.servo(0, 1).fail(HardwareError::InputVoltage);
    rig.commanded(2, 0.3, rig.now);
    assert!([Decelerating, Holding].contains(&rig.modes()[1]), "{:?}", rig.modes());
    rig.servo(0, 1).fail(HardwareError::Encoder);
    rig.until(3, 0.3, |rig| [Releasing, Limp].contains(&rig.modes()[1]));

    let wrong = SETTINGS.replace("groups = {}", "groups = { leg = \"limp\" }");
    let robot = config::motor::parse(ROBOT, "motor.toml".as_ref()).unwrap();
    let refused = Motor::new(&robot, &config::parse(&wrong, "leo.toml".as_ref()).unwrap()).unwrap_err();
    assert!(matches!(&refused, MotorError::UnknownGroup { group, .. } if group == "leg"), "{refused:?}");
    insta::assert_snapshot!(refused);
}

#[test]
fn stop_category_1_slows_down_first_and_category_2_keeps_torque() {
    for (category, trace) in
        [(0, &[Limp][..]), (1, &[Decelerating, Holding, Limp]), (2, &[Decelerating, Holding])]
    {
        let settings = SETTINGS.replace("stop_category = 0", &format!("stop_category = {category}"));
        let mut rig = Rig::with(&settings);
        rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
        rig.commanded(130, -0.9, rig.now);
        let mut seen = Vec::new();
        for _ in 0..1500 {
            rig.motor.emergency_stop(rig.now);
            rig.commanded(1, -0.9, rig.now);
            let mode = rig.modes()[0];
            if seen.last() != Some(&mode) && mode != Releasing {
                seen.push(mode);
            }
        }
        assert_eq!(seen, trace, "category {category}");
        assert_eq!(rig.torque(0, 0), u8::from(category == 2));
        assert_eq!(rig.causes(), [JointCause::Emergency; 3], "category {category}");
        // After the release it waits to be armed.
        rig.motor.end_emergency();
        rig.commanded(300, -0.9, rig.now);
        assert_eq!(rig.causes(), [JointCause::Emergency; 3], "category {category}");
        rig.motor.arm(rig.now, None);
        rig.until(600, -0.9, |rig| (rig.position(0) + 0.9).abs() < 0.003);
    }
}

#[test]
fn a_joint_without_newer_goals_slows_down_and_holds() {
    let mut rig = following();
    rig.commanded(200, 0.9, rig.now);
    rig.until(300, -0.9, |rig| rig.state(0).present_velocity_rad_s() < Some(-1.0));
    for _ in 0..100 {
        rig.motor.goals(rig.now, &[goal(1, -0.9, rig.now)]);
        rig.cycle();
    }
    let at_rad = rig.position(0);
    assert!(at_rad > -0.85, "its old goal was alive still: {at_rad}");
    for _ in 0..300 {
        rig.motor.goals(rig.now, &[goal(1, -0.9, rig.now)]);
        rig.cycle();
    }
    assert!((rig.position(0) - at_rad).abs() < 1e-3);
    assert_eq!(rig.state(0).machines().unwrap().motion, JointMotion::Track);
    assert!((rig.position(1) + 0.9).abs() < 0.003);
}

/// Largest relative deviation of the velocity of a servo that follows a setpoint of constant velocity. It is sampled
/// four times per millisecond.
fn ripple(rig: &mut Rig) -> f64 {
    rig.commanded(200, -0.9, rig.now);
    let arrive_at = rig.now + Duration::from_millis(3600);
    rig.commanded(200, 0.9, arrive_at);
    let (mut slowest, mut fastest) = (f64::INFINITY, 0.0_f64);
    for _ in 0..100 {
        rig.commanded(1, 0.9, arrive_at);
        let mut servo = rig.lines[0].servos[0].clone();
        let mut before = servo.position_rad();
        for part in 1..=16_u32 {
            servo.advance(rig.now + Duration::from_micros(250) * part);
            let velocity = (servo.position_rad() - before) / 250e-6;
            before = servo.position_rad();
            (slowest, fastest) = (slowest.min(velocity), fastest.max(velocity));
        }
    }
    let middle = 0.5 * (slowest + fastest);
    println!("velocity from {slowest:.3} to {fastest:.3} rad/s");
    (fastest - slowest) / middle
}

#[test]
fn streamed_goals_are_followed_without_stopping_at_each() {
    let ripple = ripple(&mut following());
    // With a trapezoid to every goal it was above 1: the servo stopped between any two cycles.
    assert!(ripple < 0.25, "{ripple}");
}

#[test]
fn a_servo_that_was_never_present_stops_only_its_group() {
    let mut rig = Rig::new();
    rig.mute.insert((0, 2));
    rig.commanded(150, 0.3, rig.now);
    assert_eq!(rig.modes()[..2], [Following, Quarantined]);
    assert_eq!((rig.modes()[2], rig.causes()[2]), (Holding, JointCause::GroupStopped));
    let _ = Aligning;
}

#[test]
fn a_lock_from_before_an_emergency_stop_is_acknowledged_after_it() {
    let mut rig = following();
    rig.servo(0, 1).fail(HardwareError::Overheating);
    rig.inject(1, "error id=1 is=7");
    rig.commanded(50, 0.3, rig.now);
    rig.inject(1, "drop p=0");
    rig.motor.emergency_stop(rig.now);
    rig.commanded(50, 0.3, rig.now);
    rig.motor.end_emergency();
    rig.commanded(100, 0.3, rig.now);
    assert_eq!(rig.causes()[1..], [JointCause::Alert, JointCause::Refused]);
    rig.motor.arm(rig.now, Some(rig.motor.counts().locks));
    rig.until(600, 0.3, |rig| rig.modes() == [Following; 3]);
}

#[test]
fn a_blocked_joint_loses_its_torque_by_an_alert_or_refusal() {
    let fail: [fn(&mut Rig); 2] =
        [|rig| rig.servo(0, 0).fail(HardwareError::Encoder), |rig| rig.inject(0, "error id=1 is=7")];
    for fail in fail {
        let mut rig = following();
        rig.commanded(150, 0.3, rig.now);
        let obstacle = Obstacle::at(&rig);
        while rig.causes()[0] != JointCause::Blocked {
            obstacle.hold(&mut rig);
            rig.commanded(1, -0.9, rig.now);
        }
        rig.commanded(30, 0.3, rig.now);
        assert_eq!((rig.modes()[0], rig.torque(0, 0)), (Holding, 1));
        fail(&mut rig);
        rig.commanded(4, 0.3, rig.now);
        assert_eq!((rig.causes()[0], rig.torque(0, 0)), (JointCause::Blocked, 0));
    }
}

#[test]
fn a_sagging_supply_lowers_joints_one_after_the_other() {
    let mut rig = Rig::with(&lowering());
    rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
    rig.commanded(400, 0.8, rig.now);
    rig.servo(0, 1).fail(HardwareError::InputVoltage);
    // The shoulder is carried by it, and holds by then.
    rig.motor = rig.motor.clone().with_parents(&[Some(1), None, None]);
    rig.commanded(30, 0.8, rig.now);
    assert_eq!((rig.modes()[0], rig.causes()[0]), (Holding, JointCause::GroupStopped));
    rig.servo(0, 0).fail(HardwareError::InputVoltage);
    rig.until(1500, 0.8, |rig| rig.modes()[..2] == [Limp; 2]);
    for joint in [0, 1] {
        assert!(rig.position(joint).abs() < 0.03, "joint {joint} let go at {} rad", rig.position(joint));
    }
}

#[test]
fn an_unchanged_profile_velocity_is_resent_twice_a_second() {
    let mut rig = following();
    rig.commanded(600, 0.3, rig.now);
    // Bus 1 has one servo, and is asked last. A goal alone takes 5 bytes of data, and 9 with its velocity.
    let mut lengths = Vec::new();
    for _ in 0..250 {
        rig.commanded(1, 0.3, rig.now);
        lengths.push(rig.request.parts().next().unwrap().0.sent);
    }
    let shortest = *lengths.iter().min().unwrap();
    let longer = lengths.iter().filter(|length| **length == shortest + 4).count();
    // Every 125 cycles.
    assert_eq!((longer, lengths.iter().filter(|length| **length > shortest + 4).count()), (2, 0));
    // The velocity is written again soon if the servo lost it, or another program changed it.
    rig.servo(1, 0).write(table::PROFILE_VELOCITY.address, &400_u32.to_le_bytes()).unwrap();
    rig.commanded(126, 0.3, rig.now);
    let told = rig.lines[1].servos[0].read(table::PROFILE_VELOCITY.address, 4).unwrap().to_vec();
    assert!(told < 10_u32.to_le_bytes().to_vec(), "{told:?}");
}

#[test]
fn at_the_end_only_real_absent_servos_are_waited_for() {
    for device in ["mock", "/dev/ttyUSB0"] {
        let settings = SETTINGS.replace("\"simulated\"", "[\"start\"]");
        let mut rig = Rig::of(&ROBOT.replace("\"mock\"", &format!("\"{device}\"")), &settings);
        rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
        rig.motor.begin_shutdown(rig.now + Duration::from_millis(100));
        rig.lost = Some(1);
        for _ in 0..60 {
            rig.cycle();
        }
        assert_eq!(rig.modes(), [Limp, Limp, Releasing], "{device}");
        assert_eq!(rig.motor.unconfirmed(), usize::from(device != "mock"), "{device}");
    }
}
