//! How a joint processes the answers of its servo, and missing answers.

use clock::{Duration, Instant};
use config::leo::{AlertReaction, OnAlert};
use message::JointCause;
use servo::{Fault, HardwareErrors, Id, Reading, Status};

use super::{
    ArmingState, Disarming, Joint, Link, MIN_WAIT, Motion, Power, PowerUpStep, RefusedPwm, Setup, Taken,
    Watchdog,
};
use crate::JointFault;
use crate::duplicate_id_check::DuplicateIdCheck;
use crate::job::{Condition, Job, Supply};
use crate::servo_clock::Age;

/// Consecutive missing answers before a servo is quarantined.
const MAX_MISSES: u32 = 3;
/// Consecutive rejected readings before a servo is quarantined. Afterwards its readings must be accepted for
/// [`TRUST_DELAY`], the time over which one reading can vouch for a clock that drifts.
const MAX_REJECTED: u32 = 25;
pub(super) const TRUST_DELAY: Duration = Duration::from_secs(15);
/// Consecutive refused goals before the cause is taken to be the configuration.
const MAX_REFUSED_GOALS: u32 = 3;
/// Longest waiting time between two attempts to reach a silent servo.
const MAX_WAIT: Duration = Duration::from_secs(5);
/// How long after an alert a servo is rebooted if configured, and how often at most.
const REBOOT_AFTER: Duration = Duration::from_secs(1);
pub(crate) const MAX_REBOOTS: u32 = 3;

impl Joint {
    /// Processes the measurements that were requested at `asked_at` and arrived at `now`.
    pub(crate) fn read(&mut self, now: Instant, asked_at: Instant, status: &Status<'_>) -> Taken {
        let mut taken = Taken::Read;
        if let Some(servo) = Reading::parse(self.model, status.params) {
            match self.clock.evaluate(servo.tick_ms, asked_at, now) {
                Age::Fresh => {}
                Age::Stale => taken = Taken::Stale,
                Age::Unproven => taken = Taken::Unproven,
                Age::Restarted => self.has_restarted(),
            }
            if taken == Taken::Read {
                let position_rad = self.settings.joint_rad(servo.position_rad);
                if !self.is_plausible(asked_at, position_rad) {
                    self.reject_reading(now);
                    return Taken::Stale;
                }
                self.accept_reading(now);
                let turn = if self.settings.reversed { -1.0 } else { 1.0 };
                let (velocity_rad_s, current_a) = (turn * servo.velocity_rad_s, turn * servo.current_a);
                // The servo samples soon after the request, however late the answer is processed.
                self.reading = Some((asked_at, Reading { current_a, velocity_rad_s, position_rad, ..servo }));
                self.supply = Supply::parse(status.params).or(self.supply);
                (self.contact.timeouts, self.contact.corrupt) = (0, 0);
            } else {
                self.reject_reading(now);
            }
        }
        // Random bytes with a valid check sum can report any fault. A real fault is repeated in the next answer.
        if taken == Taken::Read {
            self.evaluate(now, status);
        }
        taken
    }

    /// Records an accepted reading.
    fn accept_reading(&mut self, now: Instant) {
        self.contact.rejected_readings = 0;
        if self.contact.trusted_at.is_some_and(|trusted_at| now >= trusted_at) {
            (self.contact.trusted_at, self.trouble) = (None, None);
        }
    }

    /// Records a rejected reading. Without any accepted reading the position of the joint is unknown. That is handled
    /// like silence, but another answer does not end it.
    fn reject_reading(&mut self, now: Instant) {
        self.contact.rejected_readings = self.contact.rejected_readings.saturating_add(1);
        if self.contact.rejected_readings < MAX_REJECTED || self.let_go.is_some() {
            return;
        }
        self.contact.trusted_at = Some(now + TRUST_DELAY);
        self.trouble = Some(JointFault::Unbelieved);
        self.quarantine(now, JointCause::Stale);
    }

    /// Processes the answer to a job.
    pub(crate) fn process_answer(&mut self, now: Instant, job: Job, status: &Status<'_>) {
        if job == Job::Reboot {
            return;
        }
        self.contact.timeouts = 0;
        if job.is_write() && status.fault == Some(Fault::Checksum) {
            self.contact.unacknowledged += 1;
        } else if job.is_write() {
            (self.contact.unacknowledged, self.contact.wait) = (0, MIN_WAIT);
        }
        if status.fault == Some(Fault::Range) && self.has_tripped_meanwhile(job) {
            return;
        }
        if self.evaluate(now, status) {
            self.advance(now, job, status.params);
        } else if job == Job::Torque(false) {
            self.released(now, status.fault);
        } else if job == Job::ReadCondition {
            self.process_condition(now, status.params);
        }
    }

    /// Whether a servo refused a job because its bus watchdog has tripped unnoticed; then the watchdog is cleared
    /// first. Repeated refusals of a goal have another cause.
    fn has_tripped_meanwhile(&mut self, job: Job) -> bool {
        match (self.power, job) {
            (Power::Found { stay, .. }, Job::ArmWatchdog { .. }) => {
                self.power = Power::Found { watchdog: Watchdog::Tripped, stay };
            }
            (Power::Rising { is_on, .. }, Job::ArmWatchdog { .. } | Job::WriteGoal(_))
                if self.refused_goals < MAX_REFUSED_GOALS =>
            {
                self.refused_goals += u32::from(matches!(job, Job::WriteGoal(_)));
                self.power = Power::Rising { step: PowerUpStep::ArmWatchdog, is_on, is_tripped: true };
            }
            (Power::On { .. }, Job::GoalPwm(_)) if self.refused_pwm != RefusedPwm::NotByWatchdog => {
                self.refused_pwm = RefusedPwm::Unexplained;
            }
            _ => return false,
        }
        true
    }

    /// Processes the condition of its servo after an alert.
    pub(crate) fn alarmed(&mut self, now: Instant, status: &Status<'_>) {
        self.process_condition(now, status.params);
    }

    /// Records that its servo did not answer a job, or, if `is_corrupt`, that the answer was corrupt.
    pub(crate) fn unanswered(&mut self, now: Instant, job: Job, is_corrupt: bool) {
        if job == Job::Reboot {
            return;
        }
        self.contact.unacknowledged += u32::from(job.is_write());
        self.missed(now, is_corrupt);
    }

    /// Records that its servo did not answer, or, if `is_corrupt`, that the answer was corrupt.
    pub(crate) fn missed(&mut self, now: Instant, is_corrupt: bool) {
        if self.let_go.is_some() {
            if matches!(self.power, Power::Off) {
                self.power = Power::Cutting { tell_at: now };
            }
            return;
        }
        if let Link::Silent { cause, .. } = self.link {
            if cause == JointCause::Alert {
                // A servo that returns from its reboot later needs a new order.
                self.missed_order = self.newest_order;
            }
            self.link = Link::Silent { ask_at: self.leave_alone(now), cause: JointCause::Silent };
            return;
        }
        self.contact.timeouts += 1;
        self.contact.corrupt += u32::from(is_corrupt);
        let Self { contact, power, .. } = self;
        if contact.timeouts < MAX_MISSES && contact.unacknowledged < MAX_MISSES {
            return;
        }
        if contact.corrupt >= MAX_MISSES
            && !matches!(power, Power::Cutting { .. })
            && !self.arming.is_locked()
        {
            self.fall_silent(JointCause::Silent);
            self.link = Link::Corrupt(DuplicateIdCheck::default());
        } else {
            self.quarantine(now, JointCause::Silent);
        }
    }

    /// Records that its bus is lost.
    pub(crate) fn lost(&mut self, now: Instant) {
        if self.let_go.is_some() {
            self.power = Power::Cutting { tell_at: now };
        } else {
            self.quarantine(now, JointCause::BusLost);
        }
    }

    /// Locks the joint and switches torque off: two servos of its bus answer to identifier `id`.
    pub(crate) fn forbid(&mut self, now: Instant, id: Id) {
        if self.link.is_quarantined() {
            self.link = Link::Unknown;
        }
        self.fail(now, JointCause::DuplicateId, JointFault::Duplicate(id.get()));
    }

    /// Locks the joint if its servo refused an instruction, and reacts to an alert. Returns whether the instruction
    /// was executed.
    fn evaluate(&mut self, now: Instant, status: &Status<'_>) -> bool {
        match (status.fault, status.alert) {
            (None, false) => true,
            // The instruction arrived corrupt and is sent again.
            (Some(Fault::Checksum), _) => {
                self.missed(now, true);
                false
            }
            (Some(fault), _) => {
                self.fault_counters.refusals += 1;
                self.fail(now, JointCause::Refused, JointFault::Refused(fault));
                false
            }
            (None, true) => {
                self.alert(now, HardwareErrors::default(), None);
                true
            }
        }
    }

    /// Reacts to a hardware alert of its servo by the kind of error. `has_torque` is the servo's torque enable, if it
    /// has been read.
    fn alert(&mut self, now: Instant, errors: HardwareErrors, has_torque: Option<bool>) {
        let may_be_on = self.power.may_be_on() && !matches!(self.power, Power::Cutting { .. });
        // A locked joint keeps its lock. If it still has torque, the alert decides about the torque.
        let is_locked =
            matches!(self.arming, ArmingState::Locked { cause, .. } if cause != JointCause::Alert);
        if self.let_go.is_some() || (is_locked && !may_be_on) {
            return;
        }
        let is_new = self.reaction.is_none();
        if is_new {
            self.fault_counters.alerts += 1;
            let reboots = self.policy.on_alert == OnAlert::Reboot && self.reboots < MAX_REBOOTS && !is_locked;
            self.reboot_at = reboots.then_some(now + REBOOT_AFTER);
        }
        if is_new || !errors.is_none() {
            if !is_locked {
                self.trouble = Some(JointFault::Alert(errors));
            }
            self.reaction = Some(self.policy.reaction(errors, self.max_reaction));
        }
        if self.reaction == Some(AlertReaction::Lower) && has_torque == Some(true) {
            self.take_up_to_lower(now);
        }
        self.begin_disarm(Disarming { cause: JointCause::Alert, locks: true });
        if !may_be_on {
            return;
        }
        if self.reaction == Some(AlertReaction::Limp) || has_torque == Some(false) {
            self.switch_torque_off(now);
        } else if self.motion == Motion::Idle {
            self.cut_at.get_or_insert(now + self.policy.hold);
        }
    }

    /// Re-arms a joint that only holds, so that it is lowered and does not drop. A sagging supply affects one servo
    /// after the other, and the first alert has stopped the others.
    fn take_up_to_lower(&mut self, now: Instant) {
        let Power::On { goal_rad, .. } = self.power else { return };
        // The alert itself was known before its kind.
        let may_be_lowered = matches!(
            self.arming,
            ArmingState::Disarmed { .. } | ArmingState::Locked { cause: JointCause::Alert, .. }
        );
        if may_be_lowered && self.motion == Motion::Idle && matches!(self.link, Link::Answering) {
            let (_, cause) = self.arming.published();
            self.cut_at = None;
            let ending = Some(Disarming { cause: JointCause::Alert, locks: true });
            self.arming = ArmingState::Armed { after: cause, lapses_at: None, ending };
            self.motion = Motion::Hold { at: servo::Motion::at(goal_rad), since: now };
        }
    }

    /// Locks the joint, and switches its torque off.
    pub(super) fn fail(&mut self, now: Instant, cause: JointCause, trouble: JointFault) {
        if self.let_go.is_some() {
            return;
        }
        if self.arming.is_locked() {
            // The first lock stays. A joint that still has torque loses it.
            if self.power.may_be_on() && !matches!(self.power, Power::Cutting { .. }) {
                self.switch_torque_off(now);
            }
            return;
        }
        if let Link::Identified(Setup::Unlock | Setup::Mode | Setup::Limits) = self.link {
            // No more setup is written, but the servo is still read.
            self.link = Link::Answering;
        }
        self.trouble = Some(trouble);
        self.begin_disarm(Disarming { cause, locks: true });
        self.switch_torque_off(now);
    }

    /// Processes the answer of its servo to torque off.
    fn released(&mut self, now: Instant, fault: Option<Fault>) {
        if let Power::Cutting { tell_at } = &mut self.power {
            match fault {
                None => self.power = Power::Off,
                // The instruction arrived corrupt and is sent again at once.
                Some(Fault::Checksum) => {}
                // Repeating it in every cycle would keep the bus from serving the other servos.
                Some(_) => *tell_at = now + MAX_WAIT,
            }
        }
    }

    /// Its servo has restarted by itself: its torque is off, and its RAM items have their initial values.
    fn has_restarted(&mut self) {
        // A servo found with its torque on may be armed already, and was armed for that torque.
        let had_torque = self.power.is_ours() || matches!(self.power, Power::Found { .. });
        if self.let_go.is_none() && had_torque {
            self.fault_counters.restarts += 1;
            self.motion = Motion::Idle;
            self.disarm(JointCause::Restarted);
            self.power = Power::Unknown { was_on: false };
            self.link = Link::Identified(Setup::Inspect);
        }
    }

    pub(super) fn process_condition(&mut self, now: Instant, answer: &[u8]) {
        let Some(condition) = Condition::parse(answer) else { return };
        if self.refused_pwm == RefusedPwm::Unexplained {
            self.refused_pwm = match condition.watchdog {
                Watchdog::Armed => RefusedPwm::NotByWatchdog,
                Watchdog::Unset | Watchdog::Tripped => RefusedPwm::No,
            };
        }
        let is_on = matches!(self.power, Power::On { .. }) && condition.has_torque;
        if is_on && condition.watchdog != Watchdog::Armed {
            self.watchdog_is_off(condition.watchdog);
        }
        if !condition.errors.is_none() {
            self.alert(now, condition.errors, Some(condition.has_torque));
            // Another program has switched it on.
            if condition.has_torque && matches!(self.power, Power::Off) && self.let_go.is_none() {
                self.power = Power::Cutting { tell_at: now };
            }
            return;
        }
        match self.power {
            Power::On { .. } if !condition.has_torque => self.has_restarted(),
            // Another program may have switched it on or off.
            Power::Off if condition.has_torque && self.arming.is_locked() => {
                self.power = Power::Cutting { tell_at: now };
            }
            Power::Off if condition.has_torque => {
                self.power = Power::Found { watchdog: condition.watchdog, stay: None };
            }
            Power::Found { .. } if !condition.has_torque && self.arming.is_armed() => self.has_restarted(),
            Power::Found { .. } if !condition.has_torque => self.power = Power::Off,
            Power::Found { stay, .. } => self.power = Power::Found { watchdog: condition.watchdog, stay },
            Power::Unknown { .. }
            | Power::Off
            | Power::Rising { .. }
            | Power::On { .. }
            | Power::Cutting { .. } => {}
        }
    }

    /// The servo's bus watchdog has tripped, or was disabled: nothing moves until it is armed again.
    fn watchdog_is_off(&mut self, watchdog: Watchdog) {
        self.fault_counters.watchdogs += 1;
        self.motion = Motion::Idle;
        self.disarm(JointCause::Watchdog);
        self.power = Power::Rising {
            step: PowerUpStep::ArmWatchdog,
            is_on: true,
            is_tripped: watchdog == Watchdog::Tripped,
        };
        // The watchdog is armed at once; the joint is armed separately.
        self.abort_power_up();
    }

    /// Resets the known state of its servo.
    fn fall_silent(&mut self, cause: JointCause) {
        let contact = &mut self.contact;
        (contact.timeouts, contact.corrupt, contact.unacknowledged, contact.rejected_readings) = (0, 0, 0, 0);
        self.clock.forget();
        self.goal = None;
        if matches!(self.power, Power::Cutting { .. }) {
            return;
        }
        self.motion = Motion::Idle;
        let was_on = self.power.is_on() || matches!(self.power, Power::Unknown { was_on: true });
        if self.arming.is_armed() {
            self.disarm(cause);
        }
        self.power = Power::Unknown { was_on };
    }

    pub(super) fn quarantine(&mut self, now: Instant, cause: JointCause) {
        if cause == JointCause::BusLost {
            // The servo may answer as soon as its line is back.
            self.contact.wait = MIN_WAIT;
        }
        self.fall_silent(cause);
        self.link = Link::Silent { ask_at: self.leave_alone(now), cause };
    }

    /// End of the waiting time of a silent servo. The waiting time doubles each time, until the servo acknowledges a
    /// write.
    fn leave_alone(&mut self, now: Instant) -> Instant {
        let until = now + self.contact.wait;
        self.contact.wait = (2 * self.contact.wait).min(MAX_WAIT);
        until
    }
}
