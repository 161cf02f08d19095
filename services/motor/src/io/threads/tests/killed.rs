//! A motor process is killed while every joint moves: behaviour of the servos alone, and of the next process. Time is
//! simulated, so that no state between two checks is missed.

use message::JointGoal;
use servo::table::{GOAL_POSITION, PRESENT_POSITION, PRESENT_VELOCITY};

use super::*;

/// One count of position, and of velocity.
const COUNT_RAD: f64 = std::f64::consts::TAU / 4096.0;
const COUNT_RAD_S: f64 = 0.229 * std::f64::consts::TAU / 60.0;

/// Timeout of the servos' bus watchdog, and some more.
const STANDS_WITHIN: Duration = Duration::from_millis(220);

/// Value of an item of a joint's servo.
fn says(rig: &Rig, joint: usize, item: Item) -> i32 {
    let bytes = rig.servo(joint, |servo| servo.read(item.address, item.length).unwrap().to_vec());
    match *bytes {
        [byte] => i32::from(byte),
        [a, b, c, d] => i32::from_le_bytes([a, b, c, d]),
        _ => panic!("an item of {} bytes", bytes.len()),
    }
}

/// A cycle with goals at a share of every joint's range.
fn cycle(rig: &mut Rig, share: f64) {
    let goal = |(joint, settings): (u32, &config::motor::Joint)| {
        let goal_position_rad = settings.min_rad + share * (settings.max_rad - settings.min_rad);
        JointGoal { joint, reserved: 0, goal_position_rad, arrive_at_ns: 0 }
    };
    rig.goals = Some((0..).zip(&rig.robot.motor.joints).map(goal).collect());
    rig.cycle();
}

/// A robot whose soft start is over, with all joints in motion.
fn on_the_way() -> Rig {
    let mut rig = Rig::new(Time::Lockstep);
    for _ in 0..2000 {
        cycle(&mut rig, 0.1);
    }
    assert!(rig.motor.states().all(|state| follows(&state)));
    for _ in 0..25 {
        cycle(&mut rig, 0.9);
    }
    for joint in 0..65 {
        assert_ne!(says(&rig, joint, PRESENT_VELOCITY), 0, "{} stands", rig.robot.motor.joints[joint].name);
    }
    rig
}

#[test]
fn servos_stop_within_their_watchdog_time_after_the_commander_is_killed() {
    let rig = on_the_way();
    let alone = |time| rig.ptys.as_ref().unwrap().advance(rig.now + time);
    let watchdog = Duration::from_millis(200);
    alone(watchdog);
    assert!((0..65).all(|joint| says(&rig, joint, BUS_WATCHDOG) != 0xFF), "too early");
    alone(STANDS_WITHIN);
    let stood: Vec<i32> = (0..65).map(|joint| says(&rig, joint, PRESENT_POSITION)).collect();
    for (joint, settings) in rig.robot.motor.joints.iter().enumerate() {
        let said = (says(&rig, joint, BUS_WATCHDOG), says(&rig, joint, PRESENT_VELOCITY));
        assert_eq!(said, (0xFF, 0), "{}", settings.name);
    }
    alone(Duration::from_secs(2));
    assert!((0..65).all(|joint| says(&rig, joint, PRESENT_POSITION) == stood[joint]));
}

/// Starts another motor process after the servos were alone for a while. It must begin slowly, at their positions.
fn taken_up(alone: Duration) {
    let mut rig = on_the_way();
    let killed_at = rig.now;
    rig.motor = Motor::new(&rig.robot.motor, &rig.robot.leo.motor).unwrap();
    rig.now += alone;
    let (soft_start, max_rad_s) =
        (rig.robot.leo.motor.soft_start_ms.duration(), rig.robot.leo.motor.soft_start_rad_s.get());
    assert!(soft_start >= Duration::from_secs(1));
    // Since when each joint follows, and its last setpoint.
    let mut followed: Vec<Option<(Instant, f64)>> = vec![None; 65];
    let (mut fastest_rad_s, mut steps) = (0.0_f64, 0);
    let is_soft = |rig: &Rig, followed: &Option<(Instant, f64)>| {
        followed.is_none_or(|(since, _)| rig.now < since + Duration::from_secs(1))
    };
    let give_up = rig.now + Duration::from_secs(10);
    while followed.iter().any(|followed| is_soft(&rig, followed)) {
        cycle(&mut rig, 0.9);
        assert!(rig.now < give_up, "not all follow");
        for (joint, followed) in followed.iter_mut().enumerate() {
            let settings = &rig.robot.motor.joints[joint];
            let Some(command_rad) = rig.state(joint).command_position_rad() else {
                assert_eq!(*followed, None, "{} does not go on following", settings.name);
                // A servo that is still read does not notice that no goals arrive, but must stand all the same.
                let stands = says(&rig, joint, PRESENT_VELOCITY) == 0;
                assert!(stands || rig.now <= killed_at + STANDS_WITHIN, "{} moves by itself", settings.name);
                continue;
            };
            let Some((since, before_rad)) = *followed else {
                let stands_rad = settings.joint_rad(rig.servo(joint, |servo| servo.position_rad()));
                let off_rad = (command_rad - stands_rad).abs();
                assert!(off_rad <= COUNT_RAD, "{} begins {off_rad} rad from where it is", settings.name);
                *followed = Some((rig.now, command_rad));
                continue;
            };
            *followed = Some((since, command_rad));
            if rig.now > since + Duration::from_secs(1) {
                continue;
            }
            // Its first goal, as the servo received it.
            if rig.now == since + PERIOD {
                let told = says(&rig, joint, GOAL_POSITION).abs_diff(says(&rig, joint, PRESENT_POSITION));
                // The stopping position by the slow profile of the soft start.
                assert!(told <= 8, "{} is sent {told} counts away", settings.name);
            }
            let speed_rad_s = (command_rad - before_rad).abs() / PERIOD.as_secs_f64();
            assert!(speed_rad_s <= max_rad_s * (1.0 + 1e-9), "{}: {speed_rad_s} rad/s", settings.name);
            let is_rad_s = f64::from(says(&rig, joint, PRESENT_VELOCITY)).abs() * COUNT_RAD_S;
            assert!(is_rad_s <= max_rad_s + COUNT_RAD_S, "{} is at {is_rad_s} rad/s", settings.name);
            fastest_rad_s = fastest_rad_s.max(speed_rad_s);
            steps += 1;
        }
    }
    assert_eq!(steps, 65 * 250);
    assert!(fastest_rad_s > 0.9 * max_rad_s, "nobody went on");
    let is_well = rig.motor.states().all(|state| follows(&state));
    assert!(is_well);
}

#[test]
fn the_next_motor_process_starts_every_joint_softly_from_where_it_is() {
    // At once, while the servos still move to their last goals, and after their watchdogs tripped.
    for alone_ms in [0, 300] {
        taken_up(Duration::from_millis(alone_ms));
    }
}
