use clock::{Duration, Instant};
use config::Robot;
use message::{JointCause, JointMode, JointState};

use crate::Motor;

/// Looking is spared most cycles: people are slow.
const EVERY: Duration = Duration::from_millis(100);

/// Tells people which joints are not as they should be, once each, and of an emergency stop.
pub(crate) struct Reporter {
    names: Vec<String>,
    known: Vec<Option<(JointMode, JointCause)>>,
    all_follow: bool,
    /// Whether people know that every torque is off, in this emergency.
    told_limp: bool,
    look_at: Instant,
}

impl Reporter {
    pub(crate) fn new(robot: &Robot) -> Self {
        let names: Vec<_> = robot.motor.joints.iter().map(|joint| joint.name.clone()).collect();
        let known = vec![None; names.len()];
        Self { names, known, all_follow: false, told_limp: false, look_at: Instant::EPOCH }
    }

    pub(crate) fn look(&mut self, motor: &Motor, now: Instant) {
        if now < self.look_at {
            return;
        }
        self.look_at = now + EVERY;
        if self.tell_emergency(motor) {
            return;
        }
        let mut following = 0;
        for (index, state) in motor.states().enumerate() {
            following += usize::from(state.mode() == Some(JointMode::Following));
            let (Some(known), Some(name)) = (self.known.get_mut(index), self.names.get(index)) else {
                continue;
            };
            let (Some(mode), Some(cause)) = (state.mode(), state.cause()) else { continue };
            if known.replace((mode, cause)) == Some((mode, cause)) {
                continue;
            }
            if let Some(trouble) = motor.trouble(index) {
                tracing::warn!("{name}: {trouble}");
            } else if let Some(what) = explain(&state) {
                tracing::warn!("{name} {what}");
            }
        }
        let all_follow = following == self.names.len();
        if all_follow && !self.all_follow {
            tracing::info!("all {following} joints follow");
        }
        self.all_follow = all_follow;
    }

    /// Tells once that every torque is off after an emergency stop; whether there is one.
    fn tell_emergency(&mut self, motor: &Motor) -> bool {
        let is_emergency = motor.letting_go() == Some(JointCause::Emergency);
        if self.is_newly_limp(is_emergency, motor.unconfirmed()) {
            tracing::warn!("all {} servos say that their torque is off", self.names.len());
        }
        self.all_follow &= !is_emergency;
        is_emergency
    }

    /// Whether every servo has confirmed an emergency for the first time. One that is asked later and not heard
    /// is unconfirmed again, and people know already.
    fn is_newly_limp(&mut self, is_emergency: bool, unconfirmed: usize) -> bool {
        let is_told = is_emergency && (self.told_limp || unconfirmed == 0);
        let is_new = is_told && !self.told_limp;
        self.told_limp = is_told;
        is_new
    }
}

/// What people are told of a joint that is not as it should be.
fn explain(state: &JointState) -> Option<&'static str> {
    match (state.mode()?, state.cause()?) {
        (JointMode::Quarantined, JointCause::BusLost) => Some("is quarantined: its bus is lost"),
        (JointMode::Quarantined, JointCause::Alert) => Some(
            "is away for a moment: its servo begins anew after a hardware alert. Its group holds meanwhile",
        ),
        (JointMode::Quarantined, _) => {
            Some("is quarantined: its servo does not answer; is it powered, and on this bus with this id?")
        }
        (JointMode::Starting, JointCause::Restarted) => Some(
            "is brought up again: its servo restarted by itself; look at its supply. Its group holds meanwhile",
        ),
        (JointMode::Starting, JointCause::Watchdog) => {
            Some("is armed again: the servo's own bus watchdog had tripped")
        }
        (JointMode::Following, JointCause::Derated) => {
            Some("moves more slowly: its servo is hot or short of voltage")
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn that_every_torque_is_off_is_told_once_in_an_emergency() {
        let mut reporter = Reporter::new(&Robot::load(None).unwrap());
        let steps =
            [(false, 65), (true, 65), (true, 0), (true, 1), (true, 0), (false, 65), (true, 2), (true, 0)];
        let told = steps.map(|(is_emergency, unconfirmed)| reporter.is_newly_limp(is_emergency, unconfirmed));
        assert_eq!(told, [false, false, true, false, false, false, false, true]);
    }

    #[test]
    fn a_servo_that_is_rebooted_is_not_said_to_be_silent() {
        let told = |cause| explain(&JointState::unread(0, JointMode::Quarantined, cause)).unwrap();
        assert!(told(JointCause::Silent).contains("does not answer"));
        assert!(told(JointCause::Alert).contains("begins anew"), "{}", told(JointCause::Alert));
    }
}
