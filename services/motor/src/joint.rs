use clock::{Duration, Instant};
use message::{JointCause, JointMode, JointState};
use servo::{Id, Limits, Model, Motion, Reading, Status, acceleration_count, position_count, velocity_count};

use crate::job::{Condition, Job, is_configured};
use crate::stage::{Arm, Configure, Stage};

/// Times in a row that a servo may be silent before it is quarantined.
const MISSES_MOST: u32 = 3;
/// How long after that it is asked for the first time, and the longest wait between two times.
const WAIT_FIRST: Duration = Duration::from_millis(100);
const WAIT_MOST: Duration = Duration::from_secs(5);
/// The oldest reading that says where a servo stands.
const FRESH: Duration = Duration::from_millis(100);
/// The servo's own bus watchdog: 200 ms.
const WATCHDOG: u8 = 10;
/// The profile while torque comes on: slow, so that what is wrong is seen before it is fast.
const LOW_VELOCITY_RAD_S: f64 = 0.5;
const LOW_ACCELERATION_RAD_S2: f64 = 5.0;
/// How much faster than the joint the servo's own profile is in operation: enough to keep up
/// with commands that are smooth, and yet a limit.
const VELOCITY_MARGIN: f64 = 1.5;
const ACCELERATION_MARGIN: f64 = 8.0;

/// Why a joint failed, for people.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// Another servo than the configured one answers.
    #[error(
        "a servo of model number {found} answers, and {expected} is configured: correct motor.toml or the id"
    )]
    Model {
        /// The configured model's number.
        expected: u16,
        /// The number that was answered.
        found: u16,
    },
    /// The servo refused an instruction.
    #[error("{0}; torque stays off until the motor process starts anew")]
    Refused(servo::Fault),
    /// The servo reports a hardware alert.
    #[error(
        "hardware alert: see item 70 of the servo's control table; torque stays off until the motor process starts anew"
    )]
    Alert,
}

#[derive(Clone, Copy, Debug)]
struct Goal {
    position_rad: f64,
    arrive_at: Instant,
}

/// One joint with its servo. Positions are the joint's own unless they say otherwise.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    settings: config::motor::Joint,
    index: u32,
    id: Id,
    model: Model,
    stage: Stage,
    cause: JointCause,
    trouble: Option<Trouble>,
    misses: u32,
    motion: Motion,
    goal: Option<Goal>,
    reading: Option<(Instant, Reading)>,
}

impl Joint {
    pub(crate) fn new(index: u32, id: Id, settings: &config::motor::Joint) -> Self {
        let model = match settings.model {
            config::motor::Model::Xm430W350 => Model::Xm430W350,
            config::motor::Model::Xl330M288 => Model::Xl330M288,
        };
        Self {
            settings: settings.clone(),
            index,
            id,
            model,
            stage: Stage::Ask,
            cause: JointCause::NotStarted,
            trouble: None,
            misses: 0,
            motion: Motion::at(f64::NAN),
            goal: None,
            reading: None,
        }
    }

    pub(crate) const fn id(&self) -> Id {
        self.id
    }

    pub(crate) const fn bus(&self) -> usize {
        self.settings.bus
    }

    pub(crate) const fn group(&self) -> usize {
        self.settings.group
    }

    pub(crate) const fn trouble(&self) -> Option<Trouble> {
        self.trouble
    }

    /// Whether its group's turn is not over: it is on its way to have torque.
    pub(crate) const fn is_rising(&self) -> bool {
        match self.stage {
            Stage::Ask | Stage::Inspect | Stage::Configure(_) | Stage::Ready | Stage::Arm(_) => true,
            Stage::Absent { .. } | Stage::Following | Stage::Release | Stage::Failed { .. } => false,
        }
    }

    /// Whether its position is read in every cycle.
    pub(crate) const fn is_read(&self) -> bool {
        match self.stage {
            Stage::Ready | Stage::Arm(_) | Stage::Following | Stage::Release => true,
            Stage::Absent { .. }
            | Stage::Ask
            | Stage::Inspect
            | Stage::Configure(_)
            | Stage::Failed { .. } => false,
        }
    }

    /// Sets where it shall be; a goal beyond the joint's limits becomes the limit. `None` for a
    /// goal that is no number, otherwise whether it was within the limits.
    pub(crate) fn set_goal(&mut self, position_rad: f64, arrive_at: Instant) -> Option<bool> {
        let within = self.clamped(position_rad)?;
        self.goal = Some(Goal { position_rad: within, arrive_at });
        Some(position_rad.total_cmp(&within).is_eq())
    }

    /// Forgets where it should be.
    pub(crate) fn forget_goal(&mut self) {
        self.goal = None;
    }

    /// Moves the command on by `dt_s`: towards the goal, or to a stop without one.
    pub(crate) fn steer(&mut self, now: Instant, dt_s: f64) {
        if self.stage != Stage::Following {
            return;
        }
        let limits = Limits {
            velocity_rad_s: self.settings.velocity_rad_s,
            acceleration_rad_s2: self.settings.acceleration_rad_s2,
        };
        let next = match self.goal {
            Some(goal) => {
                let within_s = goal.arrive_at.since(now).as_secs_f64();
                let velocity_rad_s = self.motion.cruise(goal.position_rad, limits, within_s);
                self.motion.towards(goal.position_rad, Limits { velocity_rad_s, ..limits }, dt_s)
            }
            None => self.motion.stopping(limits, dt_s),
        };
        self.motion = next.unwrap_or(Motion { velocity_rad_s: 0.0, ..self.motion });
    }

    /// The goal position that its servo is given in this cycle, in counts.
    pub(crate) fn command_count(&self) -> Option<i32> {
        let within = self.clamped(self.motion.position_rad)?;
        (self.stage == Stage::Following).then(|| position_count(self.settings.servo_rad(within)))
    }

    /// Switches the torque off.
    pub(crate) fn release(&mut self) {
        if matches!(self.stage, Stage::Following | Stage::Arm(_)) {
            self.stage = Stage::Release;
            self.cause = JointCause::CommandTimeout;
        }
    }

    /// What its servo is to be told next on the way up or down, if anything.
    pub(crate) fn job(&mut self, now: Instant, may_arm: bool) -> Option<Job> {
        if self.stage == Stage::Ready && may_arm {
            self.stage = Stage::Arm(Arm::Clear);
        }
        match self.stage {
            Stage::Absent { ask_at, .. } => (now >= ask_at).then_some(Job::Ping),
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
                let goal = position_count(self.settings.servo_rad(self.standing(now)?));
                let [acceleration, velocity] = profile(LOW_ACCELERATION_RAD_S2, LOW_VELOCITY_RAD_S);
                Some(Job::Aim([acceleration, velocity, goal]))
            }
            Stage::Arm(Arm::Watch) => Some(Job::SetWatchdog(WATCHDOG)),
            Stage::Arm(Arm::Torque) => Some(Job::Torque(true)),
            Stage::Arm(Arm::Profile) => Some(Job::Profile(profile(
                self.settings.acceleration_rad_s2 * ACCELERATION_MARGIN,
                self.settings.velocity_rad_s * VELOCITY_MARGIN,
            ))),
            Stage::Failed { release_at, .. } => {
                release_at.filter(|at| now >= *at).map(|_| Job::Torque(false))
            }
            Stage::Ready | Stage::Following => None,
        }
    }

    /// Takes the position that was read in this cycle.
    pub(crate) fn read(&mut self, now: Instant, status: &Status<'_>) {
        self.misses = 0;
        if let Some(servo) = Reading::parse(self.model, status.params) {
            let turn = if self.settings.reversed { -1.0 } else { 1.0 };
            let position_rad = self.settings.joint_rad(servo.position_rad);
            let (velocity_rad_s, current_a) = (turn * servo.velocity_rad_s, turn * servo.current_a);
            self.reading = Some((now, Reading { current_a, velocity_rad_s, position_rad }));
        }
        self.judge(status);
    }

    /// Takes the answer to a job.
    pub(crate) fn answered(&mut self, now: Instant, job: Job, status: &Status<'_>) {
        self.misses = 0;
        if !self.judge(status) {
            if job == Job::Torque(false) && status.fault.is_none() {
                self.released();
            }
            return;
        }
        self.stage = match (self.stage, job) {
            (Stage::Ask | Stage::Absent { .. }, Job::Ping) => self.identified(status.params),
            (Stage::Inspect, Job::Inspect) => {
                let (min, max) = self.limit_counts();
                if is_configured(status.params, min, max) {
                    Stage::Ready
                } else {
                    Stage::Configure(Configure::Unlock)
                }
            }
            (Stage::Configure(Configure::Unlock), Job::Torque(false)) => Stage::Configure(Configure::Mode),
            (Stage::Configure(Configure::Mode), Job::SetMode) => Stage::Configure(Configure::Limits),
            (Stage::Configure(Configure::Limits), Job::SetLimits { .. })
            | (Stage::Release, Job::Torque(false)) => Stage::Ready,
            (Stage::Arm(Arm::Clear), Job::SetWatchdog(0)) => Stage::Arm(Arm::Aim),
            (Stage::Arm(Arm::Aim), Job::Aim(_)) => Stage::Arm(Arm::Watch),
            (Stage::Arm(Arm::Watch), Job::SetWatchdog(_)) => Stage::Arm(Arm::Torque),
            (Stage::Arm(Arm::Torque), Job::Torque(true)) => Stage::Arm(Arm::Profile),
            (Stage::Arm(Arm::Profile), Job::Profile(_)) => self.armed(now),
            (stage, Job::Look) => self.looked_at(stage, status.params),
            (stage, _) => stage,
        };
    }

    /// Notes that its servo was silent when it was asked.
    pub(crate) fn missed(&mut self, now: Instant) {
        if let Stage::Absent { wait, .. } = self.stage {
            self.stage = Stage::Absent { ask_at: now + wait, wait: (2 * wait).min(WAIT_MOST) };
            return;
        }
        self.misses += 1;
        if self.misses >= MISSES_MOST {
            self.quarantine(now, JointCause::Silent);
        }
    }

    /// Notes that its bus is lost.
    pub(crate) fn lost(&mut self, now: Instant) {
        self.quarantine(now, JointCause::BusLost);
    }

    /// What the joint does, for whoever looks; `live` says whether there is a commander.
    pub(crate) fn state(&self, live: bool) -> JointState {
        let resting = self.motion.velocity_rad_s.abs() <= 0.0;
        let (mode, cause) = match self.stage {
            Stage::Absent { .. } => (JointMode::Quarantined, self.cause),
            Stage::Ready if self.cause == JointCause::CommandTimeout => (JointMode::Limp, self.cause),
            Stage::Ask | Stage::Inspect | Stage::Configure(_) | Stage::Ready | Stage::Arm(_) => {
                (JointMode::Starting, self.cause)
            }
            Stage::Following if live => (JointMode::Following, JointCause::None),
            Stage::Following if resting => (JointMode::Holding, JointCause::CommandTimeout),
            Stage::Following => (JointMode::Decelerating, JointCause::CommandTimeout),
            Stage::Release => (JointMode::Holding, self.cause),
            Stage::Failed { cause, .. } => (JointMode::Limp, cause),
        };
        let mut state = JointState::unread(self.index, mode, cause);
        if let Some((at, reading)) = self.reading {
            let Reading { position_rad, velocity_rad_s, current_a } = reading;
            state = state.with_reading(at.as_nanos(), position_rad, velocity_rad_s, current_a);
        }
        if self.stage == Stage::Following { state.with_command(self.motion.position_rad) } else { state }
    }

    fn clamped(&self, position_rad: f64) -> Option<f64> {
        // `f64::clamp` passes NaN on, and NaN must never reach a servo.
        position_rad.is_finite().then(|| position_rad.clamp(self.settings.min_rad, self.settings.max_rad))
    }

    /// Where it stands, within its limits, if that is known.
    fn standing(&self, now: Instant) -> Option<f64> {
        let (at, reading) = self.reading?;
        if now.since(at) <= FRESH { self.clamped(reading.position_rad) } else { None }
    }

    /// The limits of its servo, in counts.
    fn limit_counts(&self) -> (i32, i32) {
        let one = position_count(self.settings.servo_rad(self.settings.min_rad));
        let other = position_count(self.settings.servo_rad(self.settings.max_rad));
        (one.min(other), one.max(other))
    }

    /// Lets the joint fail when its servo reports a fault or an alert; whether all is well.
    fn judge(&mut self, status: &Status<'_>) -> bool {
        let (cause, trouble) = match (status.fault, status.alert) {
            (Some(fault), _) => (JointCause::Refused, Trouble::Refused(fault)),
            (None, true) => (JointCause::Alert, Trouble::Alert),
            (None, false) => return true,
        };
        self.fail(cause, trouble);
        false
    }

    fn fail(&mut self, cause: JointCause, trouble: Trouble) {
        if !matches!(self.stage, Stage::Failed { .. }) {
            self.stage = Stage::Failed { cause, release_at: Some(Instant::EPOCH) };
            self.trouble = Some(trouble);
        }
    }

    fn released(&mut self) {
        if let Stage::Failed { release_at, .. } = &mut self.stage {
            *release_at = None;
        }
    }

    fn quarantine(&mut self, now: Instant, cause: JointCause) {
        self.misses = 0;
        self.cause = cause;
        self.goal = None;
        // A servo that failed stays failed also when it was away, and is told until it confirms.
        self.stage = if let Stage::Failed { cause, release_at } = self.stage {
            Stage::Failed { cause, release_at: release_at.map(|_| now + WAIT_FIRST) }
        } else {
            Stage::Absent { ask_at: now + WAIT_FIRST, wait: 2 * WAIT_FIRST }
        };
    }

    fn identified(&mut self, answer: &[u8]) -> Stage {
        let expected = self.model.number();
        let found = answer.first_chunk().map_or(0, |number| u16::from_le_bytes(*number));
        if found == expected {
            return Stage::Inspect;
        }
        self.fail(JointCause::Refused, Trouble::Model { expected, found });
        self.stage
    }

    fn armed(&mut self, now: Instant) -> Stage {
        // It begins where it stands now, and not where it was to stand when torque came on.
        let Some(position_rad) = self.standing(now) else { return self.stage };
        self.motion = Motion::at(position_rad);
        self.cause = JointCause::None;
        Stage::Following
    }

    fn looked_at(&mut self, stage: Stage, answer: &[u8]) -> Stage {
        let Some(condition) = Condition::parse(answer) else { return stage };
        if condition.has_error {
            self.fail(JointCause::Alert, Trouble::Alert);
            return self.stage;
        }
        if stage != Stage::Following {
            return stage;
        }
        if condition.watchdog_tripped {
            self.cause = JointCause::Watchdog;
            return Stage::Arm(Arm::Clear);
        }
        // Without torque it started anew by itself.
        if condition.has_torque { stage } else { Stage::Inspect }
    }
}

/// A profile in counts: of acceleration and of velocity. Zero would mean without limit.
fn profile(acceleration_rad_s2: f64, velocity_rad_s: f64) -> [i32; 2] {
    let bounded = |count: i32| count.clamp(1, 32_767);
    [bounded(acceleration_count(acceleration_rad_s2)), bounded(velocity_count(velocity_rad_s))]
}
