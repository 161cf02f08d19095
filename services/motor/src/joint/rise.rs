//! Selects the next instruction to a joint's servo: setup, torque on, torque off.

use clock::{Duration, Instant};
use invariant::{invariant, require};
use message::JointCause;
use servo::{Motion as Setpoint, acceleration_count, position_count};

use super::answers::TRUST_DELAY;
use super::steer::{ACCELERATION_MARGIN, LOW_ACCELERATION_RAD_S2, velocity};
use super::{
    ArmingState, CONDITION_PERIOD, Joint, Link, Motion, Power, PowerUpStep, REBOOT_WAIT, RefusedPwm, Setup,
    Watchdog,
};
use crate::JointFault;
use crate::duplicate_id_check::ProbeResult;
use crate::job::{self, Job, ServoLimits};
use crate::notice::MAX_NOTICES;

/// Value of goal PWM at a duty of 100 % (items 36 and 100).
const FULL_DUTY: u16 = 885;
/// A servo that still moves this long after it was told to stay has missed part of it, and is told again.
const STANDS_AFTER: Duration = Duration::from_millis(200);

impl Joint {
    /// Next job for its servo, if any.
    pub(crate) fn job(&mut self, now: Instant, may_arm: bool) -> Option<Job> {
        let is_cutting = matches!(self.power, Power::Cutting { .. });
        if !is_cutting && self.reboot_at.is_some_and(|at| now >= at) {
            return Some(self.reboot(now));
        }
        match self.link {
            Link::Silent { ask_at, .. } => return (now >= ask_at).then(|| self.call()),
            Link::Corrupt(duplicate_id_check) => {
                return Some(Job::DuplicateIdCheck { alike: duplicate_id_check.asks_alike() });
            }
            Link::Unknown | Link::Identified(_) | Link::Answering => {}
        }
        if let Power::Cutting { tell_at } = self.power {
            return (now >= tell_at).then_some(Job::Torque(false));
        }
        match self.link {
            // A servo of another model, for example, is left alone until an operator has acknowledged that.
            Link::Unknown if self.arming.is_locked() && matches!(self.power, Power::Off) => None,
            Link::Unknown => Some(Job::Ping),
            Link::Identified(Setup::Inspect) => Some(Job::Inspect),
            // The operator is informed about an overwritten item before it is written.
            Link::Identified(Setup::Unlock | Setup::Mode | Setup::Limits) if !self.notices.is_empty() => None,
            Link::Identified(Setup::Unlock) => Some(Job::Torque(false)),
            Link::Identified(Setup::Mode) => Some(Job::SetMode),
            Link::Identified(Setup::Limits) => {
                let (min, max) = self.limit_counts();
                Some(Job::SetLimits { min, max })
            }
            Link::Answering | Link::Silent { .. } | Link::Corrupt(_) => self.power_job(now, may_arm),
        }
    }

    /// Next job for a servo that is set up.
    fn power_job(&mut self, now: Instant, may_arm: bool) -> Option<Job> {
        if may_arm && self.arming.is_given() && !self.is_unproven() {
            self.begin_power_up();
        }
        match self.power {
            Power::Unknown { .. } => {
                self.link = Link::Identified(Setup::Inspect);
                Some(Job::Inspect)
            }
            Power::Found { watchdog: Watchdog::Unset, .. } => Some(Job::ArmWatchdog { clear: false }),
            Power::Found { watchdog: Watchdog::Tripped, .. } => Some(Job::ArmWatchdog { clear: true }),
            // The servo may still move towards a goal of an earlier process.
            Power::Found { stay, .. } => self.stay_job(now, stay, self.comes_back()),
            Power::Rising { step: PowerUpStep::ArmWatchdog, is_tripped, .. } => {
                Some(Job::ArmWatchdog { clear: is_tripped })
            }
            Power::Rising { step: PowerUpStep::WriteGoal, is_on, .. } => self.aim(now, is_on),
            Power::Rising { step: PowerUpStep::Torque, is_tripped, .. } => {
                // If the answer is lost, torque may be on.
                self.power = Power::Rising { step: PowerUpStep::Torque, is_on: true, is_tripped };
                Some(Job::Torque(true))
            }
            Power::On { .. } => self.motion_job(now),
            Power::Off | Power::Cutting { .. } => None,
        }
    }

    /// Begins to switch torque on, if that has not begun.
    const fn begin_power_up(&mut self) {
        let (is_on, watchdog) = match self.power {
            Power::Off => (false, Watchdog::Unset),
            Power::Found { watchdog, .. } => (true, watchdog),
            Power::Unknown { .. } | Power::Rising { .. } | Power::On { .. } | Power::Cutting { .. } => return,
        };
        let step = if matches!(watchdog, Watchdog::Armed) {
            PowerUpStep::WriteGoal
        } else {
            PowerUpStep::ArmWatchdog
        };
        self.power = Power::Rising { step, is_on, is_tripped: matches!(watchdog, Watchdog::Tripped) };
    }

    /// Job that writes the profile of the soft start, and the present position as the goal.
    fn aim(&self, now: Instant, is_on: bool) -> Option<Job> {
        let stands_rad = self.standing(now)?;
        let slow_rad_s = self.policy.settings.soft_start_rad_s.get().min(self.velocity_rad_s());
        let (acceleration, velocity) = (acceleration(LOW_ACCELERATION_RAD_S2), velocity(slow_rad_s));
        if is_on && self.is_far_from(stands_rad) {
            // With its limit as the goal the servo would move before its joint is commanded to.
            return Some(Job::Profile([acceleration, velocity]));
        }
        let goal = position_count(self.settings.servo_rad(stands_rad));
        Some(Job::WriteGoal([acceleration, velocity, goal]))
    }

    fn motion_job(&mut self, now: Instant) -> Option<Job> {
        if self.refused_pwm == RefusedPwm::Unexplained {
            return Some(self.read_condition(now));
        }
        if let Some(pwm) = self.duty_to_tell(now) {
            return Some(Job::GoalPwm(pwm));
        }
        self.refused_pwm = RefusedPwm::No;
        if let Motion::Stay { ordered } = self.motion {
            return self.stay_job(now, ordered, true);
        }
        let has_begun = matches!(self.motion, Motion::Soft { until, .. } if now >= until);
        let acceleration = acceleration(self.settings.max_acceleration_rad_s2 * ACCELERATION_MARGIN);
        (has_begun && !self.has_full_acceleration())
            .then(|| Job::Profile([acceleration, velocity(self.velocity_rad_s())]))
    }

    /// New value of goal PWM, if it has to change: limited while the joint is far behind its setpoint.
    ///
    /// A profile limits the speed of the servo's own trajectory, but not how fast the shaft catches up with it. With
    /// a limited PWM a joint that is held presses with less force, and does not exceed its speed limit once released.
    fn duty_to_tell(&self, now: Instant) -> Option<u16> {
        let (Power::On { is_pwm_limited, .. }, Some(bounds)) = (self.power, self.bounds) else { return None };
        let is_behind = self.is_far_behind(now, is_pwm_limited);
        (is_behind != is_pwm_limited).then(|| if is_behind { self.bounded_duty(bounds) } else { bounds.pwm })
    }

    /// The PWM at which the servo without load turns no faster than its joint may.
    fn bounded_duty(&self, bounds: ServoLimits) -> u16 {
        let no_load_rad_s =
            servo::velocity_rad_s(i32::try_from(self.settings.model.velocity_limit()).unwrap_or(i32::MAX));
        let share = (self.velocity_rad_s() / no_load_rad_s).clamp(0.0, 1.0);
        let pwm = quantity::number::round_i64(f64::from(FULL_DUTY) * share);
        let pwm = require!(u16::try_from(pwm).ok(), "a share of the duty is {pwm}").unwrap_or(1);
        pwm.clamp(1, bounds.pwm.max(1))
    }

    /// Tells a servo to stay where it is, and repeats that if the servo does not stand in time.
    fn stay_job(&self, now: Instant, ordered: Option<(Instant, f64)>, shall_stay: bool) -> Option<Job> {
        let goes_on = |(ordered_at, _)| now >= ordered_at + STANDS_AFTER && !self.stays();
        ordered.map_or(shall_stay, goes_on).then_some(Job::Stay)
    }

    /// Since when a condition read has been due, if it is.
    pub(crate) fn condition_read_due_since(&self, now: Instant) -> Option<Instant> {
        (self.is_read() && now >= self.condition_due_at).then_some(self.condition_due_at)
    }

    /// Job that reads the condition, and schedules the next one.
    pub(crate) fn read_condition(&mut self, now: Instant) -> Job {
        self.condition_due_at = now + CONDITION_PERIOD;
        Job::ReadCondition
    }

    /// Advances the state machines after a job was done.
    pub(super) fn advance(&mut self, now: Instant, job: Job, answer: &[u8]) {
        match (self.link, self.power, job) {
            (Link::Unknown | Link::Silent { .. }, _, Job::Ping | Job::TorqueOff) => {
                self.identified(now, answer);
            }
            (Link::Identified(Setup::Inspect), _, Job::Inspect) if !job::answers_all(answer) => {
                // The servo did not take over the status return level.
                self.contact.unacknowledged += 1;
                self.missed(now, false);
            }
            (Link::Identified(Setup::Inspect), _, Job::Inspect) => self.inspected(now, answer),
            (_, Power::Cutting { .. }, Job::Torque(false)) => self.power = Power::Off,
            (Link::Identified(Setup::Unlock), _, Job::Torque(false)) => {
                self.power = Power::Off;
                self.link = Link::Identified(Setup::Mode);
            }
            (Link::Identified(Setup::Mode), _, Job::SetMode) => self.link = Link::Identified(Setup::Limits),
            (Link::Identified(Setup::Limits), _, Job::SetLimits { .. }) => self.link = Link::Answering,
            (_, Power::Found { stay, .. }, Job::ArmWatchdog { .. }) => {
                self.power = Power::Found { watchdog: Watchdog::Armed, stay };
            }
            (_, Power::Found { watchdog, .. }, Job::Stay) => {
                self.power = Power::Found { watchdog, stay: self.stood(now) };
            }
            (_, Power::Rising { step: PowerUpStep::ArmWatchdog, is_on, .. }, Job::ArmWatchdog { .. }) => {
                self.power = Power::Rising { step: PowerUpStep::WriteGoal, is_on, is_tripped: false };
            }
            (
                _,
                Power::Rising { step: PowerUpStep::WriteGoal, is_on, is_tripped },
                Job::WriteGoal(_) | Job::Profile(_),
            ) => {
                self.power = Power::Rising { step: PowerUpStep::Torque, is_on, is_tripped };
            }
            (_, Power::Rising { step: PowerUpStep::Torque, .. }, Job::Torque(true)) => self.risen(now),
            (_, Power::On { goal_rad, is_pwm_limited, .. }, Job::Profile(_)) => {
                self.power = Power::On { goal_rad, has_full_acceleration: true, is_pwm_limited };
                // The job has written another velocity.
                self.sent_velocity = None;
            }
            (_, Power::On { goal_rad, has_full_acceleration, .. }, Job::GoalPwm(pwm)) => {
                let is_pwm_limited = self.bounds.is_some_and(|bounds| pwm < bounds.pwm);
                self.power = Power::On { goal_rad, has_full_acceleration, is_pwm_limited };
                self.refused_pwm = RefusedPwm::No;
            }
            (_, Power::On { .. }, Job::Stay) if matches!(self.motion, Motion::Stay { .. }) => {
                self.motion = Motion::Stay { ordered: self.stood(now) };
            }
            (_, _, Job::ReadCondition) => self.process_condition(now, answer),
            // The answer belongs to a state that has passed.
            _ => {}
        }
    }

    fn stood(&self, now: Instant) -> Option<(Instant, f64)> {
        self.reading.map(|(_, reading)| (now, reading.position_rad))
    }

    /// Processes the result of one probe for a duplicate identifier. Returns whether a duplicate is certain now.
    pub(crate) fn process_probe(&mut self, now: Instant, came: ProbeResult) -> bool {
        let Link::Corrupt(mut duplicate_id_check) = self.link else { return false };
        let verdict = duplicate_id_check.note(came);
        self.link = Link::Corrupt(duplicate_id_check);
        if verdict == Some(false) {
            self.quarantine(now, JointCause::Silent);
        }
        verdict == Some(true)
    }

    /// Pings a silent servo. If its torque must be off, the job also writes torque off: a servo that does not answer
    /// may still receive.
    fn call(&mut self) -> Job {
        let is_cutting = matches!(self.power, Power::Cutting { .. });
        if !(is_cutting || (self.body_state.limp && self.power.may_be_on())) {
            return Job::Ping;
        }
        if !is_cutting {
            // If it comes back without torque, this was not a restart.
            self.power = Power::Unknown { was_on: false };
            self.disarm(JointCause::CommandTimeout);
        }
        Job::TorqueOff
    }

    fn identified(&mut self, now: Instant, answer: &[u8]) {
        let expected = self.settings.model.number();
        let Some(&[low, high, firmware]) = require!(answer.first_chunk(), "{} bytes of a ping", answer.len())
        else {
            return;
        };
        let found = u16::from_le_bytes([low, high]);
        if found == expected {
            self.contact.is_fast = self.settings.model.supports_fast_reads(firmware);
            self.link = Link::Identified(Setup::Inspect);
        } else {
            self.link = Link::Unknown;
            self.fail(now, JointCause::Refused, JointFault::Model { expected, found });
        }
    }

    /// Processes the answer to the inspection.
    fn inspected(&mut self, now: Instant, setup: &[u8]) {
        if !invariant!(job::is_whole(setup), "{} bytes of a setup", setup.len()) {
            return;
        }
        let (min, max) = self.limit_counts();
        let has_torque = job::has_torque(setup);
        let was_on = matches!(self.power, Power::Unknown { was_on: true });
        let is_cutting = matches!(self.power, Power::Cutting { .. });
        self.bounds = ServoLimits::parse(setup);
        self.limits_found = job::position_limits(setup);
        self.clock.forget();
        self.contact.trusted_at = self.contact.trusted_at.map(|_| now + TRUST_DELAY);
        self.link = Link::Answering;
        if was_on && !has_torque {
            // It was not only silent: its group holds until it is back.
            self.fault_counters.restarts += 1;
            self.disarm(JointCause::Restarted);
        }
        self.power = match has_torque {
            false => Power::Off,
            true if is_cutting => Power::Cutting { tell_at: now },
            true => Power::Found { watchdog: job::watchdog(setup), stay: None },
        };
        // Those of an earlier inspection are found again: nothing is written before they were reported.
        self.notices.clear();
        for notice in job::notices(self.settings.model, setup, (min, max), self.settings.max_velocity_rad_s) {
            let is_added = self.notices.try_push(notice).is_ok();
            invariant!(is_added, "an inspection has at most {MAX_NOTICES} notices");
        }
        if let Some(trouble) = job::foreign(self.settings.model, self.contact.is_fast, setup) {
            return self.fail(now, JointCause::Refused, trouble);
        }
        if let Some(trouble) = job::powerless(setup) {
            return self.fail(now, JointCause::Refused, trouble);
        }
        if !job::is_configured(setup, min, max) && !self.arming.is_locked() {
            self.link = Link::Identified(Setup::Unlock);
        }
    }

    /// Position limits that its servo was found with, in counts, if they are neither its own nor those from the
    /// factory.
    pub(crate) fn foreign_limits(&self) -> Option<(i32, i32)> {
        let is_fresh = matches!(self.link, Link::Identified(Setup::Unlock)) && !self.are_limits_acknowledged;
        let is_foreign =
            |limits: &(i32, i32)| *limits != self.limit_counts() && *limits != job::FACTORY_LIMITS;
        self.limits_found.filter(|limits| is_fresh && is_foreign(limits))
    }

    /// Locks the joint because its servo has the limits of joint `other`. Nothing is written to the servo before an
    /// operator has acknowledged that.
    pub(crate) fn refuse_as_other(&mut self, now: Instant, other: usize) {
        self.notices.clear();
        self.link = Link::Answering;
        self.fail(now, JointCause::Refused, JointFault::OtherJoint(other + 1));
    }

    /// Torque is on.
    fn risen(&mut self, now: Instant) {
        // The motion begins at the present position, which may have changed since the goal was written.
        let Some(goal_rad) = self.standing(now) else { return };
        // An earlier process may have left its PWM limited.
        let is_pwm_limited = self.bounds.is_some_and(|bounds| bounds.goal_duty < bounds.pwm);
        self.power = Power::On { goal_rad, has_full_acceleration: false, is_pwm_limited };
        self.refused_goals = 0;
        self.motion = Motion::Idle;
        if self.arming.is_given() && self.is_far_from(goal_rad) {
            self.motion = Motion::Align { to_rad: goal_rad };
        } else if self.arming.is_given() {
            self.begin_soft(now, Setpoint::at(goal_rad));
        }
    }

    /// Reboots its servo and assumes success, without a retry. If the instruction was lost, the next inspection
    /// reports the alert again. A servo whose answer was lost must not be rebooted twice.
    fn reboot(&mut self, now: Instant) -> Job {
        self.reboots += 1;
        (self.trouble, self.reaction, self.reboot_at) = (None, None, None);
        self.arming = ArmingState::Disarmed { cause: JointCause::Alert };
        self.power = Power::Unknown { was_on: false };
        self.motion = Motion::Idle;
        self.clock.forget();
        self.link = Link::Silent { ask_at: now + REBOOT_WAIT, cause: JointCause::Alert };
        Job::Reboot
    }
}

/// A profile acceleration in counts, at least 1: zero would mean unlimited.
fn acceleration(rad_s2: f64) -> i32 {
    acceleration_count(rad_s2).clamp(1, 32_767)
}
