use super::*;
use crate::table::{
    Item, OPERATING_MODE, PRESENT_POSITION, PRESENT_TEMPERATURE, PROFILE_ACCELERATION, PROFILE_VELOCITY,
};
use crate::{Reading, position_count};

mod manual;

fn servo() -> Servo {
    Servo::new(Model::Xm430W350, Id::new(1).unwrap(), 0.5, Instant::EPOCH)
}

fn at(ms: u64) -> Instant {
    Instant::EPOCH + Duration::from_millis(ms)
}

fn put(servo: &mut Servo, item: Item, value: i32) -> Result<(), Fault> {
    servo.write(item.address, &value.to_le_bytes()[..usize::from(item.length)])
}

fn get(servo: &Servo, item: Item) -> i64 {
    servo.memory.get(item)
}

/// Torque on, 2 rad/s and 10 rad/s², towards 1.5 rad.
fn moving() -> Servo {
    let mut servo = servo();
    put(&mut servo, PROFILE_ACCELERATION, crate::acceleration_count(10.0)).unwrap();
    put(&mut servo, PROFILE_VELOCITY, crate::velocity_count(2.0)).unwrap();
    put(&mut servo, TORQUE_ENABLE, 1).unwrap();
    put(&mut servo, GOAL_POSITION, position_count(1.5)).unwrap();
    servo
}

#[test]
fn a_ping_is_answered_with_the_model() {
    assert_eq!(servo().ping(), [0xFC, 3, 46]);
}

#[test]
fn the_rules_of_the_table_hold() {
    let mut servo = servo();
    assert_eq!(put(&mut servo, PRESENT_POSITION, 0), Err(Fault::Access));
    assert_eq!(put(&mut servo, TORQUE_ENABLE, 2), Err(Fault::Range));
    assert_eq!(put(&mut servo, GOAL_POSITION, 4096), Err(Fault::Limit));
    assert_eq!(servo.write(GOAL_POSITION.address, &[0, 8]), Err(Fault::Length));
    assert_eq!(servo.write(160, &[0]), Err(Fault::Access));
    assert_eq!(servo.read(660, 9), Err(Fault::Access));
    assert_eq!(put(&mut servo, OPERATING_MODE, 3), Ok(()));
    assert_eq!(put(&mut servo, TORQUE_ENABLE, 1), Ok(()));
    assert_eq!(put(&mut servo, OPERATING_MODE, 3), Err(Fault::Access));
}

#[test]
fn a_write_with_one_bad_item_changes_none() {
    let mut servo = servo();
    let before = servo.read(108, 12).unwrap().to_vec();
    let data = [10, 0, 0, 0, 20, 0, 0, 0, 0, 0, 1, 0];
    assert_eq!(servo.write(108, &data), Err(Fault::Limit));
    assert_eq!(servo.read(108, 12).unwrap(), before);
}

/// 0.2 s of acceleration, 0.3 s at 2 rad/s, 0.2 s of deceleration.
#[test]
fn a_servo_moves_on_its_profile() {
    let mut servo = moving();
    let reading = |servo: &Servo| {
        Reading::parse(servo.model, servo.read(Reading::ITEM.address, Reading::ITEM.length).unwrap()).unwrap()
    };
    servo.advance(at(350));
    let halfway = reading(&servo);
    assert!((halfway.position_rad - 1.0).abs() < 0.02, "{halfway:?}");
    assert!((halfway.velocity_rad_s - 2.0).abs() < 0.03, "{halfway:?}");
    assert!(halfway.current_a > 0.05, "{halfway:?}");
    servo.advance(at(720));
    let there = reading(&servo);
    assert!((there.position_rad - 1.5).abs() < 0.002, "{there:?}");
    assert!(there.velocity_rad_s.abs() < 1e-9);
}

#[test]
fn servo_motion_is_independent_of_the_step_length() {
    let (mut often, mut seldom) = (moving(), moving());
    for ms in 0..=400 {
        often.advance(at(ms));
    }
    seldom.advance(at(400));
    assert_eq!(often.read(0, 148), seldom.read(0, 148));
}

#[test]
fn a_servo_without_torque_does_not_move() {
    let mut servo = servo();
    put(&mut servo, GOAL_POSITION, 1000).unwrap();
    servo.advance(at(1000));
    assert!((servo.position_rad() - 0.5).abs() < 1e-9);
    // Enabling torque does not move it either: the goal is then the present position.
    put(&mut servo, TORQUE_ENABLE, 1).unwrap();
    servo.advance(at(2000));
    assert!((servo.position_rad() - 0.5).abs() < 1e-9);
}

#[test]
fn bus_silence_trips_the_watchdog_and_writing_zero_clears_it() {
    let mut servo = moving();
    put(&mut servo, BUS_WATCHDOG, 5).unwrap();
    for ms in (0..=200).step_by(50) {
        servo.advance(at(ms));
        servo.hear();
        assert_eq!(get(&servo, BUS_WATCHDOG), 5);
    }
    servo.advance(at(301));
    assert_eq!(get(&servo, BUS_WATCHDOG), TRIPPED);
    servo.advance(at(2000));
    assert!(servo.position_rad() < 1.3, "it stopped at {}", servo.position_rad());
    assert_eq!(put(&mut servo, GOAL_POSITION, 2048), Err(Fault::Range));
    assert_eq!(put(&mut servo, BUS_WATCHDOG, 5), Err(Fault::Range));
    assert_eq!(put(&mut servo, BUS_WATCHDOG, 0), Ok(()));
    assert_eq!(put(&mut servo, GOAL_POSITION, 2048), Ok(()));
}

#[test]
fn the_watchdog_does_not_count_without_torque() {
    let mut servo = servo();
    put(&mut servo, BUS_WATCHDOG, 1).unwrap();
    servo.advance(at(1000));
    assert_eq!(get(&servo, BUS_WATCHDOG), 1);
}

#[test]
fn during_a_reboot_a_servo_is_silent_and_its_ram_is_reset() {
    let mut servo = servo();
    put(&mut servo, RETURN_DELAY, 0).unwrap();
    put(&mut servo, TORQUE_ENABLE, 1).unwrap();
    servo.advance(at(1000));
    assert_eq!(get(&servo, REALTIME_TICK), 1000);
    servo.reboot();
    servo.advance(at(1399));
    assert!(!servo.is_listening());
    servo.advance(at(1410));
    assert!(servo.is_listening());
    assert_eq!(get(&servo, TORQUE_ENABLE), 0);
    assert_eq!(servo.return_delay(), Duration::ZERO);
    assert_eq!(get(&servo, REALTIME_TICK), 10);
}

#[test]
fn a_hot_servo_releases_and_reports_why() {
    let mut servo = moving();
    put(&mut servo, crate::table::TEMPERATURE_LIMIT, 24).unwrap_err();
    put(&mut servo, TORQUE_ENABLE, 0).unwrap();
    put(&mut servo, crate::table::TEMPERATURE_LIMIT, 24).unwrap();
    put(&mut servo, TORQUE_ENABLE, 1).unwrap();
    servo.advance(at(1));
    assert_eq!(get(&servo, PRESENT_TEMPERATURE), 25);
    assert!(servo.has_alert());
    assert_eq!(get(&servo, TORQUE_ENABLE), 0);
}

#[test]
fn an_extended_position_exceeds_a_turn_until_a_clear() {
    let mut servo = servo();
    put(&mut servo, OPERATING_MODE, 4).unwrap();
    put(&mut servo, TORQUE_ENABLE, 1).unwrap();
    put(&mut servo, GOAL_POSITION, 10_000).unwrap();
    servo.advance(at(50));
    assert_eq!(servo.clear(), Err(Fault::Result));
    servo.advance(at(10_000));
    assert_eq!(get(&servo, PRESENT_POSITION), 10_000);
    assert_eq!(servo.clear(), Ok(()));
    assert_eq!((get(&servo, PRESENT_POSITION), get(&servo, GOAL_POSITION)), (10_000 - 8192, 10_000 - 8192));
}

#[test]
fn in_velocity_mode_a_servo_turns_at_its_limited_goal_velocity() {
    let mut servo = servo();
    put(&mut servo, OPERATING_MODE, 1).unwrap();
    assert_eq!(get(&servo, GOAL_VELOCITY), 0);
    put(&mut servo, TORQUE_ENABLE, 1).unwrap();
    assert_eq!(put(&mut servo, GOAL_VELOCITY, 201), Err(Fault::Limit));
    put(&mut servo, GOAL_VELOCITY, -100).unwrap();
    servo.advance(at(2000));
    assert_eq!(get(&servo, PRESENT_VELOCITY), -100);
    assert_eq!(get(&servo, crate::table::MOVING), 1);
}

#[test]
fn a_time_based_profile_takes_the_requested_time() {
    let mut servo = servo();
    put(&mut servo, DRIVE_MODE, 4).unwrap();
    put(&mut servo, PROFILE_VELOCITY, 1000).unwrap();
    put(&mut servo, PROFILE_ACCELERATION, 250).unwrap();
    put(&mut servo, TORQUE_ENABLE, 1).unwrap();
    put(&mut servo, GOAL_POSITION, position_count(1.5)).unwrap();
    servo.advance(at(500));
    assert!((servo.position_rad() - 1.0).abs() < 0.02, "{}", servo.position_rad());
    servo.advance(at(950));
    assert!(servo.position_rad() < 1.495, "{}", servo.position_rad());
    servo.advance(at(1010));
    assert!((servo.position_rad() - 1.5).abs() < 0.002, "{}", servo.position_rad());
}

#[test]
fn a_goal_switches_the_torque_on_where_the_drive_mode_says_so() {
    let mut servo = servo();
    put(&mut servo, DRIVE_MODE, 8).unwrap();
    put(&mut servo, GOAL_POSITION, 3000).unwrap();
    assert_eq!((get(&servo, TORQUE_ENABLE), get(&servo, GOAL_POSITION)), (1, 3000));
}

#[test]
fn a_current_based_position_stays_below_its_goal_current() {
    let mut servo = servo();
    put(&mut servo, OPERATING_MODE, 5).unwrap();
    put(&mut servo, TORQUE_ENABLE, 1).unwrap();
    put(&mut servo, GOAL_CURRENT, 10).unwrap();
    servo.load(1.0);
    put(&mut servo, GOAL_POSITION, 5000).unwrap();
    servo.advance(at(100));
    assert_eq!(get(&servo, crate::table::PRESENT_CURRENT), 10);
}

#[test]
fn a_load_heats_a_servo_and_an_overload_releases_it() {
    let mut servo = servo();
    put(&mut servo, TORQUE_ENABLE, 1).unwrap();
    servo.load(1.5);
    servo.advance(at(20_000));
    assert!(get(&servo, PRESENT_TEMPERATURE) > 30, "{}", get(&servo, PRESENT_TEMPERATURE));
    assert!(!servo.has_alert());
    servo.load(3.0);
    servo.advance(at(20_900));
    assert!(!servo.has_alert());
    servo.advance(at(21_200));
    assert_eq!((get(&servo, HARDWARE_ERROR_STATUS), get(&servo, TORQUE_ENABLE)), (1 << 5, 0));
    assert_eq!(put(&mut servo, TORQUE_ENABLE, 1), Err(Fault::Access));
}

#[test]
fn a_wrong_voltage_is_reported_while_it_lasts() {
    for (model, volts, lets_go) in [(Model::Xm430W350, 9.0, false), (Model::Xl330M288, 3.0, true)] {
        let mut servo = Servo::new(model, Id::new(1).unwrap(), 0.0, Instant::EPOCH);
        put(&mut servo, TORQUE_ENABLE, 1).unwrap();
        servo.supply(volts);
        servo.advance(at(10));
        assert_eq!((servo.has_alert(), get(&servo, TORQUE_ENABLE) == 0), (true, lets_go));
        servo.supply(model.nominal_volts());
        servo.advance(at(20));
        assert_eq!(servo.has_alert(), lets_go);
    }
}

#[test]
fn indirect_addresses_read_and_write_what_they_point_to() {
    let mut servo = servo();
    for (index, target) in (0..4).zip(116_u16..) {
        servo.write(168 + 2 * index, &target.to_le_bytes()).unwrap();
    }
    for (index, target) in (4..8).zip(132_u16..) {
        servo.write(168 + 2 * index, &target.to_le_bytes()).unwrap();
    }
    servo.write(224, &3000_i32.to_le_bytes()).unwrap();
    assert_eq!(get(&servo, GOAL_POSITION), 3000);
    servo.advance(at(1));
    assert_eq!(servo.read(228, 4), servo.read(132, 4));
    assert_eq!(servo.write(228, &[0; 4]), Err(Fault::Access));
    assert_eq!(servo.write(224, &4096_i32.to_le_bytes()), Err(Fault::Limit));
    assert_eq!(servo.write(168, &[10, 0]), Err(Fault::Range));
    servo.reboot();
    servo.advance(at(500));
    assert_eq!(servo.read(224, 4), Ok(&[0; 4][..]));
}

#[test]
fn a_homing_offset_in_extended_mode_defeats_the_watchdog() {
    for (offset, tripped) in [(0, true), (100, false)] {
        let mut servo = servo();
        put(&mut servo, OPERATING_MODE, 4).unwrap();
        put(&mut servo, HOMING_OFFSET, offset).unwrap();
        put(&mut servo, TORQUE_ENABLE, 1).unwrap();
        put(&mut servo, BUS_WATCHDOG, 5).unwrap();
        servo.advance(at(500));
        assert_eq!(get(&servo, BUS_WATCHDOG) == TRIPPED, tripped);
    }
}

#[test]
fn the_startup_configuration_is_applied_at_start() {
    let mut servo = servo();
    put(&mut servo, PROFILE_VELOCITY, 77).unwrap();
    put(&mut servo, STARTUP_CONFIGURATION, 3).unwrap();
    servo.back_up(Backup::Store).unwrap();
    servo.reboot();
    servo.advance(at(500));
    assert_eq!((get(&servo, PROFILE_VELOCITY), get(&servo, TORQUE_ENABLE)), (77, 1));
}
