use std::fmt;

use arrayvec::ArrayVec;
use clock::{Duration, Instant};
use config::Robot;
use config::motor::Device;
use message::{JointArming, JointCause, JointLink, JointMode, JointState};
use quantity::number::{counted_with, saturating_u32};

use crate::joint::Policy;
use crate::{JointFault, Motor, MotorCounters, Notice};

/// Period of the checks.
const EVERY: Duration = Duration::from_millis(100);
/// Minimum time between two messages about refused or clamped goals.
const GOALS_EVERY: Duration = Duration::from_secs(10);
/// Minimum time between two messages about a starved mock bus.
const STARVED_EVERY: Duration = Duration::from_secs(60);

/// Logs which joints have a fault, once each, and the end of an emergency stop. If a whole bus is silent or lost, the
/// message names the bus, because its servos have hardly all failed at once. Some of the simulated servos of a bus without
/// injected faults are silent for one reason only, which is logged once for all of them: their process got no processor
/// time.
#[derive(Default)]
pub(crate) struct Reporter {
    names: Vec<String>,
    buses: Vec<String>,
    known: Vec<Known>,
    all_follow: bool,
    /// Whether the confirmation of torque off has been logged in this emergency.
    told_limp: bool,
    /// Number of disarmed joints that was logged last.
    told_disarmed: usize,
    disarmed: usize,
    /// Numbers of refused and clamped goals that were logged last, and when they may be logged again.
    told_goals: (u64, u64),
    tell_goals_at: Instant,
    next_update_at: Instant,
    /// Whether all servos are simulated.
    is_simulated: bool,
    /// Whether each bus is a mock bus without injected faults.
    is_faultless_mock: Vec<bool>,
    /// Which joints are armed automatically.
    policy: Option<Policy>,
    tell_starved_at: Instant,
    /// Whether the mock bus lacks real-time priority, so that all servos of a bus may be starved at once.
    is_patient: bool,
    /// By bus, whether the process at the other end closed the line.
    has_hung_up: Vec<bool>,
}

/// Last state of a joint, whether it still has to be logged, and the fault that was logged.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    state: Option<(JointMode, JointCause)>,
    is_new: bool,
    trouble: Option<JointFault>,
    bus: usize,
    /// Whether its simulated servo has missed exchanges since the last message about a starved mock bus.
    is_starved: bool,
}

impl Known {
    /// Whether its servo did not answer in time, or got no instruction in time; with `or_lost`, also whether the whole bus
    /// was not served in time.
    fn has_missed_exchanges(&self, or_lost: bool) -> bool {
        let has_missed = matches!(
            self.state,
            Some((JointMode::Quarantined, JointCause::Silent) | (JointMode::Starting, JointCause::Watchdog))
        );
        has_missed || or_lost && self.state == Some((JointMode::Quarantined, JointCause::BusLost))
    }
}

impl Reporter {
    /// `has_campaign`: whether a fault campaign injects faults into the mock buses.
    pub(crate) fn new(robot: &Robot, has_campaign: bool) -> Self {
        let (joints, buses) = (&robot.motor.joints, &robot.motor.buses);
        let is_faultless = !has_campaign && robot.leo.mock_bus.faults.is_empty();
        Self {
            names: joints.iter().map(|joint| joint.name.clone()).collect(),
            buses: buses.iter().map(|bus| bus.name.clone()).collect(),
            known: joints.iter().map(|joint| Known { bus: joint.bus, ..Known::default() }).collect(),
            is_simulated: buses.iter().all(|bus| bus.device == Device::Mock),
            policy: Some(Policy::new(&robot.leo.motor, buses.iter().all(|bus| bus.device == Device::Mock))),
            has_hung_up: vec![false; buses.len()],
            is_faultless_mock: buses.iter().map(|bus| is_faultless && bus.device == Device::Mock).collect(),
            ..Self::default()
        }
    }

    /// `is_patient`: the mock bus has no real-time priority, so that a whole bus may miss exchanges for lack of processor
    /// time. The supervisor reports the end of its process.
    pub(crate) fn with_patience(self, is_patient: bool) -> Self {
        Self { is_patient, ..self }
    }

    pub(crate) fn update(&mut self, motor: &mut Motor, now: Instant) {
        if now < self.next_update_at {
            return;
        }
        self.next_update_at = now + EVERY;
        let (names, is_simulated) = (&self.names, self.is_simulated);
        motor.take_notices(|joint, notice| {
            let name = names.get(joint).map_or("?", String::as_str);
            match notice {
                // Simulated servos have factory settings at every start.
                Notice::Overwritten { is_from_factory: true, .. } if is_simulated => {
                    tracing::debug!("{name}: {notice}");
                }
                Notice::LeftOver { .. } | Notice::Overwritten { is_from_factory: true, .. } => {
                    tracing::info!("{name}: {notice}");
                }
                Notice::Overwritten { .. } | Notice::Tighter { .. } => tracing::warn!("{name}: {notice}"),
            }
        });
        self.tell_goals(motor, now);
        if self.tell_emergency(motor) {
            return;
        }
        if !motor.is_stopped() {
            self.tell_disarmed(motor);
        }
        for (bus, has_hung_up) in self.has_hung_up.iter_mut().enumerate() {
            *has_hung_up = motor.has_hung_up(bus);
        }
        let trouble = |index| motor.trouble(index);
        self.tell_joints(motor.states(), now, trouble, |line| tracing::warn!("{line}"));
        let follow = |known: &&Known| matches!(known.state, Some((JointMode::Following, _)));
        let following = self.known.iter().filter(follow).count();
        let all_follow = following == self.names.len();
        if all_follow && !self.all_follow {
            tracing::info!("all {following} joints follow");
        }
        self.all_follow = all_follow;
    }

    /// Logs the number of goals that were refused or clamped since the last message.
    fn tell_goals(&mut self, motor: &Motor, now: Instant) {
        let MotorCounters { refused, limited, .. } = motor.counts();
        let (more_refused, more_limited) = (refused - self.told_goals.0, limited - self.told_goals.1);
        if (more_refused, more_limited) == (0, 0) || now < self.tell_goals_at {
            return;
        }
        self.told_goals = (refused, limited);
        self.tell_goals_at = now + GOALS_EVERY;
        if more_refused > 0 {
            tracing::warn!(
                "{more_refused} goals were refused: not a number, or for a joint that motor.toml does not have"
            );
        }
        if more_limited > 0 {
            tracing::warn!("{more_limited} goals were beyond the limits of their joints, and were limited");
        }
    }

    /// Logs how many joints wait to be armed, once that number is steady.
    fn tell_disarmed(&mut self, motor: &Motor) {
        let is_disarmed = |state: &JointState| {
            let machines = state.machines();
            machines.is_some_and(|machines| {
                machines.arming == JointArming::Disarmed
                    && machines.link == JointLink::Answering
                    // Those that are armed automatically wait for their turn, on a busy machine for seconds.
                    && !self.policy.as_ref().is_some_and(|policy| policy.arms_after(machines.arming_cause))
            })
        };
        let disarmed = motor.states().filter(is_disarmed).count();
        // With automatic arming, joints are disarmed only for a moment.
        let is_steady = std::mem::replace(&mut self.disarmed, disarmed) == disarmed;
        if is_steady && disarmed > self.told_disarmed {
            tracing::warn!(
                "{} disarmed, and can move once armed with `leo arm` or on the page",
                counted_with(saturating_u32(disarmed), "joint is", "joints are")
            );
        }
        if is_steady {
            self.told_disarmed = disarmed;
        }
    }

    fn tell_joints(
        &mut self,
        states: impl Iterator<Item = JointState>,
        now: Instant,
        trouble: impl Fn(usize) -> Option<JointFault>,
        mut tell: impl FnMut(fmt::Arguments<'_>),
    ) {
        for (known, state) in self.known.iter_mut().zip(states) {
            if let (Some(mode), Some(cause)) = (state.mode(), state.cause()) {
                known.is_new = known.state.replace((mode, cause)) != Some((mode, cause));
            }
        }
        self.take_starved(&trouble);
        if now >= self.tell_starved_at {
            self.tell_starved(now, &mut tell);
        }
        for (number, bus) in self.buses.iter().enumerate() {
            let all = || self.known.iter().filter(|known| known.bus == number);
            let is_new = all().any(|known| known.is_new);
            if let Some(what) = explain_bus(all()).filter(|_| is_new) {
                tell(format_args!("bus `{bus}`: {what}"));
                let of_bus = self.known.iter_mut().filter(|known| known.bus == number);
                of_bus.for_each(|known| known.is_new = false);
            }
        }
        let mut duplicates = ArrayVec::<_, 8>::new();
        for (index, (known, name)) in self.known.iter_mut().zip(&self.names).enumerate() {
            let Some(state) = known.state.filter(|_| known.is_new) else { continue };
            let previous = std::mem::replace(&mut known.trouble, trouble(index));
            match known.trouble {
                // The same fault in another state, for example after its torque went off.
                Some(trouble) if previous == Some(trouble) => {}
                // A duplicate affects the whole bus, and is logged once.
                Some(JointFault::Duplicate(id)) if duplicates.contains(&(known.bus, id)) => {}
                Some(trouble @ JointFault::Duplicate(id)) => {
                    let _told_again_if_full = duplicates.try_push((known.bus, id));
                    let bus = self.buses.get(known.bus).map_or("?", String::as_str);
                    tell(format_args!("bus `{bus}`: {trouble}"));
                }
                Some(trouble) => tell(format_args!("{name}: {trouble}")),
                None => {
                    if let Some(what) = explain(state) {
                        tell(format_args!("{name} {what}"));
                    }
                }
            }
        }
    }

    /// Keeps for one message the joints whose simulated servos have newly missed exchanges for lack of processor time.
    /// They are not logged one by one. If all servos of a bus are silent, their process may have ended or been stopped:
    /// then the message names the bus.
    fn take_starved(&mut self, trouble: impl Fn(usize) -> Option<JointFault>) {
        for number in 0..self.buses.len() {
            if self.is_faultless_mock.get(number) != Some(&true) {
                continue;
            }
            let is_patient = self.is_patient && self.has_hung_up.get(number) != Some(&true);
            let is_whole_bus =
                !is_patient && explain_bus(self.known.iter().filter(|known| known.bus == number)).is_some();
            let of_bus = self.known.iter_mut().enumerate().filter(|(_, known)| known.bus == number);
            for (index, known) in of_bus {
                if is_whole_bus {
                    known.is_starved = false;
                } else if known.is_new && known.has_missed_exchanges(is_patient) && trouble(index).is_none() {
                    known.is_new = false;
                    known.trouble = None;
                    known.is_starved = true;
                }
            }
        }
    }

    /// Logs how many simulated servos have missed exchanges since the last such message, if any.
    fn tell_starved(&mut self, now: Instant, mut tell: impl FnMut(fmt::Arguments<'_>)) {
        let take = |known: &mut Known| usize::from(std::mem::take(&mut known.is_starved));
        let starved: usize = self.known.iter_mut().map(take).sum();
        if starved == 0 {
            return;
        }
        self.tell_starved_at = now + STARVED_EVERY;
        let (servos, their, hold) =
            if starved == 1 { ("servo", "its", "joint holds") } else { ("servos", "their", "joints hold") };
        tell(format_args!(
            "the mock bus was starved of processor time: {starved} simulated {servos} missed {their} exchanges, and \
             {their} {hold} meanwhile. Real-time rights prevent it: see `leo check`"
        ));
    }

    /// Logs once that torque is off after an emergency stop. Returns whether there is an emergency stop.
    fn tell_emergency(&mut self, motor: &Motor) -> bool {
        let is_emergency = motor.letting_go() == Some(JointCause::Emergency);
        if self.is_newly_limp(is_emergency, motor.unconfirmed()) {
            tracing::info!("all {} servos say that their torque is off", self.names.len());
        }
        self.all_follow &= !is_emergency;
        is_emergency
    }

    /// Whether every servo has confirmed torque off for the first time in this emergency. A servo that misses a later
    /// read is unconfirmed again, but that is not logged again.
    fn is_newly_limp(&mut self, is_emergency: bool, unconfirmed: usize) -> bool {
        let is_told = is_emergency && (self.told_limp || unconfirmed == 0);
        let is_new = is_told && !self.told_limp;
        self.told_limp = is_told;
        is_new
    }
}

/// Message about a bus all of whose joints are quarantined for the same reason.
fn explain_bus<'a>(mut joints: impl Iterator<Item = &'a Known>) -> Option<&'static str> {
    let first = joints.next()?.state?;
    let is_one = joints.all(|known| known.state == Some(first));
    match first {
        (JointMode::Quarantined, JointCause::BusLost) if is_one => {
            Some("its serial line is lost: all of its joints are quarantined")
        }
        (JointMode::Quarantined, JointCause::Silent) if is_one => Some(
            "none of its servos answers: all of its joints are quarantined. Check its power, its cable and the baud \
             rate of its servos (`leo bus scan --all-speeds`). If they are right, this machine is too busy for the \
             serial line: see `leo check`",
        ),
        _ => None,
    }
}

/// Message about a joint with a fault.
const fn explain(state: (JointMode, JointCause)) -> Option<&'static str> {
    match state {
        (JointMode::Quarantined, JointCause::BusLost) => Some("is quarantined: its bus is lost"),
        (JointMode::Quarantined, JointCause::Alert) => {
            Some("is quarantined while its servo reboots after a hardware alert. Its group holds meanwhile")
        }
        (JointMode::Quarantined, _) => {
            Some("is quarantined: its servo does not answer; is it powered, and on this bus with this id?")
        }
        (JointMode::Starting, JointCause::Restarted) => Some(
            "is brought up again: its servo restarted by itself. Check its power supply. Its group holds meanwhile",
        ),
        (JointMode::Starting, JointCause::Watchdog) => {
            Some("is armed again: the servo's own bus watchdog had tripped")
        }
        (JointMode::Lowering, JointCause::Alert) => {
            Some("is lowered to its rest pose after a hardware alert, and then its torque is switched off")
        }
        (JointMode::Following, JointCause::Derated) => {
            Some("moves more slowly: its servo is hot or its voltage is low")
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_off_is_logged_once_in_an_emergency() {
        let mut reporter = Reporter::new(&Robot::load(None).unwrap(), true);
        let steps =
            [(false, 65), (true, 65), (true, 0), (true, 1), (true, 0), (false, 65), (true, 2), (true, 0)];
        let told = steps.map(|(is_emergency, unconfirmed)| reporter.is_newly_limp(is_emergency, unconfirmed));
        assert_eq!(told, [false, false, true, false, false, false, false, true]);
    }

    #[test]
    fn a_rebooting_servo_is_not_reported_as_silent() {
        let told = |cause| explain((JointMode::Quarantined, cause)).unwrap();
        assert!(told(JointCause::Silent).contains("does not answer"));
        assert!(told(JointCause::Alert).contains("reboots"), "{}", told(JointCause::Alert));
    }

    #[test]
    fn a_fault_is_logged_once_and_not_again_at_torque_off() {
        let mut reporter = Reporter::new(&Robot::load(None).unwrap(), true);
        let mut told = 0;
        let mut update = |mode, trouble: Option<JointFault>| {
            let state = std::iter::once(JointState::unread(0, mode, JointCause::DuplicateId));
            reporter.tell_joints(
                state,
                Instant::EPOCH,
                |index| trouble.filter(|_| index == 0),
                |_| told += 1,
            );
        };
        update(JointMode::Following, None);
        update(JointMode::Releasing, Some(JointFault::Duplicate(7)));
        update(JointMode::Limp, Some(JointFault::Duplicate(7)));
        // It was repaired, and fails again.
        update(JointMode::Following, None);
        update(JointMode::Releasing, Some(JointFault::Duplicate(7)));
        assert_eq!(told, 2);
    }

    #[test]
    fn a_lost_bus_is_logged_once_and_a_single_servo_by_name() {
        let robot = Robot::load(None).unwrap();
        let mut reporter = Reporter::new(&robot, true);
        let bus_of = |index: usize| robot.motor.joints[index].bus;
        let mut update = |is_away: &dyn Fn(usize) -> Option<JointCause>| {
            let state = |index| match is_away(index) {
                Some(cause) => JointState::unread(0, JointMode::Quarantined, cause),
                None => JointState::unread(0, JointMode::Following, JointCause::None),
            };
            let mut told = Vec::new();
            let states = (0..robot.motor.joints.len()).map(state);
            reporter.tell_joints(states, Instant::EPOCH, |_| None, |line| told.push(line.to_string()));
            told
        };
        let silent = |is_away: bool| is_away.then_some(JointCause::Silent);
        assert!(update(&|_| None).is_empty());
        let one = update(&|index| silent(index == 0));
        assert!(one.len() == 1 && one[0].starts_with("torso_yaw_joint is quarantined"), "{one:?}");
        // The others of its bus too: now the bus is named.
        let all = update(&|index| silent(bus_of(index) == bus_of(0)));
        let bus = &robot.motor.buses[bus_of(0)].name;
        assert!(all.len() == 1 && all[0].starts_with(&format!("bus `{bus}`: none of its servos")), "{all:?}");
        assert!(update(&|index| silent(bus_of(index) == bus_of(0))).is_empty(), "once");
        let every = update(&|_| Some(JointCause::BusLost));
        assert_eq!(every.len(), robot.motor.buses.len(), "{every:?}");
        // All but one are back.
        assert!(update(&|index| (index == 0).then_some(JointCause::BusLost)).is_empty());
        assert!(update(&|_| None).is_empty());
    }

    #[test]
    fn a_starved_mock_bus_is_logged_once_for_all_its_servos() {
        let robot = Robot::load(None).unwrap();
        let on_hardware = robot.motor.joints[0].bus;
        let mut hardware = robot.clone();
        hardware.motor.buses[on_hardware].device = Device::Tty("/dev/ttyUSB0".into());
        let silent = (JointMode::Quarantined, JointCause::Silent);
        let (tripped, fine) =
            ((JointMode::Starting, JointCause::Watchdog), (JointMode::Following, JointCause::None));
        // No bus is silent as a whole: the last joint of each answers.
        let last_of_bus = |index: usize| {
            let bus_of = |joint: &config::motor::Joint| joint.bus == robot.motor.joints[index].bus;
            robot.motor.joints.iter().rposition(bus_of) == Some(index)
        };
        let away: Vec<usize> = (0..robot.motor.joints.len()).filter(|index| !last_of_bus(*index)).collect();
        let told = |robot: &Robot, has_campaign| {
            let mut reporter = Reporter::new(robot, has_campaign);
            let mut told = Vec::new();
            // Twenty joints at two times, all back between, one in the time without messages, and all back.
            for (second, joints, state) in [
                (0, 10, silent),
                (1, 20, silent),
                (2, 0, fine),
                (3, 20, tripped),
                (4, 0, fine),
                (5, 21, silent),
                (59, 0, fine),
                (61, 0, fine),
                (200, 0, fine),
                (201, 1, silent),
            ] {
                let states = (0..robot.motor.joints.len()).map(|index| {
                    let (mode, cause) = if away[..joints].contains(&index) { state } else { fine };
                    JointState::unread(0, mode, cause)
                });
                let now = Instant::EPOCH + Duration::from_secs(second);
                reporter.tell_joints(states, now, |_| None, |line| told.push(line.to_string()));
            }
            told
        };
        let starved = told(&robot, false);
        assert!(starved.len() == 3 && starved.iter().all(|line| line.contains("starved")), "{starved:?}");
        // What happens in the time without messages is told after it.
        for (line, count) in
            starved.iter().zip(["10 simulated servos", "21 simulated servos", "1 simulated servo "])
        {
            assert!(line.contains(count), "{line}");
        }
        // Injected faults, and real servos, are logged by their names as ever.
        let injected = told(&robot, true);
        assert!(injected.len() > 20 && !injected.iter().any(|line| line.contains("starved")), "{injected:?}");
        let mixed = told(&hardware, false);
        let name = &robot.motor.joints[0].name;
        let by_name = mixed.iter().any(|line| line.starts_with(&format!("{name} is quarantined")));
        assert!(by_name && mixed.iter().any(|line| line.contains("starved")), "{mixed:?}");
        insta::assert_snapshot!(starved[0]);
    }

    #[test]
    fn without_priority_a_lost_mock_bus_is_starved_unless_it_hung_up() {
        let robot = Robot::load(None).unwrap();
        let told = |hung_up: bool| {
            let mut reporter = Reporter::new(&robot, false).with_patience(true);
            reporter.has_hung_up.fill(hung_up);
            let mut told = Vec::new();
            let lost = |index| JointState::unread(index, JointMode::Quarantined, JointCause::BusLost);
            let states = (0..).take(robot.motor.joints.len()).map(lost);
            reporter.tell_joints(states, Instant::EPOCH, |_| None, |line| told.push(line.to_string()));
            told
        };
        let starved = told(false);
        assert!(starved.len() == 1 && starved[0].contains("65 simulated servos"), "{starved:?}");
        let ended = told(true);
        assert_eq!(ended.len(), robot.motor.buses.len(), "{ended:?}");
        assert!(ended.iter().all(|line| line.contains("its serial line is lost")), "{ended:?}");
    }

    #[test]
    fn a_wholly_silent_mock_bus_is_named_and_not_called_starved() {
        let robot = Robot::load(None).unwrap();
        let mut reporter = Reporter::new(&robot, false);
        let mut told = Vec::new();
        // Some at first, in the time without messages about starvation, and then all.
        reporter.tell_starved_at = Instant::EPOCH + Duration::from_secs(2);
        for (second, away) in [(0, 5), (1, usize::MAX), (2, usize::MAX), (3, usize::MAX)] {
            let states = (0..robot.motor.joints.len()).map(|index| {
                let is_away = index < away;
                let mode = if is_away { JointMode::Quarantined } else { JointMode::Following };
                JointState::unread(0, mode, if is_away { JointCause::Silent } else { JointCause::None })
            });
            let now = Instant::EPOCH + Duration::from_secs(second);
            reporter.tell_joints(states, now, |_| None, |line| told.push(line.to_string()));
        }
        assert_eq!(told.len(), robot.motor.buses.len(), "{told:?}");
        assert!(told.iter().all(|line| line.contains("none of its servos answers")), "{told:?}");
    }
}
