use clock::{Duration, Instant};
use message::{JointCause, JointGoal, JointState};
use servo::Id;

use crate::bus::{Bus, Purpose};
use crate::joint::{Joint, Policy};
use crate::request::SERVOS_MOST;
use crate::{BusCounts, Counts, Replies, Request, Trouble};

/// The longest step of the commands: after a longer pause they go on from where they were.
pub(crate) const STEP_MOST: Duration = Duration::from_millis(20);

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
}

/// The joints and their buses: goals in, one request per bus out, its replies in, joint states
/// out. Pure: time comes in as an argument, and after [`new`](Self::new) nothing is allocated.
#[derive(Clone, Debug)]
pub struct Motor {
    joints: Vec<Joint>,
    buses: Vec<Bus>,
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
    /// By group, whether one of its joints is in trouble that stops the others.
    stopped: Vec<bool>,
    counts: Counts,
}

impl Motor {
    /// A robot whose servos are all still to be found.
    ///
    /// # Errors
    ///
    /// A bus with more servos than a cycle has room for, or an identifier that no servo has.
    pub fn new(robot: &config::motor::Motor, settings: &config::leo::Motor) -> Result<Self, MotorError> {
        let mut joints = Vec::with_capacity(robot.joints.len());
        let policy = Policy {
            soft_start: settings.soft_start_ms.duration(),
            soft_start_rad_s: settings.soft_start_rad_s.get(),
            on_alert: settings.on_alert,
        };
        for (index, joint) in (0..).zip(&robot.joints) {
            let id = Id::new(joint.id)
                .ok_or_else(|| MotorError::Id { joint: joint.name.clone(), id: joint.id })?;
            joints.push(Joint::new(index, id, joint, policy));
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
            command_timeout: settings.command_timeout_ms.duration(),
            limp_after: settings.limp_after_ms.duration(),
            decided_at: None,
            unled_since: None,
            stepped_at: None,
            period: settings.rate_hz.period(),
            live: false,
            let_go_at: None,
            letting_go: None,
            stopped: vec![false; robot.groups.len()],
            counts: Counts::default(),
        })
    }

    /// Takes a frame of goals that was decided at `decided_at`. A goal that is no number or for
    /// no joint is refused, and a frame of refused goals alone is no sign of life. One that says it was
    /// decided later than it is by the next [`step`](Self::step) counts as decided then.
    pub fn goals(&mut self, decided_at: Instant, goals: &[JointGoal]) {
        let mut accepted = goals.is_empty();
        for goal in goals {
            let joint = usize::try_from(goal.joint).ok().and_then(|index| self.joints.get_mut(index));
            let arrive_at = Instant::from_nanos(goal.arrive_at_ns);
            match joint.and_then(|joint| joint.set_goal(goal.goal_position_rad, arrive_at)) {
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
        let is_dismissed = self.let_go_at.is_some();
        self.live = !is_dismissed && age.is_some_and(|age| age <= self.command_timeout);
        // A servo that was found with its torque on keeps it as long as one whose commander fell silent.
        let unled = age.unwrap_or_else(|| now.since(unled_since));
        let limp = !is_dismissed && unled > self.command_timeout + self.limp_after;
        if self.let_go_at.is_some_and(|let_go_at| now >= let_go_at || !self.is_moving()) {
            self.let_go(JointCause::Stopped);
        }
        self.stopped.fill(false);
        for joint in self.joints.iter().filter(|joint| joint.stops_group()) {
            if let Some(stopped) = self.stopped.get_mut(joint.group()) {
                *stopped = true;
            }
        }
        let body_stopped = self.buses.iter().any(Bus::is_lost).then_some(JointCause::BodyStopped);
        for joint in &mut self.joints {
            let group_stopped = self.stopped.get(joint.group()).is_some_and(|stopped| *stopped);
            let halt = body_stopped.or(group_stopped.then_some(JointCause::GroupStopped));
            joint.set_halt(halt);
            if !self.live {
                joint.forget_goal();
            }
            if !self.live || halt.is_some() {
                joint.stop_returning();
            }
            if !self.live || body_stopped.is_some() {
                joint.stop_arming();
            }
            if let Some(cause) = self.letting_go {
                joint.let_go(cause);
            } else {
                joint.release(limp);
            }
            if dt_s > 0.0 {
                joint.steer(now, dt_s);
            }
        }
    }

    /// Switches every torque off from the next request on, and keeps it off: goals do nothing
    /// until [`start_anew`](Self::start_anew). For an emergency stop; for an orderly end there is
    /// [`dismiss`](Self::dismiss).
    pub fn let_go(&mut self, cause: JointCause) {
        // An emergency is not made less of by an end.
        if self.letting_go != Some(JointCause::Emergency) {
            self.letting_go = Some(cause);
        }
    }

    /// Ends what [`let_go`](Self::let_go) began: every joint is started anew, once somebody
    /// commands.
    pub fn start_anew(&mut self) {
        self.letting_go = None;
        self.decided_at = None;
        self.joints.iter_mut().for_each(Joint::start_anew);
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

    /// How many servos have not said yet that their torque is off, since they were told to let go.
    #[must_use]
    pub fn unconfirmed(&self) -> usize {
        self.joints.iter().filter(|joint| !joint.has_let_go()).count()
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
    }

    /// Takes a bus for lost that does not come back with what it was asked, until it does.
    pub(crate) fn lose(&mut self, bus: usize, now: Instant) {
        if let Some(bus) = self.buses.get_mut(bus) {
            bus.lose(now, &mut self.joints);
        }
    }

    /// What every joint does, in the order of their indices.
    pub fn states(&self) -> impl ExactSizeIterator<Item = JointState> {
        self.joints.iter().map(|joint| joint.state(self.live))
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
        Counts { stale: self.buses.iter().map(|bus| bus.counts().stale).sum(), ..self.counts }
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
