use clock::{Duration, Instant};
use config::leo::{AlertReaction, StopCategory};
use config::motor::Device;
use message::{JointCause, JointGoal, JointState};
use servo::Id;

use crate::bus::{Bus, Purpose};
use crate::carriers::Carriers;
use crate::joint::{Joint, Orders, Policy};
use crate::request::SERVOS_MOST;
use crate::{BusCounts, Counts, Notice, Replies, Request, Trouble};

/// The longest step of the commands: after a longer pause they go on from where they were.
pub(crate) const STEP_MOST: Duration = Duration::from_millis(20);
/// How long an order to arm holds: a joint that has no torque by then, and has not failed before, waits for another one.
const ORDER_HOLDS: Duration = Duration::from_secs(10);
/// How long a stop of category 1 may take before torque goes off whatever moves still.
const STOP_WITHIN: Duration = Duration::from_millis(750);

/// Why a robot cannot be driven.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MotorError {
    /// More servos on one bus than a cycle has room for.
    #[error(
        "bus `{bus}` has {servos} servos, and a cycle has room for {SERVOS_MOST}: spread them over more buses"
    )]
    Crowded {
        /// The bus.
        bus: String,
        /// Its servos.
        servos: usize,
    },
    /// A servo cannot have this identifier.
    #[error("joint `{joint}` has id {id}, and a servo's is from 0 to 252")]
    Id {
        /// The joint.
        joint: String,
        /// The identifier.
        id: u8,
    },
    /// The configuration says what a group does that is not there.
    #[error(
        "there is no group `{group}` in motor.toml, and `groups` of [motor.alert] in leo.toml names it; there are {known}"
    )]
    UnknownGroup {
        /// The group.
        group: String,
        /// The groups of motor.toml.
        known: String,
    },
}

/// The joints and their buses: goals in, one request per bus out, its replies in, joint states
/// out. Pure: time comes in as an argument, and after [`new`](Self::new) nothing is allocated.
#[derive(Clone, Debug)]
pub struct Motor {
    joints: Vec<Joint>,
    buses: Vec<Bus>,
    /// By bus, whether its servos are those of the mock servo bus.
    is_simulated: Vec<bool>,
    command_timeout: Duration,
    limp_after: Duration,
    /// When the newest goals were decided.
    decided_at: Option<Instant>,
    /// Since when nobody has commanded, where nobody has yet.
    unled_since: Option<Instant>,
    stepped_at: Option<Instant>,
    period: Duration,
    live: bool,
    /// Nobody commands any more: when every torque is switched off, whatever moves still.
    let_go_at: Option<Instant>,
    /// Why the torque of the whole body is switched off, if it is.
    letting_go: Option<JointCause>,
    stop_category: StopCategory,
    /// The emergency stop is raised, and the body stops before torque goes off, or keeps it: when it goes off, if ever.
    stopping: Option<Option<Instant>>,
    /// Until when an order to arm holds.
    order_until: Option<Instant>,
    /// How many orders there were, and how many locks the newest acknowledges.
    orders: u64,
    acknowledged: Option<u64>,
    /// Which groups stop which.
    carriers: Carriers,
    /// By group, how many of its joints are in trouble that stops others; and by joint, whether it was in the last cycle.
    failing: Vec<u32>,
    was_failing: Vec<bool>,
    counts: Counts,
}

impl Motor {
    /// A robot whose servos are all still to be found.
    ///
    /// # Errors
    ///
    /// A bus with more servos than a cycle has room for, an identifier that no servo has, or a group that is not there.
    pub fn new(robot: &config::motor::Motor, settings: &config::leo::Motor) -> Result<Self, MotorError> {
        let mut joints = Vec::with_capacity(robot.joints.len());
        let is_simulated: Vec<bool> = robot.buses.iter().map(|bus| bus.device == Device::Mock).collect();
        let policy = Policy::new(settings, is_simulated.iter().all(|is_simulated| *is_simulated));
        let reactions = &settings.alert.groups;
        if let Some(group) = reactions.keys().find(|group| !robot.groups.contains(group)) {
            return Err(MotorError::UnknownGroup { group: group.clone(), known: robot.groups.join(", ") });
        }
        for (index, joint) in (0..).zip(&robot.joints) {
            let id = Id::new(joint.id)
                .ok_or_else(|| MotorError::Id { joint: joint.name.clone(), id: joint.id })?;
            let reaction = robot.groups.get(joint.group).and_then(|group| reactions.get(group));
            let reaction = reaction.copied().unwrap_or(AlertReaction::Lower);
            joints.push(Joint::new(index, id, joint, policy, reaction));
        }
        let mut buses = Vec::with_capacity(robot.buses.len());
        for (number, bus) in robot.buses.iter().enumerate() {
            let on_bus: Vec<_> = (0..joints.len())
                .filter(|&index| joints.get(index).is_some_and(|joint| joint.bus() == number))
                .collect();
            if on_bus.len() > SERVOS_MOST {
                return Err(MotorError::Crowded { bus: bus.name.clone(), servos: on_bus.len() });
            }
            buses.push(Bus::new(on_bus));
        }
        Ok(Self {
            joints,
            buses,
            is_simulated,
            command_timeout: settings.command_timeout_ms.duration(),
            limp_after: settings.limp_after_ms.duration(),
            decided_at: None,
            unled_since: None,
            stepped_at: None,
            period: settings.rate_hz.period(),
            live: false,
            let_go_at: None,
            letting_go: None,
            stop_category: settings.stop_category,
            stopping: None,
            order_until: None,
            orders: 0,
            acknowledged: None,
            carriers: Carriers::alone(robot.groups.len()),
            failing: vec![0; robot.groups.len()],
            was_failing: vec![false; robot.joints.len()],
            counts: Counts::default(),
        })
    }

    /// The same robot, of which it is known which joint hangs from which: `parents` gives the nearest joint that carries
    /// each, by its index. What carries others stops them when it fails.
    #[must_use]
    pub fn with_parents(mut self, parents: &[Option<usize>]) -> Self {
        let groups: Vec<usize> = self.joints.iter().map(Joint::group).collect();
        self.carriers = Carriers::new(self.failing.len(), &groups, parents);
        self
    }

    /// Takes a frame of goals that was decided at `decided_at`. A goal that is no number or for
    /// no joint is refused, and a frame of refused goals alone is no sign of life. One that says it was
    /// decided later than it is by the next [`step`](Self::step) counts as decided then. A goal is good for the command
    /// time-out: a joint of which no newer frame says anything slows down and holds.
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

    /// Moves every command on to `now`. Without goals for the command time-out the joints slow
    /// down and hold, and later let go.
    pub fn step(&mut self, now: Instant) {
        let since = self.stepped_at.map_or(self.period, |before| now.since(before));
        let dt_s = since.min(STEP_MOST).as_secs_f64();
        self.stepped_at = Some(now);
        // A commander's clock may be wrong, and a sign of life from the future would never grow old.
        self.decided_at = self.decided_at.map(|decided_at| decided_at.min(now));
        let unled_since = *self.unled_since.get_or_insert(now);
        let age = self.decided_at.map(|decided_at| now.since(decided_at));
        let is_stopping = self.let_go_at.is_some() || self.stopping.is_some();
        self.live = !is_stopping && age.is_some_and(|age| age <= self.command_timeout);
        // A servo that was found with its torque on keeps it as long as one whose commander fell silent.
        let unled = age.unwrap_or_else(|| now.since(unled_since));
        let limp = !is_stopping && unled > self.command_timeout + self.limp_after;
        if self.let_go_at.is_some_and(|let_go_at| now >= let_go_at || !self.is_moving()) {
            self.let_go(JointCause::Stopped);
        }
        if let Some(Some(let_go_at)) = self.stopping
            && (now >= let_go_at || !self.is_moving())
        {
            self.let_go(JointCause::Emergency);
        }
        self.look_for_failures();
        let body_stopped = self.buses.iter().any(Bus::is_lost);
        let is_emergency = self.stopping.is_some() || self.letting_go == Some(JointCause::Emergency);
        for joint in &mut self.joints {
            let others = self.carriers.of(joint.group()).iter().filter_map(|group| self.failing.get(*group));
            let group_stopped = others.sum::<u32>() > u32::from(joint.stops_group());
            let group_stopped = group_stopped.then_some(JointCause::GroupStopped);
            let halt = body_stopped.then_some(JointCause::BodyStopped).or(group_stopped);
            if let Some(cause) = self.letting_go {
                joint.let_go(now, cause);
            } else if self.stopping.is_some() {
                joint.end_by_emergency();
            }
            joint.step(now, dt_s, Orders { live: self.live, halt, body_stopped, limp, is_emergency });
            if let Some(until) = self.order_until.filter(|until| now < *until) {
                if let Some(locks) = self.acknowledged {
                    joint.acknowledge(now, locks, false);
                }
                joint.arm(self.orders, until);
            }
            self.counts.locks += u64::from(joint.count_lock(self.counts.locks));
        }
    }

    /// Counts the joints that stop others. A joint that has just failed ends an order to arm: it was given before that.
    fn look_for_failures(&mut self) {
        self.failing.fill(0);
        for (joint, was_failing) in self.joints.iter().zip(&mut self.was_failing) {
            let fails = joint.stops_group();
            if fails && let Some(failing) = self.failing.get_mut(joint.group()) {
                *failing += 1;
            }
            if fails && !std::mem::replace(was_failing, fails) {
                self.order_until = None;
            }
            *was_failing = fails;
        }
    }

    /// Arms the joints by a person's order. It holds for some seconds, in which the joints come up group by group, or
    /// until another joint fails. Joints that are locked are unlocked where the cause is gone and the person has seen it:
    /// where their lock is among the first `acknowledged_locks` of [`Counts::locks`]. Joints whose servos do not answer
    /// wait for another order: plugging in a cable starts nothing.
    pub fn arm(&mut self, now: Instant, acknowledged_locks: Option<u64>) {
        if self.letting_go.is_some() || self.stopping.is_some() {
            return;
        }
        if let Some(locks) = acknowledged_locks {
            self.joints.iter_mut().for_each(|joint| joint.acknowledge(now, locks, true));
        }
        self.acknowledged = acknowledged_locks;
        self.order_until = Some(now + ORDER_HOLDS);
        self.orders += 1;
        self.joints.iter_mut().for_each(|joint| joint.note_order(self.orders));
    }

    /// Stops the body as the configuration says that the emergency stop does, and keeps it stopped until
    /// [`end_emergency`](Self::end_emergency).
    pub fn emergency_stop(&mut self, now: Instant) {
        self.order_until = None;
        match self.stop_category {
            StopCategory::Zero => self.let_go(JointCause::Emergency),
            StopCategory::One => _ = self.stopping.get_or_insert(Some(now + STOP_WITHIN)),
            StopCategory::Two => _ = self.stopping.get_or_insert(None),
        }
    }

    /// Ends an emergency stop: nothing moves before joints are armed. Every servo is asked anew what it is.
    pub fn end_emergency(&mut self) {
        self.stopping = None;
        self.letting_go = None;
        self.decided_at = None;
        self.joints.iter_mut().for_each(Joint::end_let_go);
    }

    /// Whether the emergency stop is raised, also while joints still stop.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stopping.is_some() || self.letting_go.is_some()
    }

    /// What a person does who has looked at everything: releases the emergency stop, acknowledges all locks, and arms.
    #[cfg(test)]
    pub(crate) fn start_anew(&mut self) {
        self.end_emergency();
        self.joints.iter_mut().for_each(Joint::trust);
        self.arm(self.stepped_at.unwrap_or(Instant::EPOCH), Some(self.counts.locks));
    }

    /// Switches every torque off from the next request on, and keeps it off: goals do nothing
    /// until [`end_emergency`](Self::end_emergency). For an emergency stop; for an orderly end there is
    /// [`dismiss`](Self::dismiss).
    pub fn let_go(&mut self, cause: JointCause) {
        // An emergency is not made less of by an end.
        if self.letting_go != Some(JointCause::Emergency) {
            self.letting_go = Some(cause);
        }
    }

    /// Why the torque of the whole body is switched off, if it is.
    #[must_use]
    pub const fn letting_go(&self) -> Option<JointCause> {
        self.letting_go
    }

    /// Whether any joint moves by command.
    fn is_moving(&self) -> bool {
        self.joints.iter().any(Joint::is_moving)
    }

    /// How many servos have not said yet that their torque is off, since they were told to let go. At the end of the robot,
    /// simulated servos that are gone with their bus have no torque, and none is waited for.
    #[must_use]
    pub fn unconfirmed(&self) -> usize {
        let is_gone = |joint: &Joint| {
            let is_simulated = self.is_simulated.get(joint.bus()).is_some_and(|is_simulated| *is_simulated);
            self.let_go_at.is_some() && is_simulated && self.is_lost(joint.bus())
        };
        self.joints.iter().filter(|joint| !joint.has_let_go() && !is_gone(joint)).count()
    }

    /// Heeds no commander any more: the joints slow down and hold, and once nothing moves, or at
    /// `let_go_at` whatever moves still, every torque is switched off.
    pub fn dismiss(&mut self, let_go_at: Instant) {
        self.let_go_at = Some(let_go_at);
    }

    /// How many buses there are.
    #[must_use]
    pub const fn buses(&self) -> usize {
        self.buses.len()
    }

    /// Writes what a bus is told and asked in this cycle. Torque comes on one group after the
    /// other, and only when somebody commands.
    pub fn request(&mut self, bus: usize, now: Instant, request: &mut Request) {
        let rising = self.joints.iter().filter(|joint| joint.is_rising()).map(Joint::group).min();
        let purpose = match self.letting_go {
            Some(_) => Purpose::LetGo,
            None => {
                let may_arm = self.live && !self.buses.iter().any(Bus::is_lost);
                Purpose::Drive { arm_up_to: if may_arm { rising } else { None } }
            }
        };
        if let Some(bus) = self.buses.get_mut(bus) {
            bus.plan(now, &mut self.joints, purpose, request);
        }
    }

    /// Takes what a bus answered to its last request.
    pub fn replies(&mut self, bus: usize, now: Instant, replies: &Replies) {
        if let Some(bus) = self.buses.get_mut(bus) {
            bus.digest(now, &mut self.joints, replies);
        }
        self.refuse_swapped(bus, now);
    }

    /// Refuses servos of a bus that were found with the limits of another joint, before anything of them is written.
    fn refuse_swapped(&mut self, bus: usize, now: Instant) {
        for index in 0..self.joints.len() {
            let Some(joint) = self.joints.get(index).filter(|joint| joint.bus() == bus) else { continue };
            let Some(limits) = joint.foreign_limits() else { continue };
            let is_whose = |other: &Joint| other.model() == joint.model() && other.limit_counts() == limits;
            let other = self.joints.iter().position(is_whose).filter(|other| *other != index);
            if let Some((other, joint)) = other.zip(self.joints.get_mut(index)) {
                joint.refuse_as_other(now, other);
            }
        }
    }

    /// Tells what people are to know of how servos were found set up, since this was asked last, with the joint's index.
    pub fn take_notices(&mut self, mut tell: impl FnMut(usize, Notice)) {
        for (index, joint) in self.joints.iter_mut().enumerate() {
            joint.take_notices().all().for_each(|notice| tell(index, notice));
        }
    }

    /// Takes a bus for lost that does not come back with what it was asked, until it does.
    pub(crate) fn lose(&mut self, bus: usize, now: Instant) {
        if let Some(bus) = self.buses.get_mut(bus) {
            bus.lose(now, &mut self.joints);
        }
    }

    /// What every joint does, in the order of their indices.
    pub fn states(&self) -> impl ExactSizeIterator<Item = JointState> {
        self.joints.iter().map(Joint::state)
    }

    /// Why a joint failed, if it did.
    #[must_use]
    pub fn trouble(&self, joint: usize) -> Option<Trouble> {
        self.joints.get(joint).and_then(Joint::trouble)
    }

    /// The newest reading of a joint, and when it was asked for.
    #[cfg(test)]
    pub(crate) fn reading(&self, joint: usize) -> Option<(Instant, servo::Reading)> {
        self.joints.get(joint).and_then(Joint::reading)
    }

    /// What was counted since [`new`](Self::new).
    #[must_use]
    pub fn counts(&self) -> Counts {
        Counts {
            stale: self.buses.iter().map(|bus| bus.counts().stale).sum(),
            violations: self.joints.iter().map(Joint::violations).sum(),
            ..self.counts
        }
    }

    /// What was counted of a bus since [`new`](Self::new).
    #[must_use]
    pub fn bus_counts(&self, bus: usize) -> BusCounts {
        self.buses.get(bus).map(Bus::counts).unwrap_or_default()
    }

    /// Whether the line of a bus is gone.
    #[must_use]
    pub fn is_lost(&self, bus: usize) -> bool {
        self.buses.get(bus).is_some_and(Bus::is_lost)
    }

    /// How many joints of a bus are quarantined.
    #[must_use]
    pub fn quarantined(&self, bus: usize) -> usize {
        self.joints.iter().filter(|joint| joint.bus() == bus && joint.is_absent()).count()
    }
}
