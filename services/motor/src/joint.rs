mod answers;
mod rise;

#[cfg(test)]
pub(crate) use answers::REBOOTS_MOST;
use clock::{Duration, Instant};
use config::leo::OnAlert;
use message::{JointCause, JointMode, JointState};
use servo::{Id, Limits, Model, Motion, Reading, position_count};

use crate::derating::derating;
use crate::job::{Bounds, Condition};
use crate::servo_clock::ServoClock;
use crate::stage::Stage;
use crate::{Incidents, Trouble};

/// How long a servo that is quarantined is left alone at first.
const WAIT_FIRST: Duration = Duration::from_millis(100);
/// The oldest reading that says where a servo stands.
const FRESH: Duration = Duration::from_millis(100);
/// No servo turns faster, by its motor or by anybody's hand, and no reading is off by more.
const SPEED_MOST_RAD_S: f64 = 30.0;
const JUMP_MOST_RAD: f64 = 0.1;
/// Who turns no faster stands: two counts of velocity. Who was told to stay is no further from there.
const STILL_RAD_S: f64 = 0.05;
const STAYS_RAD: f64 = 0.05;
/// How often it is looked how a servo is.
const LOOK_EVERY: Duration = Duration::from_millis(500);

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
    /// Readings in a row that were not believed.
    unbelieved: u32,
    /// Until when its readings must be believed before it may follow, where they were not for long.
    proven_at: Option<Instant>,
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
    /// Its servo may have torque although it does not follow: as long as nobody knows, it may.
    may_have_torque: bool,
    /// Its commander has been gone for so long that its servo shall have no torque.
    shall_be_limp: bool,
    /// It stood beyond its limits when torque came on, and comes back to them.
    returns: bool,
    /// Its servo has the profile of operation.
    is_quick: bool,
    reboots: u32,
    /// What befell its servo since its bus has counted it last.
    incidents: Incidents,
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
            unbelieved: 0,
            proven_at: None,
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
            may_have_torque: true,
            shall_be_limp: false,
            returns: false,
            is_quick: false,
            reboots: 0,
            incidents: Incidents::default(),
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

    /// What befell its servo since this was asked last.
    pub(crate) fn take_incidents(&mut self) -> Incidents {
        std::mem::take(&mut self.incidents)
    }

    /// Whether it was not heard when it was asked last.
    pub(crate) const fn is_suspect(&self) -> bool {
        self.misses > 0
    }

    /// Whether it is quarantined.
    pub(crate) fn is_absent(&self) -> bool {
        matches!(self.stage, Stage::Absent { .. }) || self.is_unproven()
    }

    /// Whether its servo answers again and is not believed yet: it gets no torque.
    fn is_unproven(&self) -> bool {
        let is_down = matches!(self.stage, Stage::Ask | Stage::Inspect | Stage::Configure(_) | Stage::Ready);
        is_down && self.proven_at.is_some()
    }

    /// Whether its group's turn is not over: it is on its way to have torque.
    pub(crate) fn is_rising(&self) -> bool {
        match self.stage {
            Stage::Ask | Stage::Inspect | Stage::Configure(_) | Stage::Ready | Stage::Arm(_) => {
                !self.is_unproven()
            }
            Stage::Held { told } => told.is_some() && self.halt.is_none(),
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
        (self.stage == Stage::Following && moves) || self.stage == Stage::Held { told: None }
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

    /// Switches the torque off where it shall be limp: its commander was gone for long.
    pub(crate) fn release(&mut self, shall_be_limp: bool) {
        self.shall_be_limp = shall_be_limp;
        let may_have_torque = matches!(self.stage, Stage::Following | Stage::Held { .. } | Stage::Arm(_))
            || (self.stage == Stage::Ready && self.may_have_torque);
        if shall_be_limp && may_have_torque {
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
    /// is where it stands. So it does where a motor process sent it there that is no more.
    pub(crate) fn stop_returning(&mut self) {
        let is_sent =
            self.stage == Stage::Following && self.returns && self.is_far_from(self.motion.position_rad);
        if is_sent || (self.stage == Stage::Ready && self.may_have_torque && self.comes_back()) {
            (self.returns, self.may_have_torque) = (false, true);
            self.stage = Stage::Held { told: None };
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

    /// What the joint does, for whoever looks; `live` says whether there is a commander.
    pub(crate) fn state(&self, live: bool) -> JointState {
        let pace = if self.motion.velocity_rad_s.abs() <= 0.0 {
            JointMode::Holding
        } else {
            JointMode::Decelerating
        };
        let (mode, cause) = match self.stage {
            Stage::Absent { .. } | Stage::Doubt(_) => (JointMode::Quarantined, self.cause),
            _ if self.is_unproven() => (JointMode::Quarantined, JointCause::Unbelieved),
            Stage::Ready if self.cause == JointCause::CommandTimeout && !self.may_have_torque => {
                (JointMode::Limp, self.cause)
            }
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
            Stage::Held { .. } => match self.halt.or((!live).then_some(JointCause::CommandTimeout)) {
                Some(cause) if self.stays() => (JointMode::Holding, cause),
                Some(cause) => (JointMode::Decelerating, cause),
                None => (JointMode::Starting, JointCause::NotStarted),
            },
            Stage::Release | Stage::LetGo { confirmed: false } => (JointMode::Releasing, self.cause),
            Stage::LetGo { confirmed: true } => (JointMode::Limp, self.cause),
            Stage::Failed { cause, release_at: Some(_), .. } => (JointMode::Releasing, cause),
            Stage::Failed { cause, release_at: None, .. } => (JointMode::Limp, cause),
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

    /// Whether it was read to stand since its servo was told to stay, and where it was told to.
    fn stays(&self) -> bool {
        let Stage::Held { told: Some((told_at, stood_rad)) } = self.stage else { return false };
        self.reading.is_some_and(|(at, reading)| {
            let is_there = (reading.position_rad - stood_rad).abs() <= STAYS_RAD;
            at >= told_at && reading.velocity_rad_s.abs() <= STILL_RAD_S && is_there
        })
    }

    /// Whether its servo has torque, and is to keep it.
    const fn keeps_torque(&self) -> bool {
        matches!(self.stage, Stage::Following | Stage::Held { .. })
    }

    /// Whether it was read far from there: its command began at its limit, and it stood beyond.
    fn is_far_from(&self, position_rad: f64) -> bool {
        self.reading.is_none_or(|(_, reading)| (reading.position_rad - position_rad).abs() > JUMP_MOST_RAD)
    }

    /// Whether it was read to move far beyond its limits.
    fn comes_back(&self) -> bool {
        self.reading.is_some_and(|(_, reading)| {
            let limit_rad = self.clamped(reading.position_rad);
            reading.velocity_rad_s.abs() > STILL_RAD_S
                && limit_rad.is_some_and(|limit_rad| self.is_far_from(limit_rad))
        })
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
}
