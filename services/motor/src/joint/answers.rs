//! What a joint makes of what its servo says, or does not say.

use clock::{Duration, Instant};
use config::leo::OnAlert;
use message::JointCause;
use servo::{Fault, HardwareErrors, Id, Reading, Status};

use super::{Joint, Taken, WAIT_FIRST};
use crate::Trouble;
use crate::doubt::Doubt;
use crate::job::{Condition, Job};
use crate::servo_clock::Age;
use crate::stage::Stage;

/// Times in a row that a servo may be silent before it is quarantined.
const MISSES_MOST: u32 = 3;
/// Readings in a row that may be unbelievable before a servo is quarantined, and for how long they must be
/// believed again: as long as one reading can speak for a clock that goes wrong.
const UNBELIEVED_MOST: u32 = 25;
pub(super) const PROVEN_AFTER: Duration = Duration::from_secs(15);
/// The longest time for which a silent servo is left alone.
const WAIT_MOST: Duration = Duration::from_secs(5);
/// How long after an alert a servo is rebooted, where the configuration says so, and how often.
const REBOOT_AFTER: Duration = Duration::from_secs(1);
pub(crate) const REBOOTS_MOST: u32 = 3;

impl Joint {
    /// Takes the measurements that were asked for at `asked_at` and arrived at `now`.
    pub(crate) fn read(&mut self, now: Instant, asked_at: Instant, status: &Status<'_>) -> Taken {
        let mut taken = Taken::Read;
        if let Some(servo) = Reading::parse(self.model, status.params) {
            match self.clock.judge(servo.tick_ms, asked_at, now) {
                Age::Fresh => {}
                Age::Stale => taken = Taken::Stale,
                Age::Unproven => taken = Taken::Unproven,
                Age::Restarted => self.has_restarted(),
            }
            if taken == Taken::Read {
                let position_rad = self.settings.joint_rad(servo.position_rad);
                if !self.is_plausible(asked_at, position_rad) {
                    self.disbelieve(now);
                    return Taken::Stale;
                }
                self.believe(now);
                let turn = if self.settings.reversed { -1.0 } else { 1.0 };
                let (velocity_rad_s, current_a) = (turn * servo.velocity_rad_s, turn * servo.current_a);
                // It was sampled soon after it was asked for, whenever the answer was taken up.
                self.reading = Some((asked_at, Reading { current_a, velocity_rad_s, position_rad, ..servo }));
                (self.misses, self.spoilt) = (0, 0);
            } else {
                self.disbelieve(now);
            }
        }
        // Noise with a right check sum says any fault as well. One that is there is in the next answer too.
        if taken == Taken::Read {
            self.judge(now, status);
        }
        taken
    }

    /// Notes a reading that is believed.
    fn believe(&mut self, now: Instant) {
        self.unbelieved = 0;
        if self.proven_at.is_some_and(|proven_at| now >= proven_at) {
            (self.proven_at, self.trouble) = (None, None);
            if self.cause == JointCause::Unbelieved {
                self.cause = JointCause::NotStarted;
            }
        }
    }

    /// Notes a reading that is not believed. Where none is, nobody knows where the joint stands: that is like
    /// silence, but that another answer does not end it.
    fn disbelieve(&mut self, now: Instant) {
        self.unbelieved = self.unbelieved.saturating_add(1);
        if self.unbelieved < UNBELIEVED_MOST || matches!(self.stage, Stage::LetGo { .. }) {
            return;
        }
        self.proven_at = Some(now + PROVEN_AFTER);
        self.trouble = Some(Trouble::Unbelieved);
        self.quarantine(now, JointCause::Unbelieved);
    }

    /// Takes the answer to a job.
    pub(crate) fn answered(&mut self, now: Instant, job: Job, status: &Status<'_>) {
        if job == Job::Reboot {
            return;
        }
        self.misses = 0;
        if job.is_told() && status.fault == Some(Fault::Checksum) {
            self.unacknowledged += 1;
        } else if job.is_told() {
            (self.unacknowledged, self.wait) = (0, WAIT_FIRST);
        }
        if self.judge(now, status) {
            self.advance(now, job, status.params);
        } else if job == Job::Torque(false) {
            self.released(now, status.fault);
        } else if job == Job::Look {
            self.looked_at(now, status.params);
        }
    }

    /// Takes what its servo says of itself when it has just reported an alert.
    pub(crate) fn alarmed(&mut self, now: Instant, status: &Status<'_>) {
        self.looked_at(now, status.params);
    }

    /// Notes that its servo did not answer a job, or that its answer arrived broken.
    pub(crate) fn unanswered(&mut self, now: Instant, job: Job, spoilt: bool) {
        if job == Job::Reboot {
            return;
        }
        self.unacknowledged += u32::from(job.is_told());
        self.missed(now, spoilt);
    }

    /// Notes that its servo was not heard when it was asked: that it was silent or, if `spoilt`,
    /// that its answer arrived broken.
    pub(crate) fn missed(&mut self, now: Instant, spoilt: bool) {
        if matches!(self.stage, Stage::Absent { .. }) {
            self.cause = JointCause::Silent;
            self.stage = Stage::Absent { ask_at: self.leave_alone(now) };
            return;
        }
        if let Stage::LetGo { confirmed } = &mut self.stage {
            *confirmed = false;
            return;
        }
        self.misses += 1;
        self.spoilt += u32::from(spoilt);
        if self.misses < MISSES_MOST && self.unacknowledged < MISSES_MOST {
            return;
        }
        if self.spoilt >= MISSES_MOST && !matches!(self.stage, Stage::Failed { .. }) {
            (self.misses, self.spoilt, self.unacknowledged, self.goal) = (0, 0, 0, None);
            self.had_torque |= self.keeps_torque();
            self.stage = Stage::Doubt(Doubt::default());
            self.cause = JointCause::Silent;
        } else {
            self.quarantine(now, JointCause::Silent);
        }
    }

    /// Notes that its bus is lost.
    pub(crate) fn lost(&mut self, now: Instant) {
        if let Stage::LetGo { confirmed } = &mut self.stage {
            *confirmed = false;
        } else {
            self.quarantine(now, JointCause::BusLost);
        }
    }

    /// Switches its torque off for good: its bus has two servos of one identifier.
    pub(crate) fn forbid(&mut self, id: Id) {
        self.fail(JointCause::DuplicateId, Trouble::Duplicate(id.get()));
    }

    /// Lets the joint fail when its servo reports a fault or an alert; whether all is well.
    fn judge(&mut self, now: Instant, status: &Status<'_>) -> bool {
        match (status.fault, status.alert) {
            (None, false) => true,
            // What we said arrived broken: it will be said again.
            (Some(Fault::Checksum), _) => {
                self.missed(now, true);
                false
            }
            (Some(fault), _) => {
                self.incidents.refusals += 1;
                self.fail(JointCause::Refused, Trouble::Refused(fault));
                false
            }
            (None, true) => {
                self.alert(now, HardwareErrors::default());
                false
            }
        }
    }

    /// Stops the joint for a hardware alert, and with it its group.
    fn alert(&mut self, now: Instant, errors: HardwareErrors) {
        if matches!(self.stage, Stage::Failed { cause: JointCause::Alert, .. }) && !errors.is_none() {
            self.trouble = Some(Trouble::Alert(errors));
        }
        if matches!(self.stage, Stage::Failed { .. } | Stage::LetGo { .. }) {
            return;
        }
        self.incidents.alerts += 1;
        let reboots = self.policy.on_alert == OnAlert::Reboot && self.reboots < REBOOTS_MOST;
        self.trouble = Some(Trouble::Alert(errors));
        self.goal = None;
        self.stage = Stage::Failed {
            cause: JointCause::Alert,
            release_at: Some(now),
            reboot_at: reboots.then_some(now + REBOOT_AFTER),
        };
    }

    pub(super) fn fail(&mut self, cause: JointCause, trouble: Trouble) {
        if !matches!(self.stage, Stage::Failed { .. } | Stage::LetGo { .. }) {
            self.stage = Stage::Failed { cause, release_at: Some(Instant::EPOCH), reboot_at: None };
            self.trouble = Some(trouble);
            self.goal = None;
        }
    }

    /// Notes what its servo answered when it was told to switch its torque off.
    fn released(&mut self, now: Instant, fault: Option<Fault>) {
        if let Stage::Failed { release_at, .. } = &mut self.stage {
            match fault {
                None => *release_at = None,
                // What arrived broken is said again at once.
                Some(Fault::Checksum) => {}
                // Saying so in every cycle would keep the bus from looking at the others.
                Some(_) => *release_at = Some(now + WAIT_MOST),
            }
        }
    }

    /// Its servo began anew by itself: without torque, and with what is kept without power.
    fn has_restarted(&mut self) {
        if self.keeps_torque() || matches!(self.stage, Stage::Arm(_)) {
            self.incidents.restarts += 1;
            self.restarted = true;
            self.goal = None;
            self.cause = JointCause::Restarted;
            self.stage = Stage::Inspect;
        }
    }

    pub(super) fn looked_at(&mut self, now: Instant, answer: &[u8]) {
        let Some(condition) = Condition::parse(answer) else { return };
        self.condition = Some(condition);
        if !condition.errors.is_none() {
            self.alert(now, condition.errors);
        } else if self.stage == Stage::Following && condition.watchdog_tripped {
            self.incidents.watchdogs += 1;
            self.cause = JointCause::Watchdog;
            self.goal = None;
            self.stage = Stage::Arm(crate::stage::Arm::Clear);
        } else if self.keeps_torque() && !condition.has_torque {
            self.has_restarted();
        } else if self.stage == Stage::Ready {
            // Another hand may have switched it on.
            self.may_have_torque |= condition.has_torque;
        }
    }

    pub(super) fn quarantine(&mut self, now: Instant, cause: JointCause) {
        (self.misses, self.spoilt, self.unacknowledged, self.unbelieved) = (0, 0, 0, 0);
        if cause == JointCause::BusLost {
            // It may answer as soon as its line is back.
            self.wait = WAIT_FIRST;
        }
        self.cause = cause;
        self.goal = None;
        self.clock.forget();
        self.had_torque |= self.keeps_torque();
        let ask_at = self.leave_alone(now);
        // A servo that failed stays failed also when it was away, and is told until it confirms.
        self.stage = if let Stage::Failed { cause, release_at, reboot_at } = self.stage {
            Stage::Failed { cause, release_at: release_at.map(|_| ask_at), reboot_at }
        } else {
            Stage::Absent { ask_at }
        };
    }

    /// Until when a silent servo is left alone: twice as long each time, until it acknowledges something.
    fn leave_alone(&mut self, now: Instant) -> Instant {
        let until = now + self.wait;
        self.wait = (2 * self.wait).min(WAIT_MOST);
        until
    }
}
