//! How a joint's servo is set up, switched on, and switched off: what it is told next.

use clock::{Duration, Instant};
use message::JointCause;
use servo::{Motion as Setpoint, acceleration_count, position_count};

use super::answers::PROVEN_AFTER;
use super::steer::{ACCELERATION_MARGIN, LOW_ACCELERATION_RAD_S2, velocity};
use super::{
    Joint, LOOK_EVERY, Licence, Link, Motion, Power, REBOOT_WAIT, RefusedDuty, Rise, Setup, Watchdog,
};
use crate::Trouble;
use crate::doubt::Came;
use crate::job::{self, Bounds, Job};
use crate::notice::Notice;

/// The counts of a duty of 100 % (items 36 and 100).
const FULL_DUTY: u16 = 885;
/// A servo that does not stand so long after it was told to stay has not heard all of it, and is told again.
const STANDS_AFTER: Duration = Duration::from_millis(200);

impl Joint {
    /// What its servo is to be told next, if anything.
    pub(crate) fn job(&mut self, now: Instant, may_arm: bool) -> Option<Job> {
        let is_cutting = matches!(self.power, Power::Cutting { .. });
        if !is_cutting && self.reboot_at.is_some_and(|at| now >= at) {
            return Some(self.reboot(now));
        }
        match self.link {
            Link::Silent { ask_at, .. } => return (now >= ask_at).then(|| self.call()),
            Link::Doubted(doubt) => return Some(Job::Doubt { alike: doubt.asks_alike() }),
            Link::Unknown | Link::Identified(_) | Link::Answering => {}
        }
        if let Power::Cutting { tell_at } = self.power {
            return (now >= tell_at).then_some(Job::Torque(false));
        }
        match self.link {
            // Another model, say: it is left alone until a person has acknowledged that.
            Link::Unknown if self.licence.is_locked() && matches!(self.power, Power::Off) => None,
            Link::Unknown => Some(Job::Ping),
            Link::Identified(Setup::Inspect) => Some(Job::Inspect),
            // What is overwritten is told before it is written.
            Link::Identified(Setup::Unlock | Setup::Mode | Setup::Limits) if !self.notices.is_empty() => None,
            Link::Identified(Setup::Unlock) => Some(Job::Torque(false)),
            Link::Identified(Setup::Mode) => Some(Job::SetMode),
            Link::Identified(Setup::Limits) => {
                let (min, max) = self.limit_counts();
                Some(Job::SetLimits { min, max })
            }
            Link::Answering | Link::Silent { .. } | Link::Doubted(_) => self.power_job(now, may_arm),
        }
    }

    /// What a servo that is set up is told next.
    fn power_job(&mut self, now: Instant, may_arm: bool) -> Option<Job> {
        if may_arm && self.licence.is_given() && !self.is_unproven() {
            self.begin_rise();
        }
        match self.power {
            Power::Unknown { .. } => {
                self.link = Link::Identified(Setup::Inspect);
                Some(Job::Inspect)
            }
            Power::Found { watchdog: Watchdog::Unset, .. } => Some(Job::Guard { clear: false }),
            Power::Found { watchdog: Watchdog::Tripped, .. } => Some(Job::Guard { clear: true }),
            // Sent on its way by a process that is no more.
            Power::Found { stay, .. } => self.stay_job(now, stay, self.comes_back()),
            Power::Rising { step: Rise::Guard, is_tripped, .. } => Some(Job::Guard { clear: is_tripped }),
            Power::Rising { step: Rise::Aim, is_on, .. } => self.aim(now, is_on),
            Power::Rising { step: Rise::Torque, is_tripped, .. } => {
                // Whether it is on is not known where the answer is lost.
                self.power = Power::Rising { step: Rise::Torque, is_on: true, is_tripped };
                Some(Job::Torque(true))
            }
            Power::On { .. } => self.motion_job(now),
            Power::Off | Power::Cutting { .. } => None,
        }
    }

    /// Begins to switch torque on, where that has not begun.
    const fn begin_rise(&mut self) {
        let (is_on, watchdog) = match self.power {
            Power::Off => (false, Watchdog::Unset),
            Power::Found { watchdog, .. } => (true, watchdog),
            Power::Unknown { .. } | Power::Rising { .. } | Power::On { .. } | Power::Cutting { .. } => return,
        };
        let step = if matches!(watchdog, Watchdog::Armed) { Rise::Aim } else { Rise::Guard };
        self.power = Power::Rising { step, is_on, is_tripped: matches!(watchdog, Watchdog::Tripped) };
    }

    /// The profile of the soft start, and a goal that is where it stands.
    fn aim(&self, now: Instant, is_on: bool) -> Option<Job> {
        let stands_rad = self.standing(now)?;
        let slow_rad_s = self.policy.soft_start_rad_s.min(self.velocity_rad_s());
        let (acceleration, velocity) = (acceleration(LOW_ACCELERATION_RAD_S2), velocity(slow_rad_s));
        if is_on && self.is_far_from(stands_rad) {
            // With its limit for a goal it would move before its joint does.
            return Some(Job::Profile([acceleration, velocity]));
        }
        let goal = position_count(self.settings.servo_rad(stands_rad));
        Some(Job::Aim([acceleration, velocity, goal]))
    }

    fn motion_job(&mut self, now: Instant) -> Option<Job> {
        if self.refused_duty == RefusedDuty::Unexplained {
            return Some(self.look(now));
        }
        if let Some(duty) = self.duty_to_tell(now) {
            return Some(Job::Duty(duty));
        }
        self.refused_duty = RefusedDuty::No;
        match self.motion {
            Motion::Stay { told } => self.stay_job(now, told, true),
            Motion::Soft { until, .. } if now >= until && !self.is_quick() => Some(Job::Profile([
                acceleration(self.settings.acceleration_rad_s2 * ACCELERATION_MARGIN),
                velocity(self.velocity_rad_s()),
            ])),
            Motion::Idle
            | Motion::Align { .. }
            | Motion::Soft { .. }
            | Motion::Track { .. }
            | Motion::Halt { .. }
            | Motion::Hold { .. }
            | Motion::Retreat { .. } => None,
        }
    }

    /// The duty that its servo is to be told, where it has another one: bounded while the joint is far behind its command.
    ///
    /// A profile bounds how fast the servo's own trajectory runs, not how fast the shaft catches up with it. So a joint
    /// that is held presses with less, and turns no faster than it may once it is free.
    fn duty_to_tell(&self, now: Instant) -> Option<u16> {
        let (Power::On { is_bounded, .. }, Some(bounds)) = (self.power, self.bounds) else { return None };
        let is_behind = self.is_far_behind(now, is_bounded);
        (is_behind != is_bounded).then(|| if is_behind { self.bounded_duty(bounds) } else { bounds.duty })
    }

    /// The duty at which the servo turns no faster than its joint may, without load.
    fn bounded_duty(&self, bounds: Bounds) -> u16 {
        let no_load_rad_s =
            servo::velocity_rad_s(i32::try_from(self.model.velocity_limit()).unwrap_or(i32::MAX));
        let share = (self.velocity_rad_s() / no_load_rad_s).clamp(0.0, 1.0);
        let duty = quantity::number::round_i64(f64::from(FULL_DUTY) * share);
        u16::try_from(duty).unwrap_or(FULL_DUTY).clamp(1, bounds.duty.max(1))
    }

    /// Tells a servo that shall stay where it is, and tells it again where it does not stand in time.
    fn stay_job(&self, now: Instant, told: Option<(Instant, f64)>, shall_stay: bool) -> Option<Job> {
        let goes_on = |(told_at, _)| now >= told_at + STANDS_AFTER && !self.stays();
        told.map_or(shall_stay, goes_on).then_some(Job::Stay)
    }

    /// Since when it has been time to look how its servo is, if it is.
    pub(crate) fn look_due(&self, now: Instant) -> Option<Instant> {
        (self.is_read() && now >= self.look_at).then_some(self.look_at)
    }

    /// Looks how its servo is.
    pub(crate) fn look(&mut self, now: Instant) -> Job {
        self.look_at = now + LOOK_EVERY;
        Job::Look
    }

    /// Goes on after a job was done.
    pub(super) fn advance(&mut self, now: Instant, job: Job, answer: &[u8]) {
        match (self.link, self.power, job) {
            (Link::Unknown | Link::Silent { .. }, _, Job::Ping | Job::LetGo) => self.identified(now, answer),
            (Link::Identified(Setup::Inspect), _, Job::Inspect) if !job::answers_all(answer) => {
                // It was told in vain.
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
            (_, Power::Found { stay, .. }, Job::Guard { .. }) => {
                self.power = Power::Found { watchdog: Watchdog::Armed, stay };
            }
            (_, Power::Found { watchdog, .. }, Job::Stay) => {
                self.power = Power::Found { watchdog, stay: self.stood(now) };
            }
            (_, Power::Rising { step: Rise::Guard, is_on, .. }, Job::Guard { .. }) => {
                self.power = Power::Rising { step: Rise::Aim, is_on, is_tripped: false };
            }
            (_, Power::Rising { step: Rise::Aim, is_on, is_tripped }, Job::Aim(_) | Job::Profile(_)) => {
                self.power = Power::Rising { step: Rise::Torque, is_on, is_tripped };
            }
            (_, Power::Rising { step: Rise::Torque, .. }, Job::Torque(true)) => self.risen(now),
            (_, Power::On { goal_rad, is_bounded, .. }, Job::Profile(_)) => {
                self.power = Power::On { goal_rad, is_quick: true, is_bounded };
                // The job has told it another velocity.
                self.told = None;
            }
            (_, Power::On { goal_rad, is_quick, .. }, Job::Duty(duty)) => {
                let is_bounded = self.bounds.is_some_and(|bounds| duty < bounds.duty);
                self.power = Power::On { goal_rad, is_quick, is_bounded };
                self.refused_duty = RefusedDuty::No;
            }
            (_, Power::On { .. }, Job::Stay) if matches!(self.motion, Motion::Stay { .. }) => {
                self.motion = Motion::Stay { told: self.stood(now) };
            }
            (_, _, Job::Look) => self.looked_at(now, answer),
            // It was told for a state that has passed.
            _ => {}
        }
    }

    fn stood(&self, now: Instant) -> Option<(Instant, f64)> {
        self.reading.map(|(_, reading)| (now, reading.position_rad))
    }

    /// Takes what came to a question that one servo answers; whether it is sure now that there are
    /// two.
    pub(crate) fn doubted(&mut self, now: Instant, came: Came) -> bool {
        let Link::Doubted(mut doubt) = self.link else { return false };
        let verdict = doubt.note(came);
        self.link = Link::Doubted(doubt);
        if verdict == Some(false) {
            self.quarantine(now, JointCause::Silent);
        }
        verdict == Some(true)
    }

    /// Asks whether its servo is there. One that shall have no torque is told so as well: it may hear what it does not
    /// answer.
    fn call(&mut self) -> Job {
        let is_cutting = matches!(self.power, Power::Cutting { .. });
        if !(is_cutting || (self.orders.limp && self.power.may_be_on())) {
            return Job::Ping;
        }
        if !is_cutting {
            // If it comes back without torque, it has not begun anew.
            self.power = Power::Unknown { was_on: false };
            self.disarm(JointCause::CommandTimeout);
        }
        Job::LetGo
    }

    fn identified(&mut self, now: Instant, answer: &[u8]) {
        let expected = self.model.number();
        let found = answer.first_chunk().map_or(0, |number| u16::from_le_bytes(*number));
        if found == expected {
            self.contact.is_fast =
                answer.get(2).is_some_and(|firmware| self.model.knows_fast_reads(*firmware));
            self.link = Link::Identified(Setup::Inspect);
        } else {
            self.link = Link::Unknown;
            self.fail(now, JointCause::Refused, Trouble::Model { expected, found });
        }
    }

    /// Takes how its servo is set up.
    fn inspected(&mut self, now: Instant, setup: &[u8]) {
        let (min, max) = self.limit_counts();
        let has_torque = job::has_torque(setup);
        let was_on = matches!(self.power, Power::Unknown { was_on: true });
        let is_cutting = matches!(self.power, Power::Cutting { .. });
        self.bounds = Bounds::parse(setup);
        self.clock.forget();
        self.contact.trusted_at = self.contact.trusted_at.map(|_| now + PROVEN_AFTER);
        self.link = Link::Answering;
        if was_on && !has_torque {
            // It was not only silent: its group holds until it moves again.
            self.incidents.restarts += 1;
            self.disarm(JointCause::Restarted);
        }
        self.power = match has_torque {
            false => Power::Off,
            true if is_cutting => Power::Cutting { tell_at: now },
            true => Power::Found { watchdog: job::watchdog(setup), stay: None },
        };
        for notice in job::notices(self.model, setup, (min, max), self.settings.velocity_rad_s) {
            self.notices.add(notice);
        }
        if let Some(trouble) = job::foreign(self.model, self.contact.is_fast, setup) {
            return self.fail(now, JointCause::Refused, trouble);
        }
        if let Some(trouble) = job::powerless(setup) {
            return self.fail(now, JointCause::Refused, trouble);
        }
        if !job::is_configured(setup, min, max) && !self.licence.is_locked() {
            self.link = Link::Identified(Setup::Unlock);
        }
    }

    /// The limits that its servo was found with, where they are neither its own nor those from the factory.
    pub(crate) fn foreign_limits(&self) -> Option<(i32, i32)> {
        let is_fresh = matches!(self.link, Link::Identified(Setup::Unlock)) && !self.are_limits_acknowledged;
        let mut found = (None, None);
        for notice in self.notices.all().filter(|_| is_fresh) {
            match notice {
                Notice::Overwritten { item, old, .. } if item == servo::table::MIN_POSITION_LIMIT => {
                    found.0 = Some(old);
                }
                Notice::Overwritten { item, old, .. } if item == servo::table::MAX_POSITION_LIMIT => {
                    found.1 = Some(old);
                }
                Notice::Overwritten { .. } | Notice::Tighter { .. } | Notice::LeftOver { .. } => {}
            }
        }
        // A limit that is not overwritten is the joint's own.
        let (min, max) = self.limit_counts();
        let limits = (found.0.unwrap_or(min), found.1.unwrap_or(max));
        (found != (None, None) && limits != job::FACTORY_LIMITS).then_some(limits)
    }

    /// Its servo has the limits of another joint: nothing of it is written before a person has looked.
    pub(crate) fn refuse_as_other(&mut self, now: Instant, other: usize) {
        self.notices = crate::notice::Notices::default();
        self.link = Link::Answering;
        self.fail(now, JointCause::Refused, Trouble::OtherJoint(other + 1));
    }

    /// Torque is on.
    fn risen(&mut self, now: Instant) {
        // It begins where it stands now, and not where it was to stand when torque came on.
        let Some(goal_rad) = self.standing(now) else { return };
        // An earlier process may have left it bounded.
        let is_bounded = self.bounds.is_some_and(|bounds| bounds.goal_duty < bounds.duty);
        self.power = Power::On { goal_rad, is_quick: false, is_bounded };
        self.refused_aims = 0;
        self.motion = Motion::Idle;
        if self.licence.is_given() && self.is_far_from(goal_rad) {
            self.motion = Motion::Align { to_rad: goal_rad };
        } else if self.licence.is_given() {
            self.begin_soft(now, Setpoint::at(goal_rad));
        }
    }

    /// Has its servo begin anew. It counts as done, whatever is answered: a servo that did not hear it reports its
    /// alert once more when it is asked what it is, and one whose answer was lost must not be told twice.
    fn reboot(&mut self, now: Instant) -> Job {
        self.reboots += 1;
        (self.trouble, self.reaction, self.reboot_at) = (None, None, None);
        self.licence = Licence::Disarmed { cause: JointCause::Alert };
        self.power = Power::Unknown { was_on: false };
        self.motion = Motion::Idle;
        self.clock.forget();
        self.link = Link::Silent { ask_at: now + REBOOT_WAIT, cause: JointCause::Alert };
        Job::Reboot
    }
}

/// An acceleration of a profile in counts. Zero would be without limit.
fn acceleration(rad_s2: f64) -> i32 {
    acceleration_count(rad_s2).clamp(1, 32_767)
}
