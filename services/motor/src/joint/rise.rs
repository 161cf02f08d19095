//! How a joint is brought up and down, step by step.

use clock::{Duration, Instant};
use message::JointCause;
use servo::{Motion, acceleration_count, position_count, velocity_count};

use super::answers::PROVEN_AFTER;
use super::{Joint, LOOK_EVERY};
use crate::Trouble;
use crate::doubt::Came;
use crate::job::{Bounds, Job, answers_all, foreign, has_torque, is_configured};
use crate::stage::{Arm, Configure, Stage};

/// The servo's own bus watchdog: 200 ms.
const WATCHDOG: u8 = 10;
/// The acceleration until the soft start is over, in which the velocity is that of the soft start: slow, so
/// that what is wrong is seen before it is fast.
const LOW_ACCELERATION_RAD_S2: f64 = 5.0;
/// How much faster than the joint the servo's own profile is in operation: enough to keep up
/// with commands that are smooth, and yet a limit.
const VELOCITY_MARGIN: f64 = 1.5;
const ACCELERATION_MARGIN: f64 = 8.0;
/// How long a servo hears nothing after it was told to begin anew.
const REBOOT_WAIT: Duration = Duration::from_millis(500);
/// Who does not stand so long after it was told to stay has not heard all of it, and is told again.
const STANDS_AFTER: Duration = Duration::from_millis(200);

impl Joint {
    /// What its servo is to be told next on the way up or down, if anything.
    pub(crate) fn job(&mut self, now: Instant, may_arm: bool) -> Option<Job> {
        let is_held = matches!(self.stage, Stage::Held { told: Some(_) }) && self.halt.is_none();
        let is_ready = self.stage == Stage::Ready && self.proven_at.is_none();
        if may_arm && (is_ready || is_held) {
            self.stage = Stage::Arm(Arm::Clear);
        }
        match self.stage {
            Stage::Absent { ask_at } => (now >= ask_at).then(|| self.call()),
            Stage::Doubt(doubt) => Some(Job::Doubt { alike: doubt.asks_alike() }),
            Stage::Ask => Some(Job::Ping),
            Stage::Inspect => Some(Job::Inspect),
            Stage::Configure(Configure::Unlock) | Stage::Release => Some(Job::Torque(false)),
            Stage::Configure(Configure::Mode) => Some(Job::SetMode),
            Stage::Configure(Configure::Limits) => {
                let (min, max) = self.limit_counts();
                Some(Job::SetLimits { min, max })
            }
            Stage::Arm(Arm::Clear) => Some(Job::SetWatchdog(0)),
            Stage::Arm(Arm::Aim) => {
                let stands_rad = self.standing(now)?;
                let slow_rad_s = self.policy.soft_start_rad_s.min(self.settings.velocity_rad_s);
                let [acceleration, velocity] = profile(LOW_ACCELERATION_RAD_S2, slow_rad_s);
                if self.may_have_torque && self.is_far_from(stands_rad) {
                    // With its limit for a goal it would move before it follows.
                    return Some(Job::Profile([acceleration, velocity]));
                }
                let goal = position_count(self.settings.servo_rad(stands_rad));
                Some(Job::Aim([acceleration, velocity, goal]))
            }
            Stage::Arm(Arm::Watch) => Some(Job::SetWatchdog(WATCHDOG)),
            Stage::Arm(Arm::Torque) => {
                // Whether it is on is not known where the answer is lost.
                self.may_have_torque = true;
                Some(Job::Torque(true))
            }
            Stage::Following if self.is_eased_in(now) => Some(Job::Profile(profile(
                self.settings.acceleration_rad_s2 * ACCELERATION_MARGIN,
                self.settings.velocity_rad_s * VELOCITY_MARGIN,
            ))),
            Stage::Failed { release_at: Some(at), .. } => (now >= at).then_some(Job::Torque(false)),
            Stage::Failed { reboot_at: Some(at), .. } => (now >= at).then(|| self.reboot(now)),
            Stage::Held { told } => {
                let goes_on = |(told_at, _)| now >= told_at + STANDS_AFTER && !self.stays();
                told.is_none_or(goes_on).then_some(Job::Stay)
            }
            Stage::Failed { .. } | Stage::LetGo { .. } | Stage::Ready | Stage::Following => None,
        }
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
        self.stage = match (self.stage, job) {
            (Stage::Ask | Stage::Absent { .. }, Job::Ping) => self.identified(answer),
            (Stage::Absent { .. }, Job::LetGo) => {
                self.cause = JointCause::CommandTimeout;
                self.identified(answer)
            }
            (Stage::Inspect, Job::Inspect) if !answers_all(answer) => {
                // It was told in vain.
                self.unacknowledged += 1;
                return self.missed(now, false);
            }
            (Stage::Inspect, Job::Inspect) => {
                let (min, max) = self.limit_counts();
                self.bounds = Bounds::parse(answer);
                self.may_have_torque = has_torque(answer);
                if std::mem::take(&mut self.had_torque) && !has_torque(answer) {
                    // It was not only silent: its group holds until it follows again.
                    self.incidents.restarts += 1;
                    (self.restarted, self.cause) = (true, JointCause::Restarted);
                }
                self.clock.forget();
                self.proven_at = self.proven_at.map(|_| now + PROVEN_AFTER);
                if let Some(trouble) = foreign(self.model, self.is_fast, answer) {
                    return self.fail(JointCause::Refused, trouble);
                }
                if is_configured(answer, min, max) {
                    Stage::Ready
                } else {
                    Stage::Configure(Configure::Unlock)
                }
            }
            (Stage::Configure(Configure::Unlock), Job::Torque(false)) => {
                self.may_have_torque = false;
                Stage::Configure(Configure::Mode)
            }
            (Stage::Configure(Configure::Mode), Job::SetMode) => Stage::Configure(Configure::Limits),
            (Stage::Configure(Configure::Limits), Job::SetLimits { .. }) => Stage::Ready,
            (Stage::Release, Job::Torque(false)) => {
                self.may_have_torque = false;
                Stage::Ready
            }
            (Stage::Arm(Arm::Clear), Job::SetWatchdog(0)) => Stage::Arm(Arm::Aim),
            (Stage::Arm(Arm::Aim), Job::Aim(_) | Job::Profile(_)) => Stage::Arm(Arm::Watch),
            (Stage::Arm(Arm::Watch), Job::SetWatchdog(_)) => Stage::Arm(Arm::Torque),
            (Stage::Arm(Arm::Torque), Job::Torque(true)) => self.armed(now),
            (Stage::Held { .. }, Job::Stay) => {
                Stage::Held { told: self.reading.map(|(_, reading)| (now, reading.position_rad)) }
            }

            (Stage::Following, Job::Profile(_)) => {
                self.is_quick = true;
                Stage::Following
            }
            (Stage::Failed { cause, .. }, Job::Torque(false)) => {
                let Stage::Failed { reboot_at, .. } = self.stage else { return };
                Stage::Failed { cause, release_at: None, reboot_at }
            }
            (_, Job::Look) => return self.looked_at(now, answer),
            (stage, _) => stage,
        };
    }

    /// Takes what came to a question that one servo answers; whether it is sure now that there are
    /// two.
    pub(crate) fn doubted(&mut self, now: Instant, came: Came) -> bool {
        let Stage::Doubt(mut doubt) = self.stage else { return false };
        let verdict = doubt.note(came);
        self.stage = Stage::Doubt(doubt);
        if verdict == Some(false) {
            self.quarantine(now, JointCause::Silent);
        }
        verdict == Some(true)
    }

    /// Asks whether its servo is there. One that shall be limp is told so as well: it may hear what it does not
    /// answer.
    fn call(&mut self) -> Job {
        if !(self.shall_be_limp && self.may_have_torque) {
            return Job::Ping;
        }
        // If it comes back without torque, it has not begun anew.
        self.had_torque = false;
        Job::LetGo
    }

    fn identified(&mut self, answer: &[u8]) -> Stage {
        let expected = self.model.number();
        let found = answer.first_chunk().map_or(0, |number| u16::from_le_bytes(*number));
        if found == expected {
            self.is_fast = answer.get(2).is_some_and(|firmware| self.model.knows_fast_reads(*firmware));
            return Stage::Inspect;
        }
        self.fail(JointCause::Refused, Trouble::Model { expected, found });
        self.stage
    }

    fn armed(&mut self, now: Instant) -> Stage {
        // It begins where it stands now, and not where it was to stand when torque came on.
        let Some(position_rad) = self.standing(now) else { return self.stage };
        self.motion = Motion::at(position_rad);
        self.returns = self.is_far_from(position_rad);
        self.is_quick = false;
        self.cause = JointCause::None;
        self.restarted = false;
        self.following_since = now;
        Stage::Following
    }

    /// Has its servo begin anew. It counts as done, whatever is answered: whoever did not hear it says its
    /// alert once more when it is asked who it is, and whose answer was lost must not be told twice.
    fn reboot(&mut self, now: Instant) -> Job {
        self.reboots += 1;
        self.trouble = None;
        self.cause = JointCause::Alert;
        // Its group waits until it follows again.
        self.restarted = true;
        self.clock.forget();
        self.stage = Stage::Absent { ask_at: now + REBOOT_WAIT };
        Job::Reboot
    }
}

/// A profile in counts: of acceleration and of velocity. Zero would mean without limit.
fn profile(acceleration_rad_s2: f64, velocity_rad_s: f64) -> [i32; 2] {
    let bounded = |count: i32| count.clamp(1, 32_767);
    [bounded(acceleration_count(acceleration_rad_s2)), bounded(velocity_count(velocity_rad_s))]
}
