use clock::{Duration, Instant};
use config::leo::{AlertReaction, StopCategory};
use config::motor::Device;
use invariant::{invariant, require};
use message::{BusHealth, JointCause, JointGoal, JointState};
use servo::Id;

use crate::bus::{Bus, Purpose};
use crate::counts::FaultCounters;
use crate::group_dependencies::group_dependencies;
use crate::joint::{BodyState, Joint, Policy};
use crate::request::MAX_SERVOS;
use crate::{JointFault, MotorCounters, Notice, Replies, Request};

/// Longest time step of the setpoints. After a longer pause the setpoints continue from where they were.
pub(crate) const MAX_STEP: Duration = Duration::from_millis(20);
/// How long an arming order stays valid. A joint without torque by then, that has not failed before, needs a new
/// order.
const ORDER_HOLDS: Duration = Duration::from_secs(10);
/// Longest duration of a category 1 stop. After it torque goes off even if joints still move.
const STOP_WITHIN: Duration = Duration::from_millis(750);

/// Errors of [`Motor::new`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MotorError {
    /// One bus has more servos than one cycle can serve.
    #[error(
        "bus `{bus}` has {servos} servos, and a cycle serves at most {MAX_SERVOS}: spread them over more buses"
    )]
    Crowded {
        /// The bus.
        bus: String,
        /// Its servos.
        servos: usize,
    },
    /// The identifier is outside the range of servo identifiers.
    #[error("joint `{joint}` has id {id}, and a servo's is from 0 to 252")]
    Id {
        /// The joint.
        joint: String,
        /// The identifier.
        id: u8,
    },
    /// The alert configuration names a group that motor.toml does not define.
    #[error(
        "there is no group `{group}` in motor.toml, and `groups` of [motor.alert] in leo.toml names it; there are \
         {known}"
    )]
    UnknownGroup {
        /// The group.
        group: String,
        /// The groups of motor.toml.
        known: String,
    },
}

/// The joints and their buses: goals in, one request per bus out, replies in, joint states out.
///
/// Pure: time is an argument. Nothing is allocated after [`new`](Self::new).
#[derive(Clone, Debug)]
pub struct Motor {
    pub(crate) joints: Vec<Joint>,
    buses: Vec<Bus>,
    policy: Policy,
    /// When the newest goals were decided.
    decided_at: Option<Instant>,
    /// Time of the first step, from which the limp timeout counts as long as no goals have arrived.
    no_commander_since: Option<Instant>,
    pub(crate) stepped_at: Option<Instant>,
    live: bool,
    /// Set once the commander is dismissed: when torque goes off even if joints still move.
    let_go_at: Option<Instant>,
    /// Why the torque of the whole body is switched off, if it is.
    letting_go: Option<JointCause>,
    /// Set while an emergency stop of category 1 or 2 is active: when torque goes off (category 1), or `None` to keep
    /// torque (category 2).
    stopping: Option<Option<Instant>>,
    /// End of the validity of the newest arming order.
    order_until: Option<Instant>,
    /// Number of arming orders so far, and how many locks the newest one acknowledges.
    order_count: u64,
    acknowledged: Option<u64>,
    /// By group, the groups whose failure stops it.
    group_dependencies: Vec<Vec<usize>>,
    /// By group, how many joints have a fault that stops others; by joint, whether it had one in the previous cycle.
    failing: Vec<u32>,
    was_failing: Vec<bool>,
    counts: MotorCounters,
}

impl Motor {
    /// Creates the robot. No servo has been identified yet.
    ///
    /// # Errors
    ///
    /// A bus has more servos than one cycle can serve, an identifier is out of range, or a configured group does not
    /// exist.
    pub fn new(robot: &config::motor::Motor, settings: &config::leo::Motor) -> Result<Self, MotorError> {
        let mut joints = Vec::with_capacity(robot.joints.len());
        let policy = Policy::new(settings, robot.buses.iter().all(|bus| bus.device == Device::Mock));
        let reactions = &settings.alert.groups;
        if let Some(group) = reactions.keys().find(|group| !robot.groups.contains(group)) {
            return Err(MotorError::UnknownGroup { group: group.clone(), known: robot.groups.join(", ") });
        }
        for (index, joint) in (0..).zip(&robot.joints) {
            let id = Id::new(joint.id)
                .ok_or_else(|| MotorError::Id { joint: joint.name.clone(), id: joint.id })?;
            let group = require!(robot.groups.get(joint.group), "joint `{}` has a group", joint.name);
            invariant!(joint.bus < robot.buses.len(), "joint `{}` has a bus", joint.name);
            let reaction = group.and_then(|group| reactions.get(group));
            let reaction = reaction.copied().unwrap_or(AlertReaction::Lower);
            joints.push(Joint::new(index, id, joint, policy.clone(), reaction));
        }
        let mut buses = Vec::with_capacity(robot.buses.len());
        for (number, bus) in robot.buses.iter().enumerate() {
            let on_bus: Vec<_> = (0..joints.len())
                .filter(|&index| joints.get(index).is_some_and(|joint| joint.settings.bus == number))
                .collect();
            if on_bus.len() > MAX_SERVOS {
                return Err(MotorError::Crowded { bus: bus.name.clone(), servos: on_bus.len() });
            }
            buses.push(Bus::new(on_bus, bus.device == Device::Mock));
        }
        Ok(Self {
            joints,
            buses,
            policy,
            decided_at: None,
            no_commander_since: None,
            stepped_at: None,
            live: false,
            let_go_at: None,
            letting_go: None,
            stopping: None,
            order_until: None,
            order_count: 0,
            acknowledged: None,
            group_dependencies: group_dependencies(robot.groups.len(), &[], &[]),
            failing: vec![0; robot.groups.len()],
            was_failing: vec![false; robot.joints.len()],
            counts: MotorCounters::default(),
        })
    }

    /// Adds the kinematic tree: `parents` gives, by joint index, the nearest joint that carries each joint. A failing
    /// joint also stops the groups that it carries.
    #[must_use]
    pub fn with_parents(mut self, parents: &[Option<usize>]) -> Self {
        let groups: Vec<usize> = self.joints.iter().map(|joint| joint.settings.group).collect();
        self.group_dependencies = group_dependencies(self.failing.len(), &groups, parents);
        self
    }

    /// Accepts a frame of goals that was decided at `decided_at`.
    ///
    /// A goal that is not finite, or for an unknown joint, is refused. A frame without any accepted goal is no sign
    /// of life, except an empty one. A decision time after the next [`step`](Self::step) is cut to the time of that
    /// step. A goal expires after the command timeout: a joint without a newer goal slows down and holds.
    pub fn goals(&mut self, decided_at: Instant, goals: &[JointGoal]) {
        let mut accepted = goals.is_empty();
        for goal in goals {
            let joint = usize::try_from(goal.joint).ok().and_then(|index| self.joints.get_mut(index));
            let arrive_at = Instant::from_nanos(goal.arrive_at_ns);
            match joint.and_then(|joint| joint.set_goal(goal.goal_position_rad, arrive_at, decided_at)) {
                Some(within) => {
                    accepted = true;
                    self.counts.limited += u64::from(!within);
                }
                None => self.counts.refused += 1,
            }
        }
        if accepted {
            self.decided_at = self.decided_at.max(Some(decided_at));
        }
    }

    /// Advances every setpoint to `now`. Without goals for the command timeout the joints slow down and hold; later
    /// their torque goes off.
    pub fn step(&mut self, now: Instant) {
        let settings = &self.policy.settings;
        let command_timeout = settings.command_timeout_ms.duration();
        let limp_after = settings.limp_after_ms.duration();
        let since = self.stepped_at.map_or(settings.rate_hz.period(), |before| now.since(before));
        let dt_s = since.min(MAX_STEP).as_secs_f64();
        self.stepped_at = Some(now);
        // A decision time in the future (a wrong clock of the commander) would never expire.
        self.decided_at = self.decided_at.map(|decided_at| decided_at.min(now));
        let no_commander_since = *self.no_commander_since.get_or_insert(now);
        let age = self.decided_at.map(|decided_at| now.since(decided_at));
        let is_stopping = self.let_go_at.is_some() || self.stopping.is_some();
        self.live = !is_stopping && age.is_some_and(|age| age <= command_timeout);
        // A servo found with its torque on keeps it as long as one whose commander stopped.
        let unled = age.unwrap_or_else(|| now.since(no_commander_since));
        let limp = !is_stopping && unled > command_timeout + limp_after;
        if self.let_go_at.is_some_and(|let_go_at| now >= let_go_at || !self.is_moving()) {
            self.let_go(JointCause::Stopped);
        }
        if let Some(Some(let_go_at)) = self.stopping
            && (now >= let_go_at || !self.is_moving())
        {
            self.let_go(JointCause::Emergency);
        }
        self.look_for_failures();
        let body_stopped = self.buses.iter().any(|bus| bus.is_lost);
        let is_emergency = self.stopping.is_some() || self.letting_go == Some(JointCause::Emergency);
        for joint in &mut self.joints {
            let others = self.group_dependencies.get(joint.settings.group).into_iter().flatten();
            let others = others.filter_map(|group| self.failing.get(*group));
            let group_stopped = others.sum::<u32>() > u32::from(joint.stops_group());
            let group_stopped = group_stopped.then_some(JointCause::GroupStopped);
            let halt = body_stopped.then_some(JointCause::BodyStopped).or(group_stopped);
            if let Some(cause) = self.letting_go {
                joint.let_go(now, cause);
            } else if self.stopping.is_some() {
                joint.end_by_emergency();
            }
            joint.step(now, dt_s, BodyState { live: self.live, halt, body_stopped, limp, is_emergency });
            if let Some(until) = self.order_until.filter(|until| now < *until) {
                if let Some(locks) = self.acknowledged {
                    joint.acknowledge(now, locks, false);
                }
                joint.arm(self.order_count, until);
            }
            self.counts.locks += u64::from(joint.count_lock(self.counts.locks));
        }
    }

    /// Counts the joints that stop others. A joint that has just failed cancels the arming order, which was given
    /// before the failure.
    fn look_for_failures(&mut self) {
        self.failing.fill(0);
        for (joint, was_failing) in self.joints.iter().zip(&mut self.was_failing) {
            let fails = joint.stops_group();
            if fails
                && let Some(failing) = require!(
                    self.failing.get_mut(joint.settings.group),
                    "group {} exists",
                    joint.settings.group
                )
            {
                *failing += 1;
            }
            if fails && !std::mem::replace(was_failing, fails) {
                self.order_until = None;
            }
            *was_failing = fails;
        }
    }

    /// Arms the joints by an operator's order, valid for ten seconds or until another joint fails. The joints come up
    /// group by group.
    ///
    /// A locked joint is unlocked if the cause is gone and the operator has seen its lock: it is among the first
    /// `acknowledged_locks` of [`MotorCounters::locks`]. A joint whose servo does not answer needs a new order:
    /// plugging in a cable starts nothing.
    pub fn arm(&mut self, now: Instant, acknowledged_locks: Option<u64>) {
        if self.letting_go.is_some() || self.stopping.is_some() {
            return;
        }
        if let Some(locks) = acknowledged_locks {
            self.joints.iter_mut().for_each(|joint| joint.acknowledge(now, locks, true));
        }
        self.acknowledged = acknowledged_locks;
        self.order_until = Some(now + ORDER_HOLDS);
        self.order_count += 1;
        self.joints.iter_mut().for_each(|joint| joint.note_order(self.order_count));
    }

    /// Stops the body by the configured stop category, until [`end_emergency`](Self::end_emergency).
    pub fn emergency_stop(&mut self, now: Instant) {
        self.order_until = None;
        match self.policy.settings.stop_category {
            StopCategory::Zero => self.let_go(JointCause::Emergency),
            StopCategory::One => _ = self.stopping.get_or_insert(Some(now + STOP_WITHIN)),
            StopCategory::Two => _ = self.stopping.get_or_insert(None),
        }
    }

    /// Ends an emergency stop. Nothing moves before joints are armed. Every servo is identified again.
    pub fn end_emergency(&mut self) {
        self.stopping = None;
        self.letting_go = None;
        self.decided_at = None;
        self.joints.iter_mut().for_each(Joint::end_let_go);
    }

    /// Whether the emergency stop is active, also while joints still decelerate.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stopping.is_some() || self.letting_go.is_some()
    }

    /// Switches torque off on every bus from the next request on. Goals have no effect until
    /// [`end_emergency`](Self::end_emergency). For an emergency stop; the orderly end is
    /// [`begin_shutdown`](Self::begin_shutdown).
    pub fn let_go(&mut self, cause: JointCause) {
        // An orderly end must not replace the emergency as the cause.
        if self.letting_go != Some(JointCause::Emergency) {
            self.letting_go = Some(cause);
        }
    }

    /// Why torque is switched off for the whole body, if it is.
    #[must_use]
    pub const fn letting_go(&self) -> Option<JointCause> {
        self.letting_go
    }

    fn is_moving(&self) -> bool {
        self.joints.iter().any(Joint::is_moving)
    }

    /// Number of servos that have not confirmed torque off since they were told so. During the orderly end, simulated
    /// servos on a lost bus do not count, because they have no torque.
    #[must_use]
    pub fn unconfirmed(&self) -> usize {
        let is_gone = |joint: &Joint| {
            let bus = self.buses.get(joint.settings.bus);
            self.let_go_at.is_some() && bus.is_some_and(|bus| bus.is_simulated && bus.is_lost)
        };
        self.joints.iter().filter(|joint| !joint.has_confirmed_torque_off() && !is_gone(joint)).count()
    }

    /// Starts the orderly end: goals are ignored and the joints slow down and hold. Torque goes off when nothing
    /// moves, or at `let_go_at` at the latest.
    pub fn begin_shutdown(&mut self, let_go_at: Instant) {
        self.let_go_at = Some(let_go_at);
    }

    /// Number of buses.
    #[must_use]
    pub const fn buses(&self) -> usize {
        self.buses.len()
    }

    /// Writes the request of a bus for this cycle. Torque comes on one group after the other, and only while commands
    /// arrive.
    pub fn request(&mut self, bus: usize, now: Instant, request: &mut Request) {
        let rising =
            self.joints.iter().filter(|joint| joint.is_powering_up()).map(|joint| joint.settings.group).min();
        let purpose = match self.letting_go {
            Some(_) => Purpose::TorqueOff,
            None => {
                let may_arm = self.live && !self.buses.iter().any(|bus| bus.is_lost);
                Purpose::Drive { arm_up_to: if may_arm { rising } else { None } }
            }
        };
        if let Some(bus) = require!(self.buses.get_mut(bus), "bus {bus} exists") {
            bus.plan(now, &mut self.joints, purpose, request);
        } else {
            // The last request must not go out again.
            request.clear();
        }
    }

    /// Processes the replies of a bus to its last request.
    pub fn replies(&mut self, bus: usize, now: Instant, replies: &Replies) {
        if let Some(bus) = require!(self.buses.get_mut(bus), "bus {bus} exists") {
            bus.process_replies(now, &mut self.joints, replies);
        }
        self.refuse_swapped(bus, now);
    }

    /// Locks servos of a bus that have the limits of another joint, before anything is written to their EEPROM.
    fn refuse_swapped(&mut self, bus: usize, now: Instant) {
        for index in 0..self.joints.len() {
            let Some(joint) = self.joints.get(index).filter(|joint| joint.settings.bus == bus) else {
                continue;
            };
            let Some(limits) = joint.foreign_limits() else { continue };
            let is_whose = |other: &Joint| {
                other.settings.model == joint.settings.model && other.limit_counts() == limits
            };
            let other = self.joints.iter().position(is_whose).filter(|other| *other != index);
            if let Some((other, joint)) = other.zip(self.joints.get_mut(index)) {
                joint.refuse_as_other(now, other);
            }
        }
    }

    /// Reports how servos were found set up since the last call: calls `tell` with the joint's index and the notice.
    pub fn take_notices(&mut self, mut tell: impl FnMut(usize, Notice)) {
        for (index, joint) in self.joints.iter_mut().enumerate() {
            joint.notices.drain(..).for_each(|notice| tell(index, notice));
        }
    }

    /// Marks a bus as lost because its thread does not return. The bus stays lost until the thread returns.
    pub(crate) fn lose(&mut self, bus: usize, now: Instant) {
        if let Some(bus) = require!(self.buses.get_mut(bus), "bus {bus} exists") {
            bus.lose(now, &mut self.joints);
        }
    }

    /// State of every joint, in the order of their indices.
    pub fn states(&self) -> impl ExactSizeIterator<Item = JointState> {
        self.joints.iter().map(Joint::state)
    }

    /// Why a joint failed, if it did.
    #[must_use]
    pub fn trouble(&self, joint: usize) -> Option<JointFault> {
        self.joints.get(joint).and_then(|joint| joint.trouble)
    }

    /// Counters since [`new`](Self::new).
    #[must_use]
    pub fn counts(&self) -> MotorCounters {
        MotorCounters {
            stale: self.buses.iter().map(|bus| bus.counts.stale).sum(),
            violations: self.joints.iter().map(|joint| joint.violations).sum(),
            ..self.counts
        }
    }

    /// State of a bus, and its counters since [`new`](Self::new). The bus threads know its name and durations.
    #[must_use]
    pub fn bus_health(&self, bus: usize) -> BusHealth {
        let mut health = self.buses.get(bus).map(|bus| bus.counts).unwrap_or_default();
        health.lost = u64::from(self.is_lost(bus));
        for joint in self.joints.iter().filter(|joint| joint.settings.bus == bus) {
            let FaultCounters { alerts, restarts, watchdogs, refusals } = joint.fault_counters;
            health.quarantined += u64::from(joint.is_absent());
            health.alerts += alerts;
            health.restarts += restarts;
            health.watchdogs += watchdogs;
            health.refusals += refusals;
        }
        health
    }

    /// Whether the line of a bus is lost because its other end was closed.
    pub(crate) fn has_hung_up(&self, bus: usize) -> bool {
        self.buses.get(bus).is_some_and(|bus| bus.has_hung_up)
    }

    /// Whether the line of a bus is lost.
    #[must_use]
    pub fn is_lost(&self, bus: usize) -> bool {
        self.buses.get(bus).is_some_and(|bus| bus.is_lost)
    }
}
