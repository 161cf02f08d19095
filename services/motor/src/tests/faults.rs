//! Every fault of a servo and of a bus: how soon it is detected, the reaction, what is published, and how it ends.

use super::*;

use crate::request::PartKind;

use servo::Status;
use servo::mock::HardwareError;

use JointMode::{Decelerating, Following, Holding, Limp, Quarantined, Releasing};

#[test]
fn an_alert_stops_only_the_group_of_its_joint_in_its_cycle() {
    let mut rig = following();
    rig.commanded(20, 0.9, rig.now);
    rig.servo(0, 1).fail(HardwareError::Overheating);
    rig.commanded(1, 0.9, rig.now);
    // The elbow and the brow are one group.
    assert_eq!(rig.modes()[..2], [Following, Releasing]);
    assert_eq!((rig.causes()[1], rig.torque(0, 1)), (JointCause::Alert, 0), "it let go by itself");
    let overheating = servo::HardwareErrors(1 << 2);
    assert_eq!(rig.motor.trouble(1), Some(JointFault::Alert(overheating)));
    rig.commanded(1, 0.9, rig.now);
    assert_eq!(rig.modes()[2], Decelerating);
    assert_eq!(rig.causes()[2], JointCause::GroupStopped);
    rig.until(3, 0.9, |rig| rig.modes()[1] == Limp);
    rig.commanded(150, 0.9, rig.now);
    assert_eq!(rig.modes(), [Following, Limp, Holding]);
    assert_eq!(rig.torque(0, 1), 0);
    assert!((rig.position(0) - 0.9).abs() < 0.003, "the other group goes on");
    assert!(rig.position(2) < 0.8, "the brow stopped on its way");
    // It stays so until an operator has acknowledged it.
    rig.servo(0, 1).reboot();
    rig.commanded(500, 0.9, rig.now);
    assert_eq!(rig.modes(), [Following, Limp, Holding]);
}

#[test]
fn a_failed_joint_is_reported_as_limp_once_its_servo_confirms_it() {
    let mut rig = following();
    // An XM430 keeps its torque when its supply is out of its limits.
    rig.servo(0, 1).fail(HardwareError::InputVoltage);
    rig.commanded(1, 0.2, rig.now);
    assert_eq!((rig.modes()[1], rig.causes()[1], rig.torque(0, 1)), (Releasing, JointCause::Alert, 1));
    rig.inject(0, "drop id=2");
    rig.commanded(200, 0.2, rig.now);
    assert_eq!((rig.modes()[1], rig.causes()[1]), (Releasing, JointCause::Alert), "nobody heard it say so");
    rig.inject(0, "drop p=0");
    rig.until(1500, 0.2, |rig| rig.modes()[1] == Limp);
    assert_eq!((rig.causes()[1], rig.torque(0, 1)), (JointCause::Alert, 0));
}

#[test]
fn a_servo_is_rebooted_after_an_alert_at_most_three_times() {
    let mut rig = Rig::with(&SETTINGS.replace("\"hold\"", "\"reboot\""));
    rig.commanded(150, 0.2, rig.now);
    assert_eq!(rig.modes(), [Following; 3]);
    for _ in 0..3 {
        rig.servo(0, 1).fail(HardwareError::Overheating);
        rig.until(10, 0.2, |rig| rig.modes()[1] == Limp);
        rig.until(700, 0.2, |rig| rig.modes() == [Following; 3]);
    }
    rig.servo(0, 1).fail(HardwareError::Overheating);
    rig.until(10, 0.2, |rig| rig.modes()[1] == Limp);
    rig.commanded(700, 0.2, rig.now);
    assert_eq!(rig.modes(), [Following, Limp, Holding]);
}

#[test]
fn a_servo_that_lost_its_torque_holds_its_group_until_it_follows() {
    let mut rig = following();
    rig.commanded(200, 0.5, rig.now);
    // A brown-out too short to be noticed as silence: the control table is as after power-on.
    rig.now += Duration::from_millis(1);
    rig.servo(1, 0).restart();
    rig.until(2, 0.5, |rig| rig.causes()[2] == JointCause::Restarted);
    rig.commanded(1, 0.9, rig.now);
    assert_eq!(rig.causes()[1], JointCause::GroupStopped);
    let held = rig.position(1);
    let cycles = rig.until(200, 0.9, |rig| rig.modes() == [Following; 3]);
    assert!(cycles > 3);
    assert!((rig.position(1) - held).abs() < 0.1, "its group held meanwhile");
    rig.until(300, 0.9, |rig| (0..3).all(|joint| (rig.position(joint) - 0.9).abs() < 0.003));
}

#[test]
fn a_joint_is_slow_for_a_while_after_torque_on() {
    let mut rig = Rig::new();
    rig.until(200, 1.0, |rig| rig.modes()[0] == Following);
    let begun_at = rig.now;
    let mut command = rig.position(0);
    let mut fastest: f64 = 0.0;
    while rig.now < begun_at + Duration::from_millis(1000) {
        rig.commanded(1, -1.0, rig.now);
        let next = rig.state(0).command_position_rad().unwrap();
        let speed = (next - command).abs() / PERIOD.as_secs_f64();
        command = next;
        if rig.now < begun_at + Duration::from_millis(400) {
            assert!(speed <= 0.5 + 1e-9, "{speed} rad/s");
        }
        fastest = fastest.max(speed);
    }
    assert!(fastest > 1.0, "and then it is not: {fastest} rad/s");
}

#[test]
fn a_hot_servo_is_slowed_down_before_it_shuts_down() {
    let mut rig = following();
    rig.commanded(150, 0.3, rig.now);
    // Five degrees below its limit: half of its speed.
    rig.servo(0, 0).set_temperature(73.0);
    rig.until(150, 0.3, |rig| rig.causes()[0] == JointCause::Derated);
    assert_eq!(rig.modes(), [Following; 3]);
    assert!(rig.state(0).present_temperature_c().unwrap() > 70.0);
    let mut fastest: f64 = 0.0;
    let mut before = rig.state(0).command_position_rad().unwrap();
    for _ in 0..200 {
        rig.servo(0, 0).set_temperature(73.0);
        rig.commanded(1, -0.9, rig.now);
        let command = rig.state(0).command_position_rad().unwrap();
        fastest = fastest.max((command - before).abs() / PERIOD.as_secs_f64());
        before = command;
    }
    assert!(fastest > 0.3 && fastest < 1.3, "{fastest} rad/s of 2");
    rig.servo(0, 0).set_temperature(30.0);
    rig.until(150, -0.9, |rig| rig.causes()[0] == JointCause::None);
}

#[test]
fn a_hot_servo_at_full_speed_stops_within_its_limits() {
    // Its condition is read twice a second, so it is found to be hot somewhere on its way.
    for from_rad in [-0.8, -0.6, -0.4, -0.2, 0.0] {
        let mut rig = following();
        rig.commanded(400, -1.0, rig.now);
        rig.until(300, 1.0, |rig| rig.position(0) > from_rad);
        for _ in 0..400 {
            rig.servo(0, 0).set_temperature(76.0);
            rig.commanded(1, 1.0, rig.now);
            let command = rig.state(0).command_position_rad().unwrap();
            assert!(command <= 1.0, "beyond the limit: {command}");
        }
        assert_eq!(rig.causes()[0], JointCause::Derated);
    }
}

#[test]
fn an_emergency_stop_switches_torque_off_in_the_same_cycle() {
    let mut rig = following();
    rig.commanded(30, 0.9, rig.now);
    rig.motor.let_go(JointCause::Emergency);
    rig.commanded(1, 0.9, rig.now);
    assert_eq!(rig.modes(), [Limp; 3]);
    assert_eq!(rig.causes(), [JointCause::Emergency; 3]);
    assert_eq!(rig.motor.unconfirmed(), 0);
    assert_eq!([rig.torque(0, 0), rig.torque(0, 1), rig.torque(1, 0)], [0; 3]);
    // It stays so under any command and any other stop.
    rig.motor.let_go(JointCause::Stopped);
    rig.commanded(200, -0.9, rig.now);
    assert_eq!(rig.causes(), [JointCause::Emergency; 3]);
    assert!(
        rig.state(0).sampled_at_ns + 20_000_000 > rig.now.as_nanos(),
        "it is still looked where they are"
    );
    let stopped_at = rig.position(0);
    rig.motor.recover();
    rig.cycle();
    assert_eq!(rig.torque(0, 0), 0, "nobody commands");
    rig.commanded(100, stopped_at, rig.now);
    assert_eq!(rig.modes(), [Following; 3]);
}

#[test]
fn an_emergency_stop_is_repeated_until_the_servo_confirms_it() {
    let mut rig = following();
    rig.mute.insert((0, 1));
    rig.motor.let_go(JointCause::Emergency);
    rig.commanded(50, 0.9, rig.now);
    assert_eq!(rig.modes(), [Releasing, Limp, Limp]);
    assert_eq!(rig.motor.unconfirmed(), 1);
    rig.mute.clear();
    rig.commanded(1, 0.9, rig.now);
    assert_eq!(rig.modes(), [Limp; 3]);
    // Torque that comes back, by the servo or by another program, is switched off again.
    rig.servo(0, 0).write(table::TORQUE_ENABLE.address, &[1]).unwrap();
    rig.commanded(3, 0.9, rig.now);
    assert_eq!(rig.torque(0, 0), 0);
}

#[test]
fn at_shutdown_a_joint_slows_down_before_its_torque_goes_off() {
    let mut rig = following();
    rig.commanded(60, -1.0, rig.now);
    rig.motor.begin_shutdown(rig.now + Duration::from_secs(1));
    let mut trace = Vec::new();
    while rig.motor.unconfirmed() > 0 {
        rig.commanded(1, -1.0, rig.now);
        let mode = rig.modes()[0];
        if trace.last() != Some(&mode) {
            trace.push(mode);
        }
    }
    assert_eq!(trace, [Decelerating, Holding, Limp]);
    assert_eq!(rig.causes(), [JointCause::Stopped; 3]);
}

#[test]
fn at_shutdown_a_joint_that_cannot_stop_in_time_releases_in_motion() {
    let robot = ROBOT.replace("max_acceleration_rad_s2 = 10.0", "max_acceleration_rad_s2 = 0.5");
    let mut rig = Rig::of(&robot, SETTINGS);
    rig.until(2000, 1.0, |rig| rig.state(0).present_velocity_rad_s() > Some(0.4));
    let let_go_at = rig.now + Duration::from_millis(500);
    rig.motor.begin_shutdown(let_go_at);
    while rig.now < let_go_at {
        assert_eq!(rig.motor.letting_go(), None);
        rig.cycle();
    }
    assert_eq!([rig.torque(0, 0), rig.torque(0, 1), rig.torque(1, 0)], [0; 3]);
    assert_eq!(rig.causes(), [JointCause::Stopped; 3]);
}

#[test]
fn a_silent_servo_costs_the_other_servos_no_reading() {
    for silent in [1, 2] {
        let mut rig = following();
        rig.mute.insert((0, silent));
        let other = usize::from(silent == 1);
        for _ in 0..6 {
            rig.commanded(1, 0.2, rig.now);
            assert_eq!(rig.state(other).sampled_at_ns, rig.now.as_nanos(), "servo {silent} is silent");
        }
        assert_eq!(rig.modes()[1 - other], Quarantined);
    }
}

#[test]
fn replies_to_an_earlier_request_of_any_length_are_never_used() {
    let mut rig = following();
    let mut kept = Vec::new();
    for _ in 0..3 {
        rig.commanded(1, 0.2, rig.now);
        kept.push(rig.replies.clone());
    }
    // Bus 1 was asked last: these are its answers of one, two and three cycles ago, in turn. Then it is quarantined,
    // and not read any more.
    for cycle in 0..9 {
        rig.now += PERIOD;
        rig.motor.goals(rig.now, &[]);
        rig.motor.step(rig.now);
        rig.motor.request(1, rig.now, &mut rig.request);
        let mut late = kept[cycle % 3].clone();
        late.record(PartKind::FastRead, |part| part.asked_at = rig.now);
        let before = rig.state(2).sampled_at_ns;
        rig.motor.replies(1, rig.now, &late);
        assert_eq!(rig.state(2).sampled_at_ns, before);
    }
    assert_eq!(rig.motor.counts().stale, 9);
    assert_eq!(rig.motor.bus_health(1).stale, 9);
}

/// Hands one answer of servo 1 on bus 1 to the motor, in place of all others of a cycle.
fn answer_alone(rig: &mut Rig, kind: PartKind, fault: Option<servo::Fault>, params: &[u8]) {
    rig.now += PERIOD;
    rig.motor.step(rig.now);
    rig.motor.request(1, rig.now, &mut rig.request);
    rig.replies.clear();
    rig.replies.add(kind, &Status { id: Id::new(1).unwrap(), alert: false, fault, params });
    rig.motor.replies(1, rig.now, &rig.replies);
}

#[test]
fn a_late_reply_to_another_job_is_not_taken_as_servo_condition() {
    let mut rig = following();
    let stale = rig.motor.counts().stale;
    // At the place of the hardware errors stands something else.
    answer_alone(&mut rig, PartKind::AlertCondition, None, &[0xFF; 107]);
    assert_eq!((rig.motor.trouble(2), rig.motor.bus_health(1).alerts), (None, 0));
    assert_eq!(rig.motor.counts().stale, stale + 1);
}

#[test]
fn an_error_reply_to_torque_enable_does_not_confirm_it() {
    let mut rig = following();
    rig.motor.emergency_stop(rig.now);
    answer_alone(&mut rig, PartKind::Torque, Some(servo::Fault::Result), &[0; 40]);
    assert_eq!(rig.motor.unconfirmed(), 3);
}

#[test]
fn an_answer_longer_than_any_expected_one_counts_as_noise() {
    let mut rig = following();
    let broken = rig.motor.bus_health(1).corrupt;
    answer_alone(&mut rig, PartKind::FastRead, None, &[0; 200]);
    assert_eq!(rig.motor.bus_health(1).corrupt, broken + 1);
}

#[test]
fn noise_with_a_valid_check_sum_is_neither_alert_nor_refusal() {
    let mut rig = following();
    rig.commanded(1, 0.0, rig.now);
    for (alert, fault) in
        [(true, None), (false, Some(servo::Fault::Unknown(34))), (true, Some(servo::Fault::Limit))]
    {
        rig.now += PERIOD;
        rig.motor.goals(rig.now, &[]);
        rig.motor.step(rig.now);
        rig.motor.request(1, rig.now, &mut rig.request);
        let length = rig.request.parts().next().unwrap().0.data;
        let noise = vec![0xA5; length];
        rig.replies.clear();
        rig.replies
            .add(PartKind::FastRead, &Status { id: Id::new(1).unwrap(), alert, fault, params: &noise });
        rig.replies.stamp(rig.now);
        rig.motor.replies(1, rig.now, &rig.replies);
        assert_eq!((rig.modes()[2], rig.motor.trouble(2)), (Following, None), "{alert} {fault:?}");
        rig.commanded(1, 0.0, rig.now);
    }
    rig.commanded(100, 0.0, rig.now);
    assert_eq!(rig.modes(), [Following; 3]);
}

#[test]
fn an_error_number_beside_a_reading_costs_no_other_servo_its_reading() {
    for version in [46, 44] {
        let mut rig = Rig::new();
        for servo in &mut rig.lines[0].servos {
            *servo = servo.clone().with_firmware(version);
        }
        rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
        for joint in [0, 1] {
            rig.motor.recover();
            rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
            rig.inject(0, &format!("error id={} is=7", joint + 1));
            rig.commanded(1, 0.3, rig.now);
            assert_eq!((rig.modes()[joint], rig.causes()[joint]), (Releasing, JointCause::Refused));
            let trouble = rig.motor.trouble(joint);
            assert_eq!(trouble, Some(JointFault::Refused(servo::Fault::Access)), "firmware {version}");
            rig.inject(0, "drop p=0");
            for _ in 0..20 {
                rig.commanded(1, 0.3, rig.now);
                assert_eq!(rig.state(1 - joint).sampled_at_ns, rig.now.as_nanos(), "firmware {version}");
                assert_eq!(rig.modes()[1 - joint], Following);
            }
            assert_eq!((rig.torque(0, joint), rig.modes()[joint]), (0, Limp));
        }
    }
}

#[test]
fn two_servos_of_one_id_switch_off_their_bus_and_are_named() {
    let mut rig = following();
    rig.commanded(20, 0.5, rig.now);
    rig.inject(0, "duplicate-id id=2");
    rig.until(100, 0.5, |rig| rig.causes()[1] == JointCause::DuplicateId);
    assert_eq!(rig.modes()[..2], [Releasing; 2]);
    rig.until(20, 0.5, |rig| rig.torque(0, 0) == 0);
    assert_eq!(rig.modes()[..2], [Limp, Releasing], "what two say at once confirms nothing");
    assert_eq!(rig.causes()[..2], [JointCause::DuplicateId; 2]);
    assert_eq!(rig.motor.trouble(0), Some(JointFault::Duplicate(2)));
    // It stays so until an operator has acknowledged it.
    rig.inject(0, "drop p=0");
    rig.commanded(300, 0.5, rig.now);
    assert_eq!(rig.modes(), [Limp, Limp, Holding], "the brow is of the elbow's group");
}

#[test]
fn two_servos_of_one_id_never_get_torque() {
    let mut rig = Rig::new();
    rig.inject(0, "duplicate-id id=1");
    for _ in 0..400 {
        rig.commanded(1, 0.5, rig.now);
        assert_eq!([rig.torque(0, 0), rig.torque(0, 1)], [0, 0]);
    }
    assert_eq!(rig.causes()[..2], [JointCause::DuplicateId; 2]);
}

/// Faults in one servo's answers affect only that servo: the others are read in every cycle, and their setpoints
/// advance.
#[test]
fn one_bad_servo_costs_one_servo() {
    for fault in [
        "drop",
        "flip",
        "truncate",
        "length",
        "length is=0",
        "length is=65535",
        "noise",
        "duplicate",
        "late by=3ms",
        "baud",
    ] {
        let mut rig = following();
        rig.inject(0, &format!("{fault} id=1"));
        let mut unread = 0;
        for _ in 0..40 {
            rig.commanded(1, 0.5, rig.now);
            unread += u32::from(rig.state(1).sampled_at_ns != rig.now.as_nanos());
        }
        assert!(unread <= 1, "{fault}: the other was not read in {unread} of 40 cycles");
        assert_eq!(rig.modes()[1..], [Following; 2], "{fault}");
        rig.inject(0, "drop p=0");
        rig.until(1500, 0.5, |rig| rig.modes() == [Following; 3]);
    }
}

#[test]
fn a_servo_of_older_firmware_is_read_separately() {
    // XM430 supports fast sync reads from firmware 45 on.
    for (versions, questions) in [([44, 46], 2), ([45, 45], 1), ([44, 44], 1)] {
        let mut rig = Rig::new();
        let servos = &mut rig.lines[0].servos;
        for (servo, version) in servos.iter_mut().zip(versions) {
            *servo = servo.clone().with_firmware(version);
        }
        rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
        for _ in 0..100 {
            rig.commanded(1, 0.3, rig.now);
            for joint in 0..3 {
                assert_eq!(
                    rig.motor.reading(joint).unwrap().0,
                    rig.now,
                    "{versions:?}: joint {joint} is read"
                );
            }
        }
        rig.motor.request(0, rig.now, &mut rig.request);
        let asked = rig
            .request
            .parts()
            .filter(|(part, _)| matches!(part.kind, PartKind::FastRead | PartKind::PlainRead));
        assert_eq!(asked.count(), questions, "{versions:?}");
        rig.commanded(200, -0.4, rig.now);
        assert!((rig.position(0) - -0.4).abs() < 0.003 && (rig.position(1) - -0.4).abs() < 0.003);
        // A servo that becomes silent does not affect the other, whichever way it is read.
        for mute in [1, 2] {
            rig.mute.insert((0, mute));
            let other = usize::from(2 - mute);
            for _ in 0..10 {
                rig.commanded(1, -0.4, rig.now);
                assert_eq!(rig.motor.reading(other).unwrap().0, rig.now, "{versions:?}: {mute} is silent");
            }
            rig.mute.clear();
            rig.until(1500, -0.4, |rig| rig.modes() == [Following; 3]);
        }
    }
}
