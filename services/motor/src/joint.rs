mod answers;
mod arming;
mod licence;
mod link;
mod motion;
mod policy;
mod power;
mod rise;
mod state;
mod steer;

#[cfg(test)]
pub(crate) use answers::REBOOTS_MOST;
use clock::{Duration, Instant};
use config::leo::AlertReaction;
use message::JointCause;
use servo::{Id, Model, Reading, position_count};

pub(crate) use licence::{Ending, Licence, is_own_fault};
pub(crate) use link::{Link, Setup};
pub(crate) use motion::Motion;
pub(crate) use policy::Policy;
use power::RefusedDuty;
pub(crate) use power::{Power, Rise, Watchdog};
pub(crate) use steer::Command;

use crate::job::{Bounds, Condition};
use crate::notice::Notices;
use crate::servo_clock::ServoClock;
use crate::{Incidents, Trouble};

/// How long a servo that is quarantined is left alone at first.
const WAIT_FIRST: Duration = Duration::from_millis(100);
/// The oldest reading that says where a servo stands.
const FRESH: Duration = Duration::from_millis(100);
/// No servo turns faster, by its motor or by anybody's hand, and no reading is off by more.
const SPEED_MOST_RAD_S: f64 = 30.0;
const JUMP_MOST_RAD: f64 = 0.1;
/// A servo that turns no faster stands: two counts of velocity. One that was told to stay is no further from there.
const STILL_RAD_S: f64 = 0.05;
const STAYS_RAD: f64 = 0.05;
/// How often it is looked how a servo is.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// How long a servo hears nothing after it was told to begin anew.
const REBOOT_WAIT: Duration = Duration::from_millis(500);
/// How long the last command of a motion is repeated before no more is sent.
const SETTLE: Duration = Duration::from_millis(40);

#[derive(Clone, Copy, Debug)]
struct Goal {
    position_rad: f64,
    arrive_at: Instant,
    /// When it was decided: a goal is good for the command time-out.
    decided_at: Instant,
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

/// What holds for the whole body in a cycle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Orders {
    /// Whether there is a commander.
    pub(crate) live: bool,
    /// Why the joint must not move although it could: another joint failed, or a bus is lost.
    pub(crate) halt: Option<JointCause>,
    /// Whether a bus is lost: no torque comes on then.
    pub(crate) body_stopped: bool,
    /// Whether no commander has been there for so long that no servo shall have torque.
    pub(crate) limp: bool,
    /// Whether the emergency stop is raised.
    pub(crate) is_emergency: bool,
}

/// How the servo of a joint answers.
#[derive(Clone, Copy, Debug)]
struct Contact {
    /// Times in a row that it was silent, and that its answer was broken.
    misses: u32,
    corrupt: u32,
    /// Times in a row that it did not acknowledge what it was told, though it may be read.
    unacknowledged: u32,
    /// Readings in a row that were not believed.
    rejected: u32,
    /// Until when its readings must be believed before it may move, where they were not for long.
    trusted_at: Option<Instant>,
    /// How long it is left alone when it falls silent the next time.
    wait: Duration,
    /// Whether its firmware knows the fast reads.
    is_fast: bool,
}

/// One joint with its servo: four state machines, and what is known of the servo. Positions are the joint's own unless
/// they say otherwise.
///
/// A joint moves only where its link answers, its power is on by its own doing (which arms the servo's bus watchdog)
/// and its licence is armed: [`may_move`](Self::may_move).
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    settings: config::motor::Joint,
    policy: Policy,
    index: u32,
    id: Id,
    model: Model,
    /// What its group does at most after an alert.
    reaction_most: AlertReaction,

    link: Link,
    power: Power,
    licence: Licence,
    motion: Motion,

    /// What holds for the whole body.
    orders: Orders,
    /// Why the torque of the whole body is switched off, if it is.
    let_go: Option<JointCause>,
    goal: Option<Goal>,

    contact: Contact,
    clock: ServoClock,
    reading: Option<(Instant, Reading)>,
    condition: Option<Condition>,
    bounds: Option<Bounds>,
    look_at: Instant,

    /// The velocity of the profile that its servo was told last, in counts, and when.
    told: Option<(i32, Instant)>,
    /// Since when it has been further from its command than it may be.
    behind_since: Option<Instant>,
    /// Whether it is spared: what is spared is so until it is well beyond the bound.
    is_spared: bool,
    /// Times in a row that its servo refused the goal with which torque comes on.
    refused_aims: u32,
    /// Whether its servo refused the duty that it was told last.
    refused_duty: RefusedDuty,
    /// The number of the order that armed it last.
    order: u64,
    /// The number of the newest order, and of the newest that was given while its servo did not answer: that one does not
    /// arm it.
    newest_order: u64,
    missed_order: u64,
    /// What is done about its hardware alert, while it has one.
    reaction: Option<AlertReaction>,
    /// When its torque goes off after an alert, where it does not move.
    cut_at: Option<Instant>,
    /// When its servo is told to begin anew, and how often it was.
    reboot_at: Option<Instant>,
    reboots: u32,

    trouble: Option<Trouble>,
    /// Whether a person knows that its servo had the limits of another joint, and has them overwritten.
    are_limits_acknowledged: bool,
    notices: Notices,
    /// What befell its servo since its bus has counted it last.
    incidents: Incidents,
    /// Times that it moved without being allowed to, and was stopped: none, unless this program is wrong.
    violations: u64,
}

impl Joint {
    pub(crate) fn new(
        index: u32,
        id: Id,
        settings: &config::motor::Joint,
        policy: Policy,
        reaction_most: AlertReaction,
    ) -> Self {
        Self {
            settings: settings.clone(),
            policy,
            index,
            id,
            model: settings.model.into(),
            reaction_most,
            link: Link::Unknown,
            power: Power::Unknown { was_on: false },
            licence: Licence::Disarmed { cause: JointCause::NotStarted },
            motion: Motion::Idle,
            orders: Orders::default(),
            let_go: None,
            goal: None,
            contact: Contact {
                misses: 0,
                corrupt: 0,
                unacknowledged: 0,
                rejected: 0,
                trusted_at: None,
                wait: WAIT_FIRST,
                is_fast: false,
            },
            clock: ServoClock::default(),
            reading: None,
            condition: None,
            bounds: None,
            look_at: Instant::EPOCH,
            told: None,
            behind_since: None,
            is_spared: false,
            refused_aims: 0,
            refused_duty: RefusedDuty::No,
            order: 0,
            newest_order: 0,
            missed_order: 0,
            reaction: None,
            cut_at: None,
            reboot_at: None,
            reboots: 0,
            trouble: None,
            are_limits_acknowledged: false,
            notices: Notices::default(),
            incidents: Incidents::default(),
            violations: 0,
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

    pub(crate) const fn model(&self) -> Model {
        self.model
    }

    pub(crate) const fn trouble(&self) -> Option<Trouble> {
        self.trouble
    }

    pub(crate) const fn is_fast(&self) -> bool {
        self.contact.is_fast
    }

    pub(crate) const fn violations(&self) -> u64 {
        self.violations
    }

    #[cfg(test)]
    pub(crate) const fn reading(&self) -> Option<(Instant, Reading)> {
        self.reading
    }

    /// What befell its servo since this was asked last.
    pub(crate) fn take_incidents(&mut self) -> Incidents {
        std::mem::take(&mut self.incidents)
    }

    /// What people are to be told of its servo since this was asked last.
    pub(crate) fn take_notices(&mut self) -> Notices {
        std::mem::take(&mut self.notices)
    }

    /// Whether it was not heard when it was asked last.
    pub(crate) const fn is_suspect(&self) -> bool {
        self.contact.misses > 0
    }

    /// Whether it is quarantined.
    pub(crate) const fn is_absent(&self) -> bool {
        self.link.is_quarantined() || self.is_unproven()
    }

    /// Whether its servo answers again and is not believed yet: it gets no torque.
    const fn is_unproven(&self) -> bool {
        self.contact.trusted_at.is_some()
    }

    /// Whether its group's turn is not over: it is on its way to have torque.
    pub(crate) fn is_rising(&self) -> bool {
        if self.let_go.is_some() || self.is_absent() || self.licence.is_locked() {
            return false;
        }
        match self.link {
            Link::Unknown | Link::Identified(_) => true,
            Link::Answering => self.licence.is_given() && !self.power.is_on(),
            Link::Silent { .. } | Link::Doubted(_) => false,
        }
    }

    /// Whether it is not known yet that it is one servo, of which everything is as it should be.
    pub(crate) fn is_unsettled(&self) -> bool {
        let is_known = self.power.is_on() || self.clock.is_known();
        !self.licence.is_locked()
            && (self.link.is_unsettled() || (matches!(self.link, Link::Answering) && !is_known))
    }

    /// Whether its position is read in every cycle.
    pub(crate) fn is_read(&self) -> bool {
        if self.let_go.is_some() { self.has_let_go() } else { matches!(self.link, Link::Answering) }
    }

    /// Whether others must not move: those of its group, and of the groups that it carries. It failed, does not
    /// answer, or has not come back since.
    pub(crate) fn stops_group(&self) -> bool {
        match self.licence {
            _ if self.is_absent() || self.licence.ending().is_some_and(|ending| ending.locks) => true,
            Licence::Locked { .. } => true,
            Licence::Disarmed { cause } => is_own_fault(cause),
            Licence::Armed { after, .. } => is_own_fault(after) && !self.power.is_on(),
        }
    }

    /// Whether it moves by command, or on its way back within its limits.
    pub(crate) fn is_moving(&self) -> bool {
        let goes_by_itself = match self.motion {
            Motion::Stay { .. } => !self.stays(),
            Motion::Align { .. } => true,
            Motion::Idle
            | Motion::Soft { .. }
            | Motion::Track { .. }
            | Motion::Halt { .. }
            | Motion::Hold { .. }
            | Motion::Retreat { .. } => false,
        };
        goes_by_itself || self.motion.setpoint().is_some_and(|at| at.velocity_rad_s.abs() > 0.0)
    }

    /// Whether its servo has said that its torque is off, since it was told so.
    pub(crate) fn has_let_go(&self) -> bool {
        self.let_go.is_some() && matches!(self.power, Power::Off)
    }

    /// Whether it may move: the guard of every state of motion but idle.
    pub(crate) fn may_move(&self) -> bool {
        matches!(self.link, Link::Answering)
            && self.power.is_on()
            && self.licence.is_armed()
            && self.let_go.is_none()
    }

    /// Sets where it shall be; a goal beyond the joint's limits becomes the limit. `None` for a
    /// goal that is no number, otherwise whether it was within the limits.
    pub(crate) fn set_goal(
        &mut self,
        position_rad: f64,
        arrive_at: Instant,
        decided_at: Instant,
    ) -> Option<bool> {
        let within = self.clamped(position_rad)?;
        self.goal = Some(Goal { position_rad: within, arrive_at, decided_at });
        Some(position_rad.total_cmp(&within).is_eq())
    }

    /// Lives on to `now`, which is `dt_s` after the last cycle.
    pub(crate) fn step(&mut self, now: Instant, dt_s: f64, orders: Orders) {
        self.orders = orders;
        if !orders.live || orders.halt.is_some() || !self.licence.is_given() {
            self.goal = None;
        }
        // A commander's clock may be wrong, and a goal from the future would never grow old.
        if let Some(goal) = &mut self.goal {
            goal.decided_at = goal.decided_at.min(now);
        }
        self.goal = self.goal.filter(|goal| now.since(goal.decided_at) <= self.policy.command_timeout);
        if self.let_go.is_some() {
            return;
        }
        if orders.limp {
            self.release(now);
        }
        self.license(now);
        self.conduct(now);
        if dt_s > 0.0 {
            self.steer(now, dt_s);
        }
        self.guard();
    }

    /// Stops a motion that is not allowed. It is this program's own fault, and says so.
    fn guard(&mut self) {
        let is_wrong = self.motion != Motion::Idle && !self.may_move();
        debug_assert!(!is_wrong, "joint {} moves without being allowed to: {self:?}", self.index);
        if is_wrong {
            self.violations += 1;
            self.motion = Motion::Idle;
        }
    }

    /// Switches the torque off with that of the whole body, whatever it is doing.
    pub(crate) fn let_go(&mut self, now: Instant, cause: JointCause) {
        if self.let_go.is_none() {
            self.cut(now);
            self.disarm(cause);
        }
        self.let_go = Some(cause);
    }

    /// Notes what its servo says of its torque after the whole body was told to let go.
    pub(crate) fn confirm(&mut self, now: Instant, torque: u8) {
        self.contact.misses = 0;
        if self.let_go.is_some() {
            self.power = if torque == 0 { Power::Off } else { Power::Cutting { tell_at: now } };
        }
    }

    /// Ends what [`let_go`](Self::let_go) began: its servo is asked anew what it is. It does not move before it
    /// is armed.
    pub(crate) fn end_let_go(&mut self) {
        if self.let_go.take().is_some() {
            (self.contact.misses, self.contact.corrupt, self.contact.unacknowledged) = (0, 0, 0);
            (self.contact.rejected, self.contact.trusted_at, self.contact.wait) = (0, None, WAIT_FIRST);
            self.begin_anew();
        }
    }

    /// Begins anew, as if its servo had never been out of hand, and its limits never of another joint.
    #[cfg(test)]
    pub(crate) fn trust(&mut self) {
        self.are_limits_acknowledged = true;
        if self.is_absent() {
            self.let_go = Some(JointCause::Emergency);
            self.end_let_go();
        }
    }

    /// How far beyond its limits it stands, in radians; `None` where that is not known.
    fn beyond_rad(&self, now: Instant) -> Option<f64> {
        let (at, reading) = self.reading?;
        let within = self.clamped(reading.position_rad)?;
        (now.since(at) <= FRESH).then_some((reading.position_rad - within).abs())
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
        let told = match (self.motion, self.power) {
            (Motion::Stay { told }, _) | (_, Power::Found { stay: told, .. }) => told,
            _ => None,
        };
        told.zip(self.reading).is_some_and(|((told_at, stood_rad), (at, reading))| {
            let is_there = (reading.position_rad - stood_rad).abs() <= STAYS_RAD;
            at >= told_at && reading.velocity_rad_s.abs() <= STILL_RAD_S && is_there
        })
    }

    /// Whether it was read far from there.
    fn is_far_from(&self, position_rad: f64) -> bool {
        self.reading.is_none_or(|(_, reading)| (reading.position_rad - position_rad).abs() > JUMP_MOST_RAD)
    }

    /// Whether it was read to move beyond its limits.
    fn comes_back(&self) -> bool {
        self.reading.is_some_and(|(_, reading)| {
            let limit_rad = self.clamped(reading.position_rad);
            reading.velocity_rad_s.abs() > STILL_RAD_S
                && limit_rad.is_some_and(|limit_rad| self.is_far_from(limit_rad))
        })
    }

    /// The limits of its servo, in counts.
    pub(crate) fn limit_counts(&self) -> (i32, i32) {
        let one = position_count(self.settings.servo_rad(self.settings.min_rad));
        let other = position_count(self.settings.servo_rad(self.settings.max_rad));
        (one.min(other), one.max(other))
    }
}
