//! Behaviour that the e-manual describes outside the control table.

use super::*;
use crate::table::{
    MAX_POSITION_LIMIT, MIN_POSITION_LIMIT, MOVING_STATUS, POSITION_TRAJECTORY, PRESENT_CURRENT,
    PRESENT_INPUT_VOLTAGE, PRESENT_PWM, PWM_LIMIT,
};

/// A servo at 0.5 rad in reverse mode.
fn reversed() -> Servo {
    let mut servo = servo();
    put(&mut servo, DRIVE_MODE, 1).unwrap();
    servo
}

#[test]
fn reverse_mode_inverts_values_and_keeps_the_shaft_in_place() {
    let mut servo = reversed();
    assert!((servo.position_rad() - 0.5).abs() < 1e-9);
    assert_eq!(get(&servo, PRESENT_POSITION), i64::from(position_count(-0.5)));
    put(&mut servo, PROFILE_VELOCITY, crate::velocity_count(2.0)).unwrap();
    put(&mut servo, TORQUE_ENABLE, 1).unwrap();
    assert_eq!(get(&servo, GOAL_POSITION), i64::from(position_count(-0.5)), "torque on is no jump");
    put(&mut servo, GOAL_POSITION, position_count(-1.5)).unwrap();
    servo.advance(at(250));
    assert_eq!(get(&servo, PRESENT_VELOCITY), i64::from(-crate::velocity_count(2.0)));
    assert!(get(&servo, PRESENT_CURRENT) < 0 && get(&servo, PRESENT_PWM) < 0);
    servo.advance(at(2000));
    assert!((servo.position_rad() - 1.5).abs() < 0.002, "{}", servo.position_rad());
    assert_eq!(get(&servo, PRESENT_POSITION), i64::from(position_count(-1.5)));
}

#[test]
fn reverse_mode_turns_velocity_current_and_duty_round() {
    for (mode, goal, value) in [(1, GOAL_VELOCITY, 100), (0, GOAL_CURRENT, 200), (16, GOAL_PWM, 400)] {
        let shaft = |drive_mode| {
            let mut servo = servo();
            put(&mut servo, DRIVE_MODE, drive_mode).unwrap();
            put(&mut servo, OPERATING_MODE, mode).unwrap();
            put(&mut servo, TORQUE_ENABLE, 1).unwrap();
            put(&mut servo, goal, value).unwrap();
            servo.advance(at(300));
            (servo.position_rad() - 0.5, get(&servo, PRESENT_VELOCITY))
        };
        let ((forwards, velocity), (backwards, same)) = (shaft(0), shaft(1));
        assert!(forwards > 0.1 && (forwards + backwards).abs() < 1e-9, "mode {mode}");
        assert!(velocity > 0 && velocity == same, "mode {mode}: {velocity} and {same}");
    }
}

#[test]
fn torque_on_keeps_whole_turns_only_in_extended_position_mode() {
    for (mode, kept) in [(3, false), (4, true)] {
        let mut servo = servo();
        put(&mut servo, OPERATING_MODE, mode).unwrap();
        servo.displace(2.0 * std::f64::consts::TAU);
        let turned = i64::from(position_count(0.5)) + 8192;
        assert_eq!(get(&servo, PRESENT_POSITION), turned, "without torque it counts on in every mode");
        put(&mut servo, TORQUE_ENABLE, 1).unwrap();
        let expected = if kept { turned } else { turned - 8192 };
        assert_eq!((get(&servo, PRESENT_POSITION), get(&servo, GOAL_POSITION)), (expected, expected));
        servo.advance(at(1000));
        assert_eq!(get(&servo, PRESENT_POSITION), expected, "it does not turn back");
    }
}

#[test]
fn a_lowest_position_above_the_highest_is_refused_and_the_reverse() {
    let mut servo = servo();
    put(&mut servo, MAX_POSITION_LIMIT, 3000).unwrap();
    assert_eq!(put(&mut servo, MIN_POSITION_LIMIT, 3001), Err(Fault::Limit));
    put(&mut servo, MIN_POSITION_LIMIT, 2000).unwrap();
    assert_eq!(put(&mut servo, MAX_POSITION_LIMIT, 1999), Err(Fault::Limit));
    // Two limits written at once are checked together.
    let both = |high: i32, low: i32| [high.to_le_bytes(), low.to_le_bytes()].concat();
    assert_eq!(servo.write(MAX_POSITION_LIMIT.address, &both(1000, 1500)), Err(Fault::Limit));
    assert_eq!(servo.write(MAX_POSITION_LIMIT.address, &both(1500, 1000)), Ok(()));
    assert_eq!((get(&servo, MAX_POSITION_LIMIT), get(&servo, MIN_POSITION_LIMIT)), (1500, 1000));
}

#[test]
fn the_speed_is_proportional_to_the_pwm_limit() {
    for (item, value, expected) in [
        (PWM_LIMIT, 0, 0.0),
        (GOAL_PWM, 0, 0.0),
        (PWM_LIMIT, 442, 0.5),
        (GOAL_PWM, 442, 0.5),
        (PWM_LIMIT, 885, 1.0),
    ] {
        let mut servo = servo();
        put(&mut servo, item, value).unwrap();
        put(&mut servo, OPERATING_MODE, 4).unwrap();
        put(&mut servo, item, value).unwrap();
        put(&mut servo, TORQUE_ENABLE, 1).unwrap();
        put(&mut servo, GOAL_POSITION, 100_000).unwrap();
        servo.advance(at(1000));
        let full = crate::velocity_rad_s(200);
        let moved = (servo.position_rad() - 0.5) / full;
        assert!((moved - expected).abs() < 0.01, "{item:?} = {value}: {moved} of full speed");
        assert_eq!(get(&servo, TORQUE_ENABLE), 1);
    }
}

#[test]
fn an_obstacle_holds_the_shaft_at_the_current_limit() {
    let mut servo = moving();
    servo.advance(at(100));
    servo.block(true);
    let held_rad = servo.position_rad();
    servo.advance(at(600));
    assert!((servo.position_rad() - held_rad).abs() < 1e-12);
    assert_eq!((get(&servo, PRESENT_VELOCITY), get(&servo, PRESENT_CURRENT)), (0, 1193));
    assert!(get(&servo, POSITION_TRAJECTORY) > get(&servo, PRESENT_POSITION) + 300);
    assert_ne!(get(&servo, MOVING_STATUS) & 8, 0, "it says that it cannot follow");
    // Once released it moves at its maximum velocity, not at that of the profile.
    servo.block(false);
    servo.advance(at(700));
    assert!(get(&servo, PRESENT_VELOCITY) == 200, "{}", get(&servo, PRESENT_VELOCITY));
    servo.advance(at(1500));
    assert!((servo.position_rad() - 1.5).abs() < 0.002, "{}", servo.position_rad());
}

#[test]
fn a_lasting_obstacle_overloads_a_servo_only_with_torque() {
    let mut servo = moving();
    servo.block(true);
    servo.advance(at(3000));
    assert_eq!((get(&servo, HARDWARE_ERROR_STATUS), get(&servo, TORQUE_ENABLE)), (1 << 5, 0));
    let mut limp = super::servo();
    limp.block(true);
    limp.advance(at(3000));
    assert!(!limp.has_alert() && get(&limp, PRESENT_CURRENT) == 0);
}

#[test]
fn a_goal_or_profile_changed_in_motion_does_not_stop_it() {
    for change in [GOAL_POSITION, PROFILE_VELOCITY] {
        let mut servo = moving();
        servo.advance(at(300));
        let before = get(&servo, PRESENT_VELOCITY);
        if change == GOAL_POSITION {
            put(&mut servo, GOAL_POSITION, position_count(2.5)).unwrap();
        } else {
            // A new profile takes effect with the next goal.
            put(&mut servo, PROFILE_VELOCITY, crate::velocity_count(1.0)).unwrap();
            servo.advance(at(310));
            assert_eq!(get(&servo, PRESENT_VELOCITY), before);
            put(&mut servo, GOAL_POSITION, position_count(1.5)).unwrap();
        }
        let mut slowest = before;
        for ms in 301..450 {
            servo.advance(at(ms));
            slowest = slowest.min(get(&servo, PRESENT_VELOCITY));
        }
        let min = if change == GOAL_POSITION { before } else { i64::from(crate::velocity_count(1.0)) };
        assert!(slowest >= min - 1, "{change:?}: {slowest} of {before}");
    }
}

#[test]
fn a_profile_velocity_of_0_means_the_velocity_limit() {
    let mut servo = servo();
    put(&mut servo, crate::table::VELOCITY_LIMIT, 120).unwrap();
    put(&mut servo, TORQUE_ENABLE, 1).unwrap();
    put(&mut servo, GOAL_POSITION, 4095).unwrap();
    servo.advance(at(300));
    assert_eq!(get(&servo, PRESENT_VELOCITY), 120);
}

#[test]
fn a_supply_that_sags_is_an_alert_as_long_as_it_lasts() {
    let mut servo = servo();
    put(&mut servo, TORQUE_ENABLE, 1).unwrap();
    servo.dynamics.sag_v = Some(8.0);
    servo.advance(at(10));
    assert_eq!((get(&servo, PRESENT_INPUT_VOLTAGE), get(&servo, HARDWARE_ERROR_STATUS)), (80, 1));
    assert_eq!(get(&servo, TORQUE_ENABLE), 1, "its shutdown mask does not name the voltage");
    servo.dynamics.sag_v = None;
    servo.advance(at(20));
    assert!(!servo.has_alert());
}
