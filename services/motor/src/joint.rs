mod answers;
mod arming;
mod arming_state;
mod link;
mod motion;
mod policy;
mod power;
mod rise;
mod state;
mod steer;

#[cfg(test)]
pub(crate) use answers::MAX_REBOOTS;
use clock::{Duration, Instant};
use config::leo::AlertReaction;
use invariant::invariant;
use message::JointCause;
use servo::{Id, Reading, position_count};

pub(crate) use arming_state::{ArmingState, Disarming, is_own_fault};
pub(crate) use link::{Link, Setup};
pub(crate) use motion::Motion;
pub(crate) use policy::Policy;
use power::RefusedPwm;
pub(crate) use power::{Power, PowerUpStep};
pub(crate) use steer::Command;

use crate::JointFault;
use crate::counts::FaultCounters;
use crate::job::{ServoLimits, Supply, Watchdog};
use crate::notice::Notices;
use crate::servo_clock::ServoClock;

/// First waiting time after a servo is quarantined.
const MIN_WAIT: Duration = Duration::from_millis(100);
/// Maximum age of a reading that is used as the current position.
const MAX_READING_AGE: Duration = Duration::from_millis(100);
/// Highest plausible velocity of a joint, by motor or by hand, and largest plausible position error of a reading.
const MAX_SPEED_RAD_S: f64 = 30.0;
const MAX_JUMP_RAD: f64 = 0.1;
/// Highest velocity of a servo that counts as standing (two counts), and largest distance from where it was told to
/// stay.
const STILL_RAD_S: f64 = 0.05;
const STAYS_RAD: f64 = 0.05;
/// Period of the condition reads.
const CONDITION_PERIOD: Duration = Duration::from_millis(500);
/// How long a servo does not respond after a reboot instruction.
const REBOOT_WAIT: Duration = Duration::from_millis(500);
/// How long the last setpoint of a motion is repeated before sending stops.
const SETTLE: Duration = Duration::from_millis(40);

#[derive(Clone, Copy, Debug)]
struct Goal {
    position_rad: f64,
    arrive_at: Instant,
    /// Decision time. A goal expires after the command timeout.
    decided_at: Instant,
}

/// Inputs that are equal for the whole body in a cycle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BodyState {
    /// Whether commands arrive.
    pub(crate) live: bool,
    /// Why the joint must not move although it could: another joint failed, or a bus is lost.
    pub(crate) halt: Option<JointCause>,
    /// Whether a bus is lost. No torque comes on meanwhile.
    pub(crate) body_stopped: bool,
    /// Whether commands have been absent so long that all torque goes off.
    pub(crate) limp: bool,
    /// Whether the emergency stop is active.
    pub(crate) is_emergency: bool,
}

/// Quality of the communication with a joint's servo.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkQuality {
    /// Consecutive missing answers, and corrupt ones among them.
    pub(crate) timeouts: u32,
    corrupt: u32,
    /// Consecutive writes without acknowledgement, although reads may succeed.
    unacknowledged: u32,
    /// Consecutive rejected readings.
    rejected_readings: u32,
    /// Set after too many rejected readings: until when readings must be accepted before the joint may move.
    trusted_at: Option<Instant>,
    /// Waiting time at the next quarantine.
    wait: Duration,
    /// Whether its firmware supports fast sync reads.
    pub(crate) is_fast: bool,
}

/// One joint and its servo: four state machines, and the known state of the servo. Positions are in the joint's frame
/// unless stated otherwise.
///
/// A joint moves only if its link answers, this process has switched its torque on, and it is armed:
/// [`may_move`](Self::may_move). Switching torque on includes arming the servo's bus watchdog.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) settings: config::motor::Joint,
    policy: Policy,
    index: u32,
    pub(crate) id: Id,
    /// Upper bound that its group sets on the reaction to an alert, in the order limp, hold, lower.
    max_reaction: AlertReaction,

    link: Link,
    power: Power,
    arming: ArmingState,
    motion: Motion,

    /// Inputs of the current cycle.
    body_state: BodyState,
    /// Why torque is switched off for the whole body, if it is.
    pub(crate) let_go: Option<JointCause>,
    goal: Option<Goal>,

    pub(crate) contact: LinkQuality,
    clock: ServoClock,
    /// Newest reading, and when it was requested.
    pub(crate) reading: Option<(Instant, Reading)>,
    supply: Option<Supply>,
    bounds: Option<ServoLimits>,
    /// Position limits that its servo was found with at the newest inspection, in counts.
    limits_found: Option<(i32, i32)>,
    condition_due_at: Instant,

    /// The profile velocity last written to the servo, in counts, and when.
    sent_velocity: Option<(i32, Instant)>,
    /// Since when the tracking error has been at its bound.
    behind_since: Option<Instant>,
    /// Whether the speed is derated; with hysteresis.
    is_derated: bool,
    /// Consecutive refusals of the goal that precedes torque on.
    refused_goals: u32,
    /// State of the last write of goal PWM.
    refused_pwm: RefusedPwm,
    /// Number of the order that armed the joint last.
    order: u64,
    /// Number of the newest order, and of the newest order given while its servo did not answer. The latter does not
    /// arm the joint.
    newest_order: u64,
    missed_order: u64,
    /// Reaction to the current hardware alert, if there is one.
    reaction: Option<AlertReaction>,
    /// When torque goes off after an alert, if the joint does not move.
    cut_at: Option<Instant>,
    /// When the servo is rebooted, and how often it has been.
    reboot_at: Option<Instant>,
    reboots: u32,

    /// Why the joint failed, if it did.
    pub(crate) trouble: Option<JointFault>,
    /// Whether the operator has acknowledged that the servo had the limits of another joint, so that they are
    /// overwritten.
    pub(crate) are_limits_acknowledged: bool,
    /// Notices for the operator.
    pub(crate) notices: Notices,
    pub(crate) fault_counters: FaultCounters,
    /// Times that the joint moved without permission, and was stopped. Not zero only after a programming error.
    pub(crate) violations: u64,
}

impl Joint {
    pub(crate) fn new(
        index: u32,
        id: Id,
        settings: &config::motor::Joint,
        policy: Policy,
        max_reaction: AlertReaction,
    ) -> Self {
        Self {
            settings: settings.clone(),
            policy,
            index,
            id,
            max_reaction,
            link: Link::Unknown,
            power: Power::Unknown { was_on: false },
            arming: ArmingState::Disarmed { cause: JointCause::NotStarted },
            motion: Motion::Idle,
            body_state: BodyState::default(),
            let_go: None,
            goal: None,
            contact: LinkQuality {
                timeouts: 0,
                corrupt: 0,
                unacknowledged: 0,
                rejected_readings: 0,
                trusted_at: None,
                wait: MIN_WAIT,
                is_fast: false,
            },
            clock: ServoClock::default(),
            reading: None,
            supply: None,
            bounds: None,
            limits_found: None,
            condition_due_at: Instant::EPOCH,
            sent_velocity: None,
            behind_since: None,
            is_derated: false,
            refused_goals: 0,
            refused_pwm: RefusedPwm::No,
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
            fault_counters: FaultCounters::default(),
            violations: 0,
        }
    }

    pub(crate) const fn is_absent(&self) -> bool {
        self.link.is_quarantined() || self.is_unproven()
    }

    /// Whether the servo answers again but its readings are not trusted yet. It gets no torque.
    const fn is_unproven(&self) -> bool {
        self.contact.trusted_at.is_some()
    }

    /// Whether the joint is on its way to have torque, so that the next group waits for it.
    pub(crate) fn is_powering_up(&self) -> bool {
        if self.let_go.is_some() || self.is_absent() || self.arming.is_locked() {
            return false;
        }
        match self.link {
            Link::Unknown | Link::Identified(_) => true,
            Link::Answering => self.arming.is_given() && !self.power.is_on(),
            Link::Silent { .. } | Link::Corrupt(_) => false,
        }
    }

    /// Whether the servo has not been fully identified and inspected yet.
    pub(crate) fn is_unsettled(&self) -> bool {
        let is_known = self.power.is_on() || self.clock.is_known();
        !self.arming.is_locked()
            && (self.link.is_unsettled() || (matches!(self.link, Link::Answering) && !is_known))
    }

    /// Whether its position is read in every cycle.
    pub(crate) fn is_read(&self) -> bool {
        if self.let_go.is_some() {
            self.has_confirmed_torque_off()
        } else {
            matches!(self.link, Link::Answering)
        }
    }

    /// Whether the joint stops others: those of its group, and of the groups that it carries. It has failed, does not
    /// answer, or has not recovered since.
    pub(crate) fn stops_group(&self) -> bool {
        match self.arming {
            _ if self.is_absent() || self.arming.ending().is_some_and(|ending| ending.locks) => true,
            ArmingState::Locked { .. } => true,
            ArmingState::Disarmed { cause } => is_own_fault(cause),
            ArmingState::Armed { after, .. } => is_own_fault(after) && !self.power.is_on(),
        }
    }

    /// Whether it moves by command, or returns to its limits.
    pub(crate) fn is_moving(&self) -> bool {
        let goes_by_itself = matches!(self.motion, Motion::Align { .. })
            || (matches!(self.motion, Motion::Stay { .. }) && !self.stays());
        goes_by_itself || self.motion.setpoint().is_some_and(|at| at.velocity_rad_s.abs() > 0.0)
    }

    /// Whether the servo has confirmed torque off since it was told so.
    pub(crate) fn has_confirmed_torque_off(&self) -> bool {
        self.let_go.is_some() && matches!(self.power, Power::Off)
    }

    /// Whether it may move: required in every state of motion but idle.
    pub(crate) fn may_move(&self) -> bool {
        matches!(self.link, Link::Answering)
            && self.power.is_on()
            && self.arming.is_armed()
            && self.let_go.is_none()
    }

    /// Sets the goal position. A goal beyond the joint's limits is clamped. Returns whether it was within the limits;
    /// `None` for a goal that is not finite.
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

    /// Advances the joint to `now`, `dt_s` seconds after the last cycle.
    pub(crate) fn step(&mut self, now: Instant, dt_s: f64, body_state: BodyState) {
        self.body_state = body_state;
        if !body_state.live || body_state.halt.is_some() || !self.arming.is_given() {
            self.goal = None;
        }
        // A decision time in the future (a wrong clock of the commander) would never expire.
        if let Some(goal) = &mut self.goal {
            goal.decided_at = goal.decided_at.min(now);
        }
        self.goal = self
            .goal
            .filter(|goal| now.since(goal.decided_at) <= self.policy.settings.command_timeout_ms.duration());
        if self.let_go.is_some() {
            return;
        }
        if body_state.limp {
            self.release(now);
        }
        self.update_arming(now);
        self.conduct(now);
        if dt_s > 0.0 {
            self.steer(now, dt_s);
        }
        self.guard();
    }

    /// Stops a motion without permission. This is a programming error, and is counted.
    fn guard(&mut self) {
        let is_right = self.motion == Motion::Idle || self.may_move();
        if !invariant!(is_right, "joint {} moves without being allowed to: {self:?}", self.index) {
            self.violations += 1;
            self.motion = Motion::Idle;
        }
    }

    /// Switches torque off together with the whole body, in any state.
    pub(crate) fn let_go(&mut self, now: Instant, cause: JointCause) {
        if self.let_go.is_none() {
            self.switch_torque_off(now);
            self.disarm(cause);
        }
        self.let_go = Some(cause);
    }

    /// Processes the servo's torque enable after the whole body was switched off.
    pub(crate) fn confirm(&mut self, now: Instant, torque: u8) {
        self.contact.timeouts = 0;
        if self.let_go.is_some() {
            self.power = if torque == 0 { Power::Off } else { Power::Cutting { tell_at: now } };
        }
    }

    /// Reverts [`let_go`](Self::let_go): the servo is identified again. The joint does not move before it is armed.
    pub(crate) fn end_let_go(&mut self) {
        if self.let_go.take().is_some() {
            (self.contact.timeouts, self.contact.corrupt, self.contact.unacknowledged) = (0, 0, 0);
            (self.contact.rejected_readings, self.contact.trusted_at, self.contact.wait) =
                (0, None, MIN_WAIT);
            self.begin_anew();
        }
    }

    /// Distance beyond its limits, in radians; `None` without a recent reading.
    fn beyond_rad(&self, now: Instant) -> Option<f64> {
        let (at, reading) = self.reading?;
        let within = self.clamped(reading.position_rad)?;
        (now.since(at) <= MAX_READING_AGE).then_some((reading.position_rad - within).abs())
    }

    /// Whether the joint can have moved here from its previous reading. One in 65536 answers with random bytes has a
    /// valid check sum.
    fn is_plausible(&self, at: Instant, position_rad: f64) -> bool {
        self.reading.is_none_or(|(before, reading)| {
            let reach_rad = MAX_SPEED_RAD_S * at.since(before).as_secs_f64() + MAX_JUMP_RAD;
            (position_rad - reading.position_rad).abs() <= reach_rad
        })
    }

    fn clamped(&self, position_rad: f64) -> Option<f64> {
        // `f64::clamp` passes NaN on, and NaN must never reach a servo.
        position_rad.is_finite().then(|| position_rad.clamp(self.settings.min_rad, self.settings.max_rad))
    }

    /// Position clamped to its limits; `None` without a recent reading.
    fn standing(&self, now: Instant) -> Option<f64> {
        let (at, reading) = self.reading?;
        if now.since(at) <= MAX_READING_AGE { self.clamped(reading.position_rad) } else { None }
    }

    /// Whether a reading has confirmed that the servo stands where it was told to stay.
    fn stays(&self) -> bool {
        let ordered = match (self.motion, self.power) {
            (Motion::Stay { ordered }, _) | (_, Power::Found { stay: ordered, .. }) => ordered,
            _ => None,
        };
        ordered.zip(self.reading).is_some_and(|((ordered_at, stood_rad), (at, reading))| {
            let is_there = (reading.position_rad - stood_rad).abs() <= STAYS_RAD;
            at >= ordered_at && reading.velocity_rad_s.abs() <= STILL_RAD_S && is_there
        })
    }

    /// Whether the last reading is far from this position; true without a reading.
    fn is_far_from(&self, position_rad: f64) -> bool {
        self.reading.is_none_or(|(_, reading)| (reading.position_rad - position_rad).abs() > MAX_JUMP_RAD)
    }

    /// Whether the last reading shows motion beyond its limits.
    fn comes_back(&self) -> bool {
        self.reading.is_some_and(|(_, reading)| {
            let limit_rad = self.clamped(reading.position_rad);
            reading.velocity_rad_s.abs() > STILL_RAD_S
                && limit_rad.is_some_and(|limit_rad| self.is_far_from(limit_rad))
        })
    }

    /// Position limits of its servo, in counts.
    pub(crate) fn limit_counts(&self) -> (i32, i32) {
        let one = position_count(self.settings.servo_rad(self.settings.min_rad));
        let other = position_count(self.settings.servo_rad(self.settings.max_rad));
        (one.min(other), one.max(other))
    }
}
