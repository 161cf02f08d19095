//! Servos whose readings cannot be shown to be fresh, because their clocks are wrong.

use super::*;

use JointMode::{Following, Limp, Quarantined};

/// Longer than the time for which a clock must be right before it is trusted again.
const PROVEN: u32 = 15_500 / 4;
/// The longest waiting time of a quarantined servo.
const ALONE: u32 = 5_000 / 4;

impl Rig {
    /// Cycles with a commander in which the clock of servo 1 of the left bus loses a millisecond every `of` cycles.
    /// Returns how often its joint began to follow.
    fn losing(&mut self, cycles: u32, of: u32) -> u32 {
        let mut begun = 0;
        for cycle in 0..cycles {
            if cycle % of == 0 {
                // The last millisecond before the cycle; the clock continues with the next instruction.
                let at = self.now + PERIOD - Duration::from_millis(1);
                self.lines[0].inject(at, &["stopped-clock id=1".parse().unwrap()]);
                self.lines[0].advance(at);
                self.lines[0].inject(at, &[]);
            }
            let before = self.modes()[0];
            self.commanded(1, 0.3, self.now);
            begun += u32::from(before != Following && self.modes()[0] == Following);
        }
        begun
    }
}

#[test]
fn a_servo_with_a_stopped_clock_at_start_gets_no_torque() {
    let mut rig = Rig::new();
    rig.inject(0, "stopped-clock id=1");
    // It is the only servo of the first group.
    rig.until(150, 0.3, |rig| rig.modes() == [Quarantined, Following, Following]);
    assert_eq!(rig.causes()[0], JointCause::Stale);
    assert_eq!(rig.motor.trouble(0), Some(JointFault::Unbelieved));
    for _ in 0..2 * PROVEN {
        rig.commanded(1, 0.3, rig.now);
        assert_eq!((rig.modes(), rig.torque(0, 0)), (vec![Quarantined, Following, Following], 0));
    }
    // The servo is replaced.
    rig.inject(0, "drop p=0");
    let cycles = rig.until(ALONE + 2 * PROVEN, 0.3, |rig| rig.modes() == [Following; 3]);
    assert!(cycles > PROVEN - 200, "believed after {cycles} cycles");
    assert_eq!((rig.causes()[0], rig.motor.trouble(0)), (JointCause::None, None));
}

#[test]
fn a_servo_with_a_slow_clock_is_quarantined_without_flapping() {
    // By 5 % and by 2.5 %.
    for of in [5, 10] {
        let mut rig = following();
        assert_eq!(rig.losing(4 * PROVEN, of), 0, "in {of} cycles");
        assert_eq!((rig.modes()[0], rig.causes()[0]), (Quarantined, JointCause::Stale));
        assert_eq!(rig.torque(0, 0), 1, "as it was: it holds what it held");
        // Without a commander.
        for _ in 0..300 + 2 * ALONE {
            rig.cycle();
        }
        assert_eq!(rig.torque(0, 0), 0);
    }
    let mut rig = following();
    assert_eq!(rig.losing(4 * PROVEN, 17), 0);
    assert_eq!(rig.modes(), [Following; 3], "one and a half in a hundred");
}

#[test]
fn an_untrusted_servo_is_reported_as_limp_in_an_emergency() {
    let mut rig = following();
    rig.inject(0, "stopped-clock id=1");
    rig.until(60, 0.3, |rig| rig.modes()[0] == Quarantined);
    rig.motor.let_go(JointCause::Emergency);
    rig.commanded(200, 0.3, rig.now);
    assert_eq!((rig.modes(), rig.torque(0, 0)), (vec![Limp; 3], 0));
    rig.inject(0, "drop p=0");
    rig.motor.recover();
    rig.until(200, 0.3, |rig| rig.modes() == [Following; 3]);
}
