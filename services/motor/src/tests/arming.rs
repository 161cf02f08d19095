//! A reset permits motion and does not start it: after any disarming an operator has to arm the joints again.

use super::*;

use message::{JointArming, JointLink, JointMachines, JointMotion, JointPower};
use servo::mock::HardwareError;
use servo::table::{BUS_WATCHDOG, MAX_POSITION_LIMIT, PWM_LIMIT};

use JointMode::{Following, Holding, Limp, Quarantined};

/// Ten seconds in cycles, the validity of an order.
const ORDER: u32 = 10_000 / 4;

impl Rig {
    /// A robot whose servos are not simulated.
    fn on_hardware() -> Self {
        Self::hardware_with(SETTINGS)
    }

    fn hardware_with(settings: &str) -> Self {
        Self::of(&ROBOT.replace("\"mock\"", "\"/dev/ttyUSB0\""), settings)
    }

    /// The same robot, armed and following.
    fn armed_hardware() -> Self {
        let mut rig = Self::on_hardware();
        rig.commanded(60, 0.3, rig.now);
        rig.motor.arm(rig.now, None);
        rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
        rig
    }

    fn machines(&self, joint: usize) -> JointMachines {
        self.state(joint).machines().unwrap()
    }

    fn arming_states(&self) -> Vec<JointArming> {
        (0..3).map(|joint| self.machines(joint).arming).collect()
    }

    /// Cycles with a commander in which nothing may move, although the goals are elsewhere.
    fn still(&mut self, cycles: u32) {
        let at_rad: Vec<f64> = (0..3).map(|joint| self.position(joint)).collect();
        for _ in 0..cycles {
            self.commanded(1, -0.6, self.now);
            for (joint, at_rad) in at_rad.iter().enumerate() {
                let is_rad = self.position(joint);
                assert!((is_rad - at_rad).abs() < 0.01, "joint {joint} moved from {at_rad} to {is_rad} rad");
            }
        }
    }
}

#[test]
fn on_hardware_no_torque_comes_on_before_the_joints_are_armed() {
    let mut rig = Rig::on_hardware();
    rig.commanded(500, 0.0, rig.now);
    assert_eq!((rig.modes(), rig.causes()), (vec![Limp; 3], vec![JointCause::NotStarted; 3]));
    assert_eq!([rig.torque(0, 0), rig.torque(0, 1), rig.torque(1, 0)], [0; 3]);
    assert_eq!(rig.arming_states(), [JointArming::Disarmed; 3]);
    rig.motor.arm(rig.now, None);
    rig.until(200, 0.0, |rig| rig.modes() == [Following; 3]);
    let all = JointMachines {
        link: JointLink::Answering,
        power: JointPower::On,
        arming: JointArming::Armed,
        arming_cause: JointCause::None,
        motion: JointMotion::SoftStart,
    };
    assert_eq!(rig.machines(2), all);
}

#[test]
fn an_order_to_arm_lapses_without_a_commander() {
    let mut rig = Rig::on_hardware();
    rig.motor.arm(rig.now, None);
    for _ in 0..ORDER + 2 {
        rig.cycle();
    }
    rig.commanded(500, 0.0, rig.now);
    assert_eq!((rig.modes(), rig.torque(0, 0)), (vec![Limp; 3], 0));
}

#[test]
fn after_a_released_emergency_stop_no_joint_moves_before_arming() {
    for is_simulated in [false, true] {
        let mut rig = if is_simulated { following() } else { Rig::armed_hardware() };
        rig.motor.emergency_stop(rig.now);
        rig.commanded(20, 0.3, rig.now);
        assert_eq!(rig.arming_states(), [JointArming::Locked; 3]);
        // An order during the emergency stop does not release it.
        rig.motor.arm(rig.now, Some(u64::MAX));
        rig.commanded(20, 0.3, rig.now);
        assert_eq!((rig.modes(), rig.causes()), (vec![Limp; 3], vec![JointCause::Emergency; 3]));
        rig.motor.end_emergency();
        rig.commanded(500, 0.3, rig.now);
        assert_eq!((rig.modes(), rig.causes()), (vec![Limp; 3], vec![JointCause::Emergency; 3]));
        assert_eq!([rig.torque(0, 0), rig.torque(0, 1), rig.torque(1, 0)], [0; 3]);
        rig.motor.arm(rig.now, None);
        rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
    }
}

#[test]
fn after_power_returns_no_joint_moves_before_arming() {
    let mut rig = Rig::armed_hardware();
    rig.now += Duration::from_millis(1);
    rig.servo(0, 1).restart();
    rig.commanded(100, 0.3, rig.now);
    // The brow is in the elbow's group, and holds.
    assert_eq!(rig.modes(), [Following, Limp, Holding]);
    assert_eq!(rig.causes()[1..], [JointCause::Restarted, JointCause::GroupStopped]);
    let at_rad = rig.position(2);
    rig.commanded(500, -0.6, rig.now);
    assert_eq!(rig.modes(), [Following, Limp, Holding]);
    assert!((rig.position(2) - at_rad).abs() < 0.01);
    // One order for both: the group moves once both have torque.
    rig.motor.arm(rig.now, None);
    rig.until(300, -0.6, |rig| rig.modes() == [Following; 3] && (rig.position(2) + 0.6).abs() < 0.003);
}

#[test]
fn after_a_lost_line_returns_no_joint_moves_before_arming() {
    let mut rig = Rig::armed_hardware();
    rig.lost = Some(1);
    rig.commanded(100, 0.3, rig.now);
    rig.lost = None;
    rig.commanded(100, 0.3, rig.now);
    assert_eq!(rig.arming_states(), [JointArming::Disarmed; 3]);
    rig.still(500);
    rig.motor.arm(rig.now, None);
    rig.until(300, -0.6, |rig| rig.modes() == [Following; 3]);
}

#[test]
fn after_a_silence_a_servo_needs_a_new_order_to_arm() {
    let mut rig = Rig::armed_hardware();
    rig.motor.arm(rig.now, None);
    rig.mute.insert((0, 1));
    rig.commanded(20, 0.3, rig.now);
    assert_eq!(rig.modes()[0], Quarantined);
    rig.mute.clear();
    rig.until(500, 0.3, |rig| rig.machines(0).link == JointLink::Answering);
    let at_rad = rig.position(0);
    rig.commanded(400, -0.6, rig.now);
    assert_eq!((rig.modes()[0], rig.causes()[0], rig.torque(0, 0)), (Holding, JointCause::Silent, 1));
    assert!((rig.position(0) - at_rad).abs() < 0.01);
    rig.motor.arm(rig.now, None);
    rig.until(300, -0.6, |rig| rig.modes() == [Following; 3]);
}

/// Makes the first servo silent, gives an order, and restores the servo well within the order's ten seconds. It does
/// not move.
fn misses_an_order(rig: &mut Rig) {
    rig.mute.insert((0, 1));
    rig.commanded(20, 0.3, rig.now);
    assert_eq!(rig.modes()[0], Quarantined);
    rig.motor.arm(rig.now, None);
    rig.commanded(20, 0.3, rig.now);
    rig.mute.clear();
    rig.until(500, 0.3, |rig| rig.machines(0).link == JointLink::Answering);
    let at_rad = rig.position(0);
    rig.commanded(300, -0.6, rig.now);
    assert!((rig.position(0) - at_rad).abs() < 0.01, "it moved: {:?}", rig.machines(0));
    assert_ne!(rig.modes()[0], Following);
}

#[test]
fn an_order_does_not_arm_a_silent_servo() {
    let mut rig = Rig::armed_hardware();
    misses_an_order(&mut rig);
    assert_eq!((rig.modes()[0], rig.causes()[0]), (Holding, JointCause::Silent));
    rig.motor.arm(rig.now, None);
    rig.until(300, -0.6, |rig| rig.modes() == [Following; 3]);
}

#[test]
fn an_order_does_not_arm_a_waiting_joint_with_a_silent_servo() {
    let mut rig = Rig::armed_hardware();
    // The line of the others is lost for a while: the whole body stops.
    rig.lost = Some(1);
    rig.commanded(100, 0.3, rig.now);
    assert_eq!(rig.causes()[0], JointCause::BodyStopped);
    rig.lost = None;
    rig.commanded(100, 0.3, rig.now);
    misses_an_order(&mut rig);
}

#[test]
fn a_servo_that_fails_to_reboot_needs_another_order() {
    let mut rig = Rig::armed_hardware();
    rig.servo(0, 0).fail(HardwareError::Overload);
    rig.commanded(300, 0.3, rig.now);
    assert_eq!((rig.causes()[0], rig.torque(0, 0)), (JointCause::Alert, 0));
    rig.motor.arm(rig.now, Some(rig.motor.counts().locks));
    rig.commanded(2, 0.3, rig.now);
    rig.mute.insert((0, 1));
    // Its reboot is over by then.
    rig.commanded(300, 0.3, rig.now);
    assert_eq!(rig.modes()[0], Quarantined);
    rig.mute.clear();
    rig.until(500, 0.3, |rig| rig.machines(0).link == JointLink::Answering);
    rig.commanded(300, -0.6, rig.now);
    assert_eq!(rig.torque(0, 0), 0, "{:?}", rig.machines(0));
    rig.motor.arm(rig.now, None);
    rig.until(400, -0.6, |rig| rig.modes() == [Following; 3]);
}

#[test]
fn a_returning_commander_starts_slowly_and_torque_stays_off() {
    let mut rig = Rig::armed_hardware();
    rig.commanded(400, 0.3, rig.now);
    for _ in 0..100 {
        rig.cycle();
    }
    assert_eq!(rig.modes(), [Holding; 3]);
    // After a gap the speed is that of the soft start, for as long.
    let (mut fastest, mut before) = (0.0_f64, rig.state(0).command_position_rad().unwrap());
    for cycle in 0..250 {
        rig.commanded(1, -0.9, rig.now);
        let command = rig.state(0).command_position_rad().unwrap();
        let speed = (command - before).abs() / PERIOD.as_secs_f64();
        before = command;
        if cycle < 100 {
            assert!(speed <= 0.5 + 1e-9, "{speed} rad/s in cycle {cycle}");
        }
        fastest = fastest.max(speed);
    }
    assert!(fastest > 1.0, "{fastest} rad/s");
    for _ in 0..400 {
        rig.cycle();
    }
    rig.commanded(500, 0.3, rig.now);
    assert_eq!((rig.modes(), rig.causes()), (vec![Limp; 3], vec![JointCause::CommandTimeout; 3]));
}

#[test]
fn configured_causes_are_rearmed_without_a_person() {
    let settings = SETTINGS.replace("\"simulated\"", "[\"start\", \"restarted\", \"other-failed\"]");
    let mut rig = Rig::hardware_with(&settings);
    rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
    rig.now += Duration::from_millis(1);
    rig.servo(0, 1).restart();
    rig.commanded(2, 0.3, rig.now);
    rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
    // This cause is not configured.
    rig.lost = Some(1);
    rig.commanded(100, 0.3, rig.now);
    rig.lost = None;
    rig.commanded(600, 0.3, rig.now);
    assert_eq!((rig.modes()[2], rig.causes()[2]), (Holding, JointCause::BusLost));
}

#[test]
fn a_lock_is_acknowledged_only_by_an_order_that_names_it() {
    let mut rig = Rig::armed_hardware();
    assert_eq!(rig.motor.counts().locks, 0);
    rig.servo(0, 1).fail(HardwareError::Overheating);
    rig.commanded(50, 0.3, rig.now);
    assert_eq!(
        (rig.machines(1).arming, rig.machines(1).arming_cause),
        (JointArming::Locked, JointCause::Alert)
    );
    assert_eq!(rig.motor.counts().locks, 1);
    // The operator saw no lock, and this one came meanwhile.
    for acknowledged in [None, Some(0)] {
        rig.motor.arm(rig.now, acknowledged);
        rig.commanded(300, 0.3, rig.now);
        assert_eq!(rig.machines(1).arming, JointArming::Locked, "{acknowledged:?}");
    }
    // Acknowledging reboots the servo, which clears its shutdown.
    rig.motor.arm(rig.now, Some(1));
    rig.until(600, 0.3, |rig| rig.modes() == [Following; 3]);
    assert_eq!((rig.motor.trouble(1), rig.motor.counts().locks), (None, 1));
}

/// Watchdog values of servos with torque, from cycle `from` on.
fn watchdogs(rig: &mut Rig, cycles: u32, from: u32) -> Vec<u8> {
    let mut seen = BTreeSet::new();
    for cycle in 0..cycles {
        rig.commanded(1, 0.3, rig.now);
        for (bus, place) in [(0, 0), (0, 1), (1, 0)] {
            if rig.torque(bus, place) == 1 && cycle >= from {
                seen.insert(rig.lines[bus].servos[place].read(BUS_WATCHDOG.address, 1).unwrap()[0]);
            }
        }
    }
    seen.into_iter().collect()
}

#[test]
fn a_servo_with_torque_is_never_without_its_watchdog() {
    // From the start: torque comes on after the watchdog is armed.
    assert_eq!(watchdogs(&mut Rig::new(), 200, 0), [10]);
    // Servos left by a killed process: their watchdogs stay armed.
    let Rig { lines, now, .. } = following();
    let mut rig = Rig { lines, now, ..Rig::new() };
    assert_eq!(watchdogs(&mut rig, 200, 0), [10]);
    // Without a watchdog, as another tool may leave them: it is armed as soon as that is read.
    let Rig { mut lines, now, .. } = following();
    for servo in lines.iter_mut().flat_map(|line| &mut line.servos) {
        servo.write(BUS_WATCHDOG.address, &[0]).unwrap();
    }
    let mut rig = Rig { lines, now, ..Rig::new() };
    assert_eq!(watchdogs(&mut rig, 200, 12), [10]);
    // A watchdog that another program disables is armed again within half a second.
    rig.servo(0, 0).write(BUS_WATCHDOG.address, &[0]).unwrap();
    assert_eq!(watchdogs(&mut rig, 300, 150), [10]);
}

#[test]
fn a_servo_with_the_limits_of_another_joint_is_not_written() {
    let mut robot = ROBOT.replace("\"mock\"", "\"/dev/ttyUSB0\"");
    // Each joint has its own limits, as in a real body.
    for (joint, limit) in [("shoulder", "max_rad = 0.9"), ("elbow", "max_rad = 0.7")] {
        let at = robot.find(&format!("name = \"{joint}\"")).unwrap();
        robot.replace_range(at.., &robot[at..].replacen("max_rad = 1.0", limit, 1));
    }
    let mut rig = Rig::of(&robot, SETTINGS);
    rig.commanded(60, 0.3, rig.now);
    rig.motor.arm(rig.now, None);
    rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
    let Rig { mut lines, now, .. } = rig;
    // The two servos of the left bus were swapped, and their identifiers corrected: only the EEPROM shows it.
    for servo in lines.iter_mut().flat_map(|line| &mut line.servos) {
        servo.write(table::TORQUE_ENABLE.address, &[0]).unwrap();
    }
    let [one, other] = [0, 1].map(|place| lines[0].servos[place].read(48, 8).unwrap().to_vec());
    lines[0].servos[0].write(48, &other).unwrap();
    lines[0].servos[1].write(48, &one).unwrap();
    let mut rig = Rig { lines, now, ..Rig::of(&robot, SETTINGS) };
    rig.commanded(100, 0.3, rig.now);
    rig.motor.arm(rig.now, None);
    rig.commanded(300, 0.3, rig.now);
    assert_eq!(rig.causes()[..2], [JointCause::Refused; 2]);
    assert_eq!([rig.torque(0, 0), rig.torque(0, 1)], [0; 2]);
    assert_eq!(rig.motor.trouble(0), Some(JointFault::OtherJoint(2)));
    let untouched = rig.lines[0].servos[0].read(48, 8).unwrap().to_vec();
    assert_eq!(untouched, other, "its EEPROM was written");
    // An operator may override: the limits are overwritten.
    rig.motor.arm(rig.now, Some(rig.motor.counts().locks));
    rig.until(400, 0.3, |rig| rig.modes() == [Following; 3]);
    assert_eq!(rig.lines[0].servos[0].read(48, 8).unwrap(), one);
}

#[test]
fn the_eeprom_of_a_servo_is_overwritten_only_after_a_notice() {
    let mut rig = Rig::on_hardware();
    rig.takes_notices = false;
    rig.commanded(500, 0.3, rig.now);
    let limits = |rig: &Rig| rig.lines[0].servos[0].read(MAX_POSITION_LIMIT.address, 4).unwrap().to_vec();
    assert_eq!(limits(&rig), 4095_u32.to_le_bytes(), "it was overwritten");
    rig.takes_notices = true;
    rig.commanded(60, 0.3, rig.now);
    assert_eq!(limits(&rig), 2700_u32.to_le_bytes());
    let told = (0, "EEPROM: max_position_limit (item 48) was 4095, and is set to 2700".to_owned());
    assert!(rig.notices.contains(&told), "{:?}", rig.notices);
}

#[test]
fn overwritten_settings_are_logged_and_tighter_limits_stay() {
    let mut rig = Rig::on_hardware();
    rig.servo(0, 0).write(MAX_POSITION_LIMIT.address, &3000_u32.to_le_bytes()).unwrap();
    rig.servo(0, 0).write(table::DRIVE_MODE.address, &[1]).unwrap();
    rig.servo(0, 0).write(PWM_LIMIT.address, &400_u16.to_le_bytes()).unwrap();
    rig.servo(0, 0).write(table::VELOCITY_LIMIT.address, &20_u32.to_le_bytes()).unwrap();
    rig.servo(0, 0).write(table::PROFILE_VELOCITY.address, &1_u32.to_le_bytes()).unwrap();
    rig.commanded(60, 0.3, rig.now);
    let told: Vec<_> = rig.notices.iter().filter(|(joint, _)| *joint == 0).map(|(_, told)| told).collect();
    for wanted in [
        "EEPROM: max_position_limit (item 48) was 3000, and is set to 2700",
        "EEPROM: drive_mode (item 10) was 1, and is set to 0; it turned the other way, which belongs in `sign` in \
         motor.toml",
        "the servo's pwm_limit (item 36) is 400, and the joint needs 885",
        "the servo's velocity_limit (item 44) is 20, and the joint needs 83",
        "another program set profile_velocity (item 112) to 1",
    ] {
        let times = told.iter().filter(|line| line.starts_with(wanted)).count();
        assert_eq!(times, 1, "{wanted}: {told:#?}");
    }
    // The joint is limited to the velocity limit of its servo.
    rig.motor.arm(rig.now, None);
    rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
    rig.commanded(150, 0.3, rig.now);
    let (mut fastest, mut before) = (0.0_f64, rig.lines[0].servos[0].position_rad());
    for _ in 0..300 {
        rig.commanded(1, -0.9, rig.now);
        let is_rad = rig.lines[0].servos[0].position_rad();
        fastest = fastest.max((is_rad - before).abs() / PERIOD.as_secs_f64());
        before = is_rad;
    }
    assert!((0.3..0.6).contains(&fastest), "{fastest} rad/s, and its servo may do 0.48");
}

#[test]
fn a_servo_with_a_power_limit_of_zero_gets_no_torque() {
    let mut rig = Rig::new();
    rig.servo(0, 0).write(PWM_LIMIT.address, &0_u16.to_le_bytes()).unwrap();
    rig.commanded(200, 0.3, rig.now);
    assert_eq!((rig.modes()[0], rig.causes()[0], rig.torque(0, 0)), (Limp, JointCause::Refused, 0));
    assert_eq!(rig.motor.trouble(0), Some(JointFault::Powerless(PWM_LIMIT.address)));
}

#[test]
fn joints_recover_together_after_all_watchdogs_tripped() {
    let mut rig = following();
    // The whole machine stalled for a second, and every watchdog tripped: two of the servos are in one group.
    rig.now += Duration::from_secs(1);
    rig.commanded(1, 0.3, rig.now);
    rig.until(400, 0.3, |rig| rig.modes() == [Following; 3]);
    let mut rig = Rig::armed_hardware();
    rig.now += Duration::from_secs(1);
    rig.commanded(300, -0.6, rig.now);
    assert_eq!((rig.modes(), rig.causes()), (vec![Holding; 3], vec![JointCause::Watchdog; 3]));
    rig.motor.arm(rig.now, None);
    rig.until(400, -0.6, |rig| rig.modes() == [Following; 3]);
}

#[test]
fn a_watchdog_that_trips_during_motion_is_no_refusal() {
    // A condition read is due every 125 cycles. Before it, the joint falls behind, and its PWM is to be limited.
    for at in (0..125).step_by(8) {
        let mut rig = following();
        rig.commanded(200 + at, 0.3, rig.now);
        rig.until(200, -0.9, |rig| rig.position(0) < 0.2);
        // The machine stalled for longer than the watchdog timeout.
        rig.now += Duration::from_millis(300);
        rig.commanded(125, -0.9, rig.now);
        assert_eq!(rig.motor.trouble(0), None, "after {at} cycles");
        rig.until(600, -0.9, |rig| rig.modes() == [Following; 3] && (rig.position(0) + 0.9).abs() < 0.05);
    }
}

#[test]
fn a_servo_that_refuses_its_duty_for_another_reason_fails() {
    let mut rig = following();
    rig.commanded(200, 0.3, rig.now);
    // Another program sets the PWM limit below that for a joint that is far behind.
    for (item, data) in
        [(table::TORQUE_ENABLE, &[0][..]), (PWM_LIMIT, &[50, 0]), (table::TORQUE_ENABLE, &[1])]
    {
        rig.servo(0, 0).write(item.address, data).unwrap();
    }
    rig.commanded(300, -0.9, rig.now);
    assert_eq!((rig.causes()[0], rig.torque(0, 0)), (JointCause::Refused, 0));
}

#[test]
fn a_watchdog_that_trips_at_torque_on_is_no_refusal() {
    for at in 0..12 {
        let mut rig = following();
        rig = Rig { lines: rig.lines, now: rig.now, ..Rig::new() };
        rig.commanded(at, 0.3, rig.now);
        // The machine stalled for longer than the watchdog timeout.
        rig.now += Duration::from_millis(300);
        rig.until(400, 0.3, |rig| rig.modes() == [Following; 3]);
        assert_eq!(rig.motor.trouble(0), None);
    }
}
