//! Torque comes on only with a commander, and never makes a joint faster than allowed.

use super::*;

use servo::Status;
use servo::table::{
    BUS_WATCHDOG, GOAL_POSITION, HOMING_OFFSET, SECONDARY_ID, SHUTDOWN, STARTUP_CONFIGURATION, TORQUE_ENABLE,
};

use JointMode::{Following, Holding, Limp, Quarantined};

use crate::job::Job;
use crate::joint::{Joint, Policy};
use config::leo::AlertReaction;

impl Rig {
    /// Whether the watchdog of a servo is armed, which is two steps before its torque comes on.
    fn is_guarded(&self, bus: usize, place: usize) -> bool {
        self.lines[bus].servos[place].read(BUS_WATCHDOG.address, 1).unwrap() != [0]
    }

    fn tamper(&mut self, item: table::Item, data: &[u8]) {
        self.lines[0].servos[0].write(item.address, data).unwrap();
    }
}

/// A new motor process, with servos left by the previous one, which was killed while they followed.
fn begun_anew() -> Rig {
    let Rig { lines, now, .. } = following();
    Rig { lines, now, ..Rig::new() }
}

#[test]
fn a_heartbeat_with_a_future_timestamp_times_out_like_any_other() {
    let mut rig = following();
    rig.motor.goals(Instant::from_nanos(u64::MAX), &[]);
    rig.cycle();
    for _ in 0..51 {
        rig.cycle();
    }
    assert_eq!(rig.modes(), [Holding; 3]);
    for _ in 0..260 {
        rig.cycle();
    }
    assert_eq!(rig.modes(), [Limp; 3]);
    assert_eq!([rig.torque(0, 0), rig.torque(0, 1), rig.torque(1, 0)], [0; 3]);
    // A commander with a correct clock is accepted at once.
    rig.commanded(200, 0.1, rig.now);
    assert_eq!(rig.modes(), [Following; 3]);
}

#[test]
fn torque_found_on_stays_on_only_with_a_commander() {
    let mut rig = begun_anew();
    for _ in 0..250 {
        rig.cycle();
        assert_eq!(rig.torque(0, 0), 1, "a commander may come still");
    }
    assert_eq!(rig.modes(), [Holding; 3]);
    for _ in 0..100 {
        rig.cycle();
    }
    assert_eq!(rig.modes(), [Limp; 3]);
    assert_eq!(rig.causes(), [JointCause::CommandTimeout; 3]);
    assert_eq!([rig.torque(0, 0), rig.torque(0, 1), rig.torque(1, 0)], [0; 3]);

    let mut rig = begun_anew();
    for _ in 0..100 {
        rig.commanded(1, 0.3, rig.now);
        assert_eq!(rig.torque(0, 0), 1, "nothing sinks in between");
    }
    assert_eq!(rig.modes(), [Following; 3]);
}

#[test]
fn a_servo_that_returns_with_torque_without_a_commander_is_released() {
    let mut rig = following();
    rig.mute.insert((0, 1));
    for _ in 0..400 {
        rig.cycle();
    }
    assert_eq!((rig.torque(0, 0), rig.torque(0, 1)), (1, 0), "it heard nothing");
    rig.mute.clear();
    for _ in 0..400 {
        rig.cycle();
    }
    assert_eq!((rig.modes(), rig.torque(0, 0)), (vec![Limp; 3], 0));
}

#[test]
fn a_servo_with_lost_replies_is_released_long_after_its_commander_left() {
    for fault in ["drop id=1", "flip id=1"] {
        let mut rig = following();
        rig.inject(0, fault);
        rig.commanded(300, 0.3, rig.now);
        assert_eq!((rig.modes()[0], rig.torque(0, 0)), (Quarantined, 1), "{fault}: somebody commands");
        for _ in 0..299 {
            rig.cycle();
            assert_eq!(rig.torque(0, 0), 1, "{fault}: a commander may come still");
        }
        // It is told with the next ping.
        for _ in 0..1300 {
            rig.cycle();
            assert_eq!(rig.modes()[0], Quarantined);
        }
        assert_eq!(rig.torque(0, 0), 0, "{fault}");
        // It lost its torque by an order, and not by a restart.
        rig.inject(0, "drop p=0");
        for _ in 0..1300 {
            rig.cycle();
            assert_ne!(rig.causes()[0], JointCause::Restarted);
        }
        assert_eq!((rig.modes(), rig.causes()), (vec![Limp; 3], vec![JointCause::CommandTimeout; 3]));
        rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
    }
}

#[test]
fn a_servo_that_never_replied_is_released_without_a_commander() {
    let mut rig = begun_anew();
    rig.inject(0, "drop id=1");
    for _ in 0..300 {
        rig.cycle();
        assert_eq!(rig.torque(0, 0), 1, "a commander may come still");
    }
    for _ in 0..600 {
        rig.cycle();
    }
    assert_eq!((rig.modes()[0], rig.torque(0, 0)), (Quarantined, 0));
}

#[test]
fn foreign_torque_on_is_detected_within_half_a_second() {
    let mut rig = following();
    for _ in 0..400 {
        rig.cycle();
    }
    assert_eq!(rig.modes(), [Limp; 3]);
    rig.tamper(TORQUE_ENABLE, &[1]);
    let mut modes = vec![Limp];
    for _ in 0..140 {
        rig.cycle();
        if modes.last() != Some(&rig.modes()[0]) {
            modes.push(rig.modes()[0]);
        }
    }
    assert_eq!((rig.torque(0, 0), rig.modes()[0]), (0, Limp));
    assert!(modes.len() > 1, "it was said to be limp meanwhile");
}

#[test]
fn torque_stays_off_without_a_commander_or_with_a_lost_bus() {
    // A single late frame exceeds the timeout.
    let mut rig = Rig::with(&SETTINGS.replace("command_timeout_ms = 200", "command_timeout_ms = 4"));
    while !rig.is_guarded(0, 0) {
        rig.motor.goals(rig.now, &[]);
        rig.cycle();
    }
    for _ in 0..300 {
        rig.cycle();
        assert_eq!(rig.torque(0, 0), 0, "{:?}", rig.modes());
    }

    let mut rig = Rig::new();
    while !rig.is_guarded(0, 0) {
        rig.commanded(1, 0.0, rig.now);
    }
    rig.lost = Some(1);
    for _ in 0..300 {
        rig.commanded(1, 0.0, rig.now);
        assert_eq!(rig.torque(0, 0), 0, "{:?}", rig.modes());
    }
    rig.lost = None;
    rig.commanded(1600, 0.0, rig.now);
    assert_eq!(rig.modes(), [Following; 3]);
}

#[test]
fn a_joint_that_stands_beyond_its_limits_comes_back_to_them_slowly() {
    for by_rad in [1.2, -1.9] {
        let mut rig = Rig::new();
        rig.lines[0].servos[0].displace(by_rad);
        let (mut before, mut fastest, mut modes) = (None::<f64>, 0.0_f64, BTreeSet::new());
        for _ in 0..1000 {
            rig.commanded(1, 0.0, rig.now);
            let now = rig.lines[0].servos[0].position_rad();
            // Back within its limits, and after its soft start, it is as fast as any joint.
            if now.abs() > 1.0 {
                fastest = fastest.max((now - before.unwrap_or(now)).abs() / PERIOD.as_secs_f64());
                modes.insert(format!("{:?}", rig.modes()[0]));
            }
            before = Some(now);
        }
        assert!((0.3..0.55).contains(&fastest), "{fastest} rad/s, and 0.5 are allowed");
        assert!(modes.contains("Starting"), "{modes:?}");
        assert_eq!(rig.modes(), [Following; 3]);
        assert!(rig.position(0).abs() < 0.003);
    }
}

#[test]
fn a_servo_that_was_set_up_for_another_robot_gets_no_torque() {
    for (item, data, says) in [
        (HOMING_OFFSET, &500_i32.to_le_bytes()[..], "its homing offset (item 20) is 500 counts"),
        (SHUTDOWN, &[0][..], "its item 63, shutdown, is 0"),
        (
            SECONDARY_ID,
            &[7][..],
            "its secondary id (item 12) is 7: it also executes the instructions to servo 7",
        ),
        (STARTUP_CONFIGURATION, &[1][..], "its item 60, startup configuration, is 1"),
        (STARTUP_CONFIGURATION, &[2][..], "its item 60, startup configuration, is 2"),
    ] {
        let mut rig = Rig::new();
        rig.tamper(item, data);
        rig.commanded(200, 0.0, rig.now);
        assert_eq!(rig.modes(), [Limp, Following, Following]);
        assert_eq!(rig.causes()[0], JointCause::Refused);
        assert_eq!(rig.torque(0, 0), 0);
        let said = rig.motor.trouble(0).unwrap().to_string();
        assert!(said.starts_with(says), "{said}");
    }
}

#[test]
fn a_startup_configuration_is_ignored_on_firmware_without_one() {
    let mut rig = Rig::new();
    rig.tamper(STARTUP_CONFIGURATION, &[1]);
    let servo = rig.servo(0, 0);
    *servo = servo.clone().with_firmware(44);
    rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
}

#[test]
fn a_servo_with_corrupt_replies_before_its_restart_holds_its_group() {
    let mut rig = following();
    rig.inject(0, "flip id=2");
    rig.commanded(3, 0.4, rig.now);
    rig.inject(0, "drop p=0");
    rig.lines[0].servos[1].reboot();
    let mut held = 0;
    for _ in 0..600 {
        rig.commanded(1, 0.4, rig.now);
        held += u32::from(rig.causes()[2] == JointCause::GroupStopped);
    }
    assert!(held > 0, "the brow is in the elbow's group");
    assert_eq!(rig.modes(), [Following; 3]);
}

#[test]
fn a_goal_is_written_only_to_a_servo_that_follows() {
    let mut rig = begun_anew();
    let goal = rig.lines[0].servos[0].read(GOAL_POSITION.address, 4).unwrap().to_vec();
    for _ in 0..300 {
        rig.cycle();
        assert_eq!(rig.lines[0].servos[0].read(GOAL_POSITION.address, 4).unwrap(), goal);
    }
}

#[test]
fn a_refused_torque_off_is_repeated_but_not_in_every_cycle() {
    let robot = config::motor::parse(ROBOT, "motor.toml".as_ref()).unwrap();
    let policy = Policy::new(&config::parse(SETTINGS, "leo.toml".as_ref()).unwrap(), true);
    let id = Id::new(1).unwrap();
    let mut joint = Joint::new(0, id, &robot.joints[0], policy, AlertReaction::Lower);
    let status = |fault, params| Status { id, fault, alert: false, params };
    let (now, second) = (Instant::from_nanos(1), Duration::from_secs(1));
    // It is another model.
    joint.process_answer(now, Job::Ping, &status(None, &[9, 9, 46]));
    assert_eq!(joint.job(now, false), Some(Job::Torque(false)));
    joint.process_answer(now, Job::Torque(false), &status(Some(servo::Fault::Checksum), &[]));
    assert_eq!(joint.job(now, false), Some(Job::Torque(false)), "it did not hear it");
    joint.process_answer(now, Job::Torque(false), &status(Some(servo::Fault::Access), &[]));
    assert_eq!(joint.job(now + second, false), None, "the others are to be looked at");
    assert_eq!(joint.job(now + 5 * second, false), Some(Job::Torque(false)));
    joint.process_answer(now, Job::Torque(false), &status(None, &[]));
    assert_eq!(joint.job(now + 60 * second, false), None);
}
