//! Groups joints by arming state and cause, and describes the causes and their remedies.

use crate::{JointArming, JointCause, JointLink, JointPower, JointState};

/// Joints with the same arming state and cause.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ArmingGroup {
    /// The cause.
    pub cause: JointCause,
    /// The joints: their indices in the robot's configuration.
    pub joints: Vec<u32>,
}

/// The joints of a robot by arming state, and within it by cause.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ArmingSummary {
    /// Number of armed joints.
    pub armed: usize,
    /// The disarmed joints. A joint with an invalid state counts as disarmed.
    pub disarmed: Vec<ArmingGroup>,
    /// The locked joints.
    pub locked: Vec<ArmingGroup>,
}

impl ArmingSummary {
    /// Groups joints by arming state and cause.
    #[must_use]
    pub fn of(states: &[JointState]) -> Self {
        let mut summary = Self::default();
        for state in states {
            let (arming, cause) =
                state.machines().map_or((JointArming::Disarmed, JointCause::NotStarted), |machines| {
                    (machines.arming, machines.arming_cause)
                });
            let groups = match arming {
                JointArming::Armed => {
                    summary.armed += 1;
                    continue;
                }
                JointArming::Disarmed => &mut summary.disarmed,
                JointArming::Locked => &mut summary.locked,
            };
            match groups.iter_mut().find(|group| group.cause == cause) {
                Some(group) => group.joints.push(state.joint),
                None => groups.push(ArmingGroup { cause, joints: vec![state.joint] }),
            }
        }
        // The most frequent cause first.
        for groups in [&mut summary.disarmed, &mut summary.locked] {
            groups.sort_by_key(|group| (usize::MAX - group.joints.len(), group.cause));
        }
        summary
    }

    /// Number of disarmed joints.
    #[must_use]
    pub fn disarmed_joints(&self) -> usize {
        self.disarmed.iter().map(|group| group.joints.len()).sum()
    }

    /// Number of locked joints.
    #[must_use]
    pub fn locked_joints(&self) -> usize {
        self.locked.iter().map(|group| group.joints.len()).sum()
    }

    /// Whether there are joints, and all are armed.
    #[must_use]
    pub fn is_all_armed(&self) -> bool {
        self.armed > 0 && self.disarmed.is_empty() && self.locked.is_empty()
    }

    /// One-line summary: `3 locked: blocked; 62 armed`. Empty if there are no joints.
    #[must_use]
    pub fn line(&self) -> String {
        let causes = |groups: &[ArmingGroup]| {
            groups.iter().map(|group| group.cause.name()).collect::<Vec<_>>().join(", ")
        };
        let mut parts = Vec::new();
        for (word, count, groups) in [
            ("locked", self.locked_joints(), &self.locked),
            ("disarmed", self.disarmed_joints(), &self.disarmed),
        ] {
            if count > 0 {
                parts.push(format!("{count} {word}: {}", causes(groups)));
            }
        }
        if self.armed > 0 {
            parts.push(format!("{} armed", self.armed));
        }
        parts.join("; ")
    }
}

impl JointCause {
    /// What this cause of a locked or disarmed joint means, as a sentence without its full stop.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::None => "no cause is given",
            Self::NotStarted => "the motor process started",
            Self::CommandTimeout => "no goals came, and the torque went off",
            Self::Silent => "the servo does not answer, or did not answer",
            Self::Alert => "the servo reported a hardware alert",
            Self::Watchdog => "the servo's bus watchdog tripped: no request reached the servo in time",
            Self::BusLost => "the serial line of its bus was lost",
            Self::Stopped => "the joint was stopped by order",
            Self::Refused => "the servo refused an instruction, or is not the configured model",
            Self::GroupStopped => "another joint failed, of its group or of one that carries it",
            Self::BodyStopped => "a bus was lost, and the whole body stopped",
            Self::Emergency => "the emergency stop was raised",
            Self::Restarted => "the servo restarted: its power or its firmware failed for a moment",
            Self::DuplicateId => "two servos answer to its identifier",
            Self::Derated => "the servo is hot or short of voltage",
            Self::Stale => "the servo's clock does not advance, so its answers may be old",
            Self::Blocked => {
                "the joint did not follow its command: something held it, or its servo is too weak"
            }
            Self::BeyondLimits => {
                "the joint stands far beyond its limits: a slipped horn, a wrong offset or a swapped servo"
            }
        }
    }

    /// What the operator should do about this cause before arming, as a sentence without its full stop.
    #[must_use]
    pub const fn remedy(self) -> &'static str {
        match self {
            Self::None | Self::NotStarted | Self::Stopped => "make sure that nobody is in reach, then arm",
            Self::CommandTimeout => "start the process that sends goals, then arm",
            Self::Silent => "check the power and the cable of the servo, then arm",
            Self::Alert => {
                "read the alert with `leo bus read JOINT hardware_error_status` and remove its reason; \
                 `leo bus reboot JOINT` clears it"
            }
            Self::Watchdog => {
                "check the cable, and with `leo top` whether the motor process overruns, then arm"
            }
            Self::BusLost | Self::BodyStopped => {
                "check the adapter, its cable and the power of the bus, then arm"
            }
            Self::Refused => {
                "read the refusal in the log of the motor process, and compare the servo with motor.toml"
            }
            Self::GroupStopped => "remove the failure of that joint first; `leo top`, key j, names it",
            Self::Emergency => "make sure that nobody is in reach, release the stop, then arm",
            Self::Restarted => "check the power supply and the connector of the servo, then arm",
            Self::DuplicateId => {
                "give one of the two servos another identifier; `leo bus scan` shows which answer"
            }
            Self::Derated => "let the servo cool down, or check the supply, then arm",
            Self::Stale => {
                "restart the servo with `leo bus reboot JOINT`, and exchange it where that does not help"
            }
            Self::Blocked => {
                "remove what held the joint, and check that nothing limits its servo: \
                 `leo bus read JOINT goal_pwm profile_velocity`"
            }
            Self::BeyondLimits => {
                "check the horn, the offset and the identifier of the servo, and move the joint back by hand"
            }
        }
    }
}

impl JointState {
    /// Whether the operator should check the joint: it is locked, its servo does not reply correctly, or its mode is
    /// not normal. A joint that only waits for arming is fine, and so is one that [is stopped](Self::is_stopped).
    #[must_use]
    pub fn is_in_trouble(&self) -> bool {
        let is_waiting = matches!(self.cause(), Some(JointCause::None | JointCause::NotStarted));
        !(is_waiting || self.is_stopped()) || self.is_failing()
    }

    /// Whether the end of the run or an emergency stop took the joint's torque, and its servo has confirmed that.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        let is_off = self.machines().is_some_and(|machines| machines.power == JointPower::Off);
        let is_ordered = matches!(self.cause(), Some(JointCause::Stopped | JointCause::Emergency));
        is_ordered && is_off && !self.is_failing()
    }

    fn is_failing(&self) -> bool {
        self.machines().is_none_or(|machines| {
            machines.arming == JointArming::Locked
                || matches!(machines.link, JointLink::Silent | JointLink::Corrupt)
        })
    }

    /// Age of its servo's last reading in seconds; `None` if it was never read.
    #[must_use]
    pub fn reading_age_s(&self, now_ns: u64) -> Option<f64> {
        if self.sampled_at_ns == 0 {
            return None;
        }
        Some(std::time::Duration::from_nanos(now_ns.saturating_sub(self.sampled_at_ns)).as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{JointMachines, JointMode, JointMotion};

    fn joint(index: u32, arming: JointArming, arming_cause: JointCause) -> JointState {
        JointState::unread(index, JointMode::Limp, JointCause::NotStarted).with_machines(JointMachines {
            link: JointLink::Answering,
            power: JointPower::Off,
            arming,
            arming_cause,
            motion: JointMotion::Idle,
        })
    }

    #[test]
    fn joints_are_grouped_by_arming_state_and_sorted_by_frequency() {
        let states = [
            joint(0, JointArming::Armed, JointCause::None),
            joint(1, JointArming::Disarmed, JointCause::Silent),
            joint(2, JointArming::Disarmed, JointCause::NotStarted),
            joint(3, JointArming::Disarmed, JointCause::NotStarted),
            joint(4, JointArming::Locked, JointCause::Blocked),
        ];
        let summary = ArmingSummary::of(&states);
        assert_eq!(summary.line(), "1 locked: blocked; 3 disarmed: not-started, silent; 1 armed");
        assert_eq!(summary.disarmed[0].joints, [2, 3]);
        assert!(!summary.is_all_armed() && ArmingSummary::of(&states[..1]).is_all_armed());
        assert!(!ArmingSummary::of(&[]).is_all_armed(), "no joint is armed where there is none");
        assert_eq!(ArmingSummary::of(&[]).line(), "");
    }

    #[test]
    fn every_cause_has_a_meaning_and_a_remedy_of_its_own_words() {
        for cause in JointCause::ALL {
            for said in [cause.meaning(), cause.remedy()] {
                assert!(said.len() > 10 && !said.ends_with('.') && said.len() < 140, "{cause:?}: {said}");
            }
        }
    }

    #[test]
    fn a_joint_that_waits_for_arming_is_not_in_trouble() {
        assert!(!joint(0, JointArming::Disarmed, JointCause::NotStarted).is_in_trouble());
        assert!(joint(0, JointArming::Locked, JointCause::Blocked).is_in_trouble());
        let silent = JointState::unread(0, JointMode::Quarantined, JointCause::Silent);
        assert!(silent.is_in_trouble());
    }

    #[test]
    fn a_stopped_joint_is_in_trouble_until_its_torque_is_off() {
        let stopped = |cause, power, link, arming| {
            JointState::unread(0, JointMode::Limp, cause).with_machines(JointMachines {
                link,
                power,
                arming,
                arming_cause: JointCause::Emergency,
                motion: JointMotion::Idle,
            })
        };
        let (answering, disarmed) = (JointLink::Answering, JointArming::Disarmed);
        for cause in [JointCause::Stopped, JointCause::Emergency] {
            let off = stopped(cause, JointPower::Off, answering, disarmed);
            assert!(off.is_stopped() && !off.is_in_trouble(), "{cause:?}");
            for not_off in [
                stopped(cause, JointPower::SwitchingOff, answering, disarmed),
                stopped(cause, JointPower::Off, JointLink::Silent, disarmed),
                stopped(cause, JointPower::Off, answering, JointArming::Locked),
            ] {
                assert!(!not_off.is_stopped() && not_off.is_in_trouble(), "{not_off:?}");
            }
        }
        assert!(!stopped(JointCause::Blocked, JointPower::Off, answering, disarmed).is_stopped());
    }

    #[test]
    fn a_reading_has_an_age_and_an_unread_joint_has_none() {
        let unread = JointState::unread(0, JointMode::Limp, JointCause::NotStarted);
        assert_eq!(unread.reading_age_s(5), None);
        let read = unread.with_reading(1_000_000_000, 0.0, 0.0, 0.0);
        assert_eq!(read.reading_age_s(1_300_000_000), Some(0.3));
        assert_eq!(read.reading_age_s(1), Some(0.0), "a reading is never from the future");
    }
}
