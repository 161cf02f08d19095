mod rise;

use clock::{Duration, Instant};
use config::leo::OnAlert;
use message::{JointCause, JointMode, JointState};
use servo::{Fault, HardwareErrors, Id, Limits, Model, Motion, Reading, Status, position_count};

use crate::Trouble;
use crate::derating::derating;
use crate::doubt::Doubt;
use crate::job::{Bounds, Condition, Job};
use crate::servo_clock::{Age, ServoClock};
use crate::stage::Stage;

/// Times in a row that a servo may be silent before it is quarantined.
const MISSES_MOST: u32 = 3;
/// How long after that it is asked for the first time, and the longest wait between two times.
const WAIT_FIRST: Duration = Duration::from_millis(100);
const WAIT_MOST: Duration = Duration::from_secs(5);
/// The oldest reading that says where a servo stands.
const FRESH: Duration = Duration::from_millis(100);
/// No servo turns faster, by its motor or by anybody's hand, and no reading is off by more.
const SPEED_MOST_RAD_S: f64 = 30.0;
const JUMP_MOST_RAD: f64 = 0.1;
/// Who turns no faster stands: two counts of velocity.
const STILL_RAD_S: f64 = 0.05;
/// How often it is looked how a servo is.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// How long after an alert a servo is rebooted, where the configuration says so, and how often.
const REBOOT_AFTER: Duration = Duration::from_secs(1);
pub(crate) const REBOOTS_MOST: u32 = 3;

/// What the configuration says of every joint alike.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Policy {
    pub(crate) soft_start: Duration,
    pub(crate) soft_start_rad_s: f64,
    pub(crate) on_alert: OnAlert,
}

#[derive(Clone, Copy, Debug)]
struct Goal {
    position_rad: f64,
    arrive_at: Instant,
}

/// What a joint made of a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Taken {
    /// It is the newest.
    Read,
    /// It was sampled before it was asked for.
    Stale,
    /// Whether it was is not known.
    Unproven,
}

/// One joint with its servo. Positions are the joint's own unless they say otherwise.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    settings: config::motor::Joint,
    policy: Policy,
    index: u32,
    id: Id,
    model: Model,
    stage: Stage,
    cause: JointCause,
    trouble: Option<Trouble>,
    /// Why it must not move now although it could.
    halt: Option<JointCause>,
    /// Times in a row that it was silent, and that its answer was broken.
    misses: u32,
    spoilt: u32,
    /// Times in a row that it did not acknowledge what it was told, though it may be read.
    unacknowledged: u32,
    /// How long it is left alone when it falls silent the next time.
    wait: Duration,
    motion: Motion,
    goal: Option<Goal>,
    reading: Option<(Instant, Reading)>,
    clock: ServoClock,
    /// Whether its firmware knows the fast reads.
    is_fast: bool,
    bounds: Option<Bounds>,
    condition: Option<Condition>,
    look_at: Instant,
    following_since: Instant,
    /// It started anew by itself, and does not follow again yet.
    restarted: bool,
    /// It followed when it fell silent: has it its torque still when it is back?
    had_torque: bool,
    /// Its servo may have torque although it does not follow.
    may_have_torque: bool,
    /// It stood beyond its limits when torque came on, and comes back to them.
    returns: bool,
    /// Its servo has the profile of operation.
    is_quick: bool,
    reboots: u32,
}

impl Joint {
    pub(crate) fn new(index: u32, id: Id, settings: &config::motor::Joint, policy: Policy) -> Self {
        Self {
            settings: settings.clone(),
            policy,
            index,
            id,
            model: settings.model.into(),
            stage: Stage::Ask,
            cause: JointCause::NotStarted,
            trouble: None,
            halt: None,
            misses: 0,
            spoilt: 0,
            unacknowledged: 0,
            wait: WAIT_FIRST,
            motion: Motion::at(f64::NAN),
            goal: None,
            reading: None,
            clock: ServoClock::default(),
            is_fast: false,
            bounds: None,
            condition: None,
            look_at: Instant::EPOCH,
            following_since: Instant::EPOCH,
            restarted: false,
            had_torque: false,
            may_have_torque: false,
            returns: false,
            is_quick: false,
            reboots: 0,
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

    pub(crate) const fn is_fast(&self) -> bool {
        self.is_fast
    }

    #[cfg(test)]
    pub(crate) const fn reading(&self) -> Option<(Instant, Reading)> {
        self.reading
    }

    /// Whether it was not heard when it was asked last.
    pub(crate) const fn is_suspect(&self) -> bool {
        self.misses > 0
    }

    /// Whether it is quarantined.
    pub(crate) const fn is_absent(&self) -> bool {
        matches!(self.stage, Stage::Absent { .. })
    }

    /// Whether its group's turn is not over: it is on its way to have torque.
    pub(crate) const fn is_rising(&self) -> bool {
        match self.stage {
            Stage::Ask | Stage::Inspect | Stage::Configure(_) | Stage::Ready | Stage::Arm(_) => true,
            Stage::Held { told_at } => told_at.is_some() && self.halt.is_none(),
            Stage::Absent { .. }
            | Stage::Doubt(_)
            | Stage::Following
            | Stage::Release
            | Stage::LetGo { .. }
            | Stage::Failed { .. } => false,
        }
    }

    /// Whether it is not known yet that it is one servo, of which everything is as it should be.
    pub(crate) const fn is_unsettled(&self) -> bool {
        match self.stage {
            Stage::Doubt(_) | Stage::Ask | Stage::Inspect | Stage::Configure(_) => true,
            Stage::Ready | Stage::Arm(_) => !self.clock.is_known(),
            Stage::Absent { .. }
            | Stage::Following
            | Stage::Held { .. }
            | Stage::Release
            | Stage::LetGo { .. }
            | Stage::Failed { .. } => false,
        }
    }

    /// Whether its position is read in every cycle.
    pub(crate) const fn is_read(&self) -> bool {
        match self.stage {
            Stage::Ready
            | Stage::Arm(_)
            | Stage::Following
            | Stage::Held { .. }
            | Stage::Release
            | Stage::LetGo { confirmed: true } => true,
            Stage::Absent { .. }
            | Stage::Doubt(_)
            | Stage::Ask
            | Stage::Inspect
            | Stage::Configure(_)
            | Stage::LetGo { confirmed: false }
            | Stage::Failed { .. } => false,
        }
    }

    /// Whether its group must not move: it lost its torque while the others have theirs.
    pub(crate) fn stops_group(&self) -> bool {
        self.restarted || matches!(self.stage, Stage::Failed { cause: JointCause::Alert, .. })
    }

    /// Whether it moves by command, or on its way back to its limits.
    pub(crate) fn is_moving(&self) -> bool {
        let moves = self.returns || self.motion.velocity_rad_s.abs() > 0.0;
        (self.stage == Stage::Following && moves) || self.stage == Stage::Held { told_at: None }
    }

    /// Whether its servo has said that its torque is off, since it was told so.
    pub(crate) fn has_let_go(&self) -> bool {
        self.stage == Stage::LetGo { confirmed: true }
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

    /// Says why it must not move, if so: goals are forgotten then.
    pub(crate) fn set_halt(&mut self, halt: Option<JointCause>) {
        self.halt = halt;
        if halt.is_some() {
            self.goal = None;
        }
    }

    /// Moves the command on by `dt_s`: towards the goal, or to a stop without one.
    pub(crate) fn steer(&mut self, now: Instant, dt_s: f64) {
        if self.stage != Stage::Following {
            return;
        }
        let stop = Limits {
            velocity_rad_s: self.settings.velocity_rad_s,
            acceleration_rad_s2: self.settings.acceleration_rad_s2,
        };
        if self.returns {
            if self.is_far_from(self.motion.position_rad) {
                return;
            }
            (self.returns, self.following_since) = (false, now);
        }
        let share = self.derating();
        // Until its servo has the profile of operation it could not keep up with more.
        let soft = !self.is_quick || now < self.following_since + self.policy.soft_start;
        let soft_rad_s = if soft { self.policy.soft_start_rad_s } else { f64::INFINITY };
        // The acceleration stays: with less of it, what moves already could not stop within its limits.
        let limits = Limits { velocity_rad_s: (stop.velocity_rad_s * share).min(soft_rad_s), ..stop };
        let next = match self.goal.filter(|_| share > 0.0) {
            Some(goal) => {
                let within_s = goal.arrive_at.since(now).as_secs_f64();
                let velocity_rad_s = self.motion.cruise(goal.position_rad, limits, within_s);
                self.motion.towards(goal.position_rad, Limits { velocity_rad_s, ..limits }, dt_s)
            }
            None => self.motion.stopping(stop, dt_s),
        };
        let next = next.unwrap_or(Motion { velocity_rad_s: 0.0, ..self.motion });
        // Steps of uneven length miss the goal by a hair, and the goal may be the limit.
        self.motion = match self.clamped(next.position_rad) {
            Some(within) if within.total_cmp(&next.position_rad).is_ne() => Motion::at(within),
            _ => next,
        };
    }

    /// The goal position that its servo is given in this cycle, in counts.
    pub(crate) fn command_count(&self) -> Option<i32> {
        let within = self.clamped(self.motion.position_rad)?;
        (self.stage == Stage::Following).then(|| position_count(self.settings.servo_rad(within)))
    }

    /// Switches the torque off, after its commander was gone for long.
    pub(crate) fn release(&mut self) {
        let may_have_torque = matches!(self.stage, Stage::Following | Stage::Held { .. } | Stage::Arm(_))
            || (self.stage == Stage::Ready && self.may_have_torque);
        if may_have_torque {
            self.stage = Stage::Release;
            self.cause = JointCause::CommandTimeout;
        }
    }

    /// Breaks off what has not come to torque yet: nobody commands, or the body stands still.
    pub(crate) fn stop_arming(&mut self) {
        if matches!(self.stage, Stage::Arm(_)) {
            self.stage = Stage::Ready;
        }
    }

    /// Stops it on its way back to its limits, which its servo goes by itself: no goal that it would take
    /// is where it stands.
    pub(crate) fn stop_returning(&mut self) {
        if self.stage == Stage::Following && self.returns && self.is_far_from(self.motion.position_rad) {
            (self.returns, self.may_have_torque) = (false, true);
            self.stage = Stage::Held { told_at: None };
        }
    }

    /// Switches the torque off with that of the whole body, whatever it is doing.
    pub(crate) fn let_go(&mut self, cause: JointCause) {
        if !matches!(self.stage, Stage::LetGo { .. }) {
            self.stage = Stage::LetGo { confirmed: false };
        }
        self.cause = cause;
        self.goal = None;
        self.motion = Motion::at(f64::NAN);
    }

    /// Notes what its servo says of its torque after it was told to let go.
    pub(crate) fn confirm(&mut self, torque: u8) {
        self.misses = 0;
        if let Stage::LetGo { confirmed } = &mut self.stage {
            *confirmed = torque == 0;
        }
    }

    /// Starts anew as if nothing had been: after an emergency stop was released.
    pub(crate) fn start_anew(&mut self) {
        let fresh = Self::new(self.index, self.id, &self.settings, self.policy);
        *self = Self { reading: self.reading, ..fresh };
    }

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
                    return Taken::Stale;
                }
                let turn = if self.settings.reversed { -1.0 } else { 1.0 };
                let (velocity_rad_s, current_a) = (turn * servo.velocity_rad_s, turn * servo.current_a);
                // It was sampled soon after it was asked for, whenever the answer was taken up.
                self.reading = Some((asked_at, Reading { current_a, velocity_rad_s, position_rad, ..servo }));
                (self.misses, self.spoilt) = (0, 0);
            }
        }
        // Noise with a right check sum says any fault as well. One that is there is in the next answer too.
        if taken == Taken::Read {
            self.judge(now, status);
        }
        taken
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

    /// What the joint does, for whoever looks; `live` says whether there is a commander.
    pub(crate) fn state(&self, live: bool) -> JointState {
        let pace = if self.motion.velocity_rad_s.abs() <= 0.0 {
            JointMode::Holding
        } else {
            JointMode::Decelerating
        };
        let (mode, cause) = match self.stage {
            Stage::Absent { .. } | Stage::Doubt(_) => (JointMode::Quarantined, self.cause),
            Stage::Ready if self.cause == JointCause::CommandTimeout => (JointMode::Limp, self.cause),
            Stage::Ask | Stage::Inspect | Stage::Configure(_) | Stage::Ready | Stage::Arm(_) => {
                (JointMode::Starting, self.cause)
            }
            Stage::Following => match self.halt {
                Some(cause) => (pace, cause),
                None if !live => (pace, JointCause::CommandTimeout),
                None if self.returns => (JointMode::Starting, JointCause::NotStarted),
                None if self.derating() < 1.0 => (JointMode::Following, JointCause::Derated),
                None => (JointMode::Following, JointCause::None),
            },
            Stage::Held { told_at } => match self.halt.or((!live).then_some(JointCause::CommandTimeout)) {
                Some(cause) if told_at.is_some() && self.is_still() => (JointMode::Holding, cause),
                Some(cause) => (JointMode::Decelerating, cause),
                None => (JointMode::Starting, JointCause::NotStarted),
            },
            Stage::Release | Stage::LetGo { confirmed: false } => (JointMode::Releasing, self.cause),
            Stage::LetGo { confirmed: true } => (JointMode::Limp, self.cause),
            Stage::Failed { cause, .. } => (JointMode::Limp, cause),
        };
        let mut state = JointState::unread(self.index, mode, cause);
        if let Some((at, reading)) = self.reading {
            let Reading { position_rad, velocity_rad_s, current_a, .. } = reading;
            state = state.with_reading(at.as_nanos(), position_rad, velocity_rad_s, current_a);
        }
        if let Some(condition) = self.condition {
            state = state.with_condition(condition.temperature_c, condition.input_v);
        }
        if self.stage == Stage::Following { state.with_command(self.motion.position_rad) } else { state }
    }

    /// Whether a joint can have come from where it was read before to here. One answer in 65536 whose
    /// bytes are noise has a right check sum all the same.
    fn is_plausible(&self, at: Instant, position_rad: f64) -> bool {
        self.reading.is_none_or(|(before, reading)| {
            let reach_rad = SPEED_MOST_RAD_S * at.since(before).as_secs_f64() + JUMP_MOST_RAD;
            (position_rad - reading.position_rad).abs() <= reach_rad
        })
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

    /// Whether it was read to stand.
    fn is_still(&self) -> bool {
        self.reading.is_some_and(|(_, reading)| reading.velocity_rad_s.abs() <= STILL_RAD_S)
    }

    /// Whether its servo has torque, and is to keep it.
    const fn keeps_torque(&self) -> bool {
        matches!(self.stage, Stage::Following | Stage::Held { .. })
    }

    /// Whether it was read far from there: its command began at its limit, and it stood beyond.
    fn is_far_from(&self, position_rad: f64) -> bool {
        self.reading.is_none_or(|(_, reading)| (reading.position_rad - position_rad).abs() > JUMP_MOST_RAD)
    }

    /// Whether its soft start is over and its servo still has the profile of it.
    fn is_eased_in(&self, now: Instant) -> bool {
        !self.is_quick && !self.returns && now >= self.following_since + self.policy.soft_start
    }

    /// The share of its speed that it is allowed.
    fn derating(&self) -> f64 {
        match (self.condition, self.bounds) {
            (Some(condition), Some(bounds)) => derating(condition, bounds, self.model.nominal_volts()),
            _ => 1.0,
        }
    }

    /// The limits of its servo, in counts.
    fn limit_counts(&self) -> (i32, i32) {
        let one = position_count(self.settings.servo_rad(self.settings.min_rad));
        let other = position_count(self.settings.servo_rad(self.settings.max_rad));
        (one.min(other), one.max(other))
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
        let reboots = self.policy.on_alert == OnAlert::Reboot && self.reboots < REBOOTS_MOST;
        self.trouble = Some(Trouble::Alert(errors));
        self.goal = None;
        self.stage = Stage::Failed {
            cause: JointCause::Alert,
            release_at: Some(now),
            reboot_at: reboots.then_some(now + REBOOT_AFTER),
        };
    }

    fn fail(&mut self, cause: JointCause, trouble: Trouble) {
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
            self.restarted = true;
            self.goal = None;
            self.cause = JointCause::Restarted;
            self.stage = Stage::Inspect;
        }
    }

    fn looked_at(&mut self, now: Instant, answer: &[u8]) {
        let Some(condition) = Condition::parse(answer) else { return };
        self.condition = Some(condition);
        if !condition.errors.is_none() {
            self.alert(now, condition.errors);
        } else if self.stage == Stage::Following && condition.watchdog_tripped {
            self.cause = JointCause::Watchdog;
            self.goal = None;
            self.stage = Stage::Arm(crate::stage::Arm::Clear);
        } else if self.keeps_torque() && !condition.has_torque {
            self.has_restarted();
        }
    }

    fn quarantine(&mut self, now: Instant, cause: JointCause) {
        (self.misses, self.spoilt, self.unacknowledged) = (0, 0, 0);
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
