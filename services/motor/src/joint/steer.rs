//! Trajectory of a joint: begins and ends motions, and computes the setpoint of every cycle.

use clock::{Duration, Instant};
use config::leo::AlertReaction;
use invariant::invariant;
use message::JointCause;
use servo::{Limits, Motion as Setpoint, position_count, velocity_count};

use super::{Disarming, Joint, MAX_READING_AGE, Motion, Power, PowerUpStep, SETTLE, STILL_RAD_S, Watchdog};
use crate::JointFault;
use crate::derating::derating;

/// Tracking error from which a joint counts as at its bound, as a share of the bound. From there its setpoint waits.
const AT_BOUND: f64 = 0.9;
/// Tracking error from which the servo's PWM is limited, as a share of the bound.
const FAR_BEHIND: f64 = 0.4;
/// Tracking error below which the limit ends: over such a short way a joint cannot become fast.
const CAUGHT_UP_RAD: f64 = 0.006;
/// Gain of the profile velocity on the tracking error, in 1/s.
const VELOCITY_GAIN_PER_S: f64 = 8.0;
/// Lowest speed of a servo that is ahead of its setpoint, as a share of the setpoint's.
const MIN_SPEED_RATIO: f64 = 0.5;
/// Lowest profile velocity, so that a motion does not end in a creep.
const SLOWEST_RAD_S: f64 = 0.05;
/// Acceleration of the soft start: low, so that a fault shows before the joint is fast.
pub(super) const LOW_ACCELERATION_RAD_S2: f64 = 5.0;
/// Ratio of the servo's profile acceleration to the joint's limit: enough to follow smooth setpoints, and yet a
/// limit.
pub(super) const ACCELERATION_MARGIN: f64 = 8.0;
/// At rest, by how many counts the profile velocity in the servo may exceed the needed one.
const CLOSE_COUNTS: i32 = 4;
/// Period after which an unchanged profile velocity is written again.
const REWRITE_PERIOD: Duration = Duration::from_millis(500);
/// Distance from the rest pose within which a joint has arrived.
const ARRIVED_RAD: f64 = 0.02;

/// Goal of a servo in one cycle, in counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Command {
    /// Goal position.
    pub(crate) position: i32,
    /// Profile velocity, if the servo may have another one.
    pub(crate) velocity: Option<i32>,
}

impl Joint {
    /// Changes the state of motion by the current conditions.
    pub(super) fn conduct(&mut self, now: Instant) {
        let goes_on = self.arming.is_given() && self.body_state.live && self.body_state.halt.is_none();
        match self.motion {
            Motion::Idle if self.may_move() && goes_on => self.set_out(now),
            Motion::Align { to_rad } => {
                if !goes_on {
                    self.halt();
                } else if !self.is_far_from(to_rad) {
                    self.begin_soft(now, Setpoint::at(to_rad));
                }
            }
            Motion::Stay { ordered } if self.stays() => self.after_stay(now, ordered, goes_on),
            Motion::Soft { .. } | Motion::Track { .. } if !goes_on => self.halt(),
            Motion::Soft { at, until } if now >= until && self.has_full_acceleration() => {
                self.motion = Motion::Track { at }
            }
            Motion::Halt { at } | Motion::Hold { at, .. } if goes_on => self.begin_soft(now, at),
            Motion::Hold { at, since } => self.after_hold(now, at, since),
            Motion::Retreat { at, until } => {
                let is_there = (at.position_rad - self.settings.rest_rad).abs() <= ARRIVED_RAD
                    && at.velocity_rad_s.abs() <= 0.0
                    && self.error_rad(now, at).is_none_or(|error| error.abs() <= ARRIVED_RAD);
                if is_there || now >= until {
                    self.switch_torque_off(now);
                }
            }
            Motion::Idle
            | Motion::Stay { .. }
            | Motion::Soft { .. }
            | Motion::Track { .. }
            | Motion::Halt { .. } => {}
        }
        if self.cut_at.is_some_and(|at| now >= at) {
            self.switch_torque_off(now);
        }
    }

    /// Begins to move from the position that its servo holds.
    fn set_out(&mut self, now: Instant) {
        let Power::On { goal_rad, .. } = self.power else {
            invariant!(false, "joint {} may move without torque", self.index);
            return;
        };
        if self.is_far_from(goal_rad) {
            // The joint was moved by hand meanwhile, or is beyond its limits: the goal is written again.
            self.power = Power::Rising { step: PowerUpStep::WriteGoal, is_on: true, is_tripped: false };
        } else {
            self.begin_soft(now, Setpoint::at(goal_rad));
        }
    }

    pub(super) fn begin_soft(&mut self, now: Instant, at: Setpoint) {
        self.motion = Motion::Soft { at, until: now + self.policy.settings.soft_start_ms.duration() };
    }

    /// Brings the joint to a stop, from any state.
    pub(super) fn halt(&mut self) {
        if let Motion::Soft { at, .. } | Motion::Track { at } = self.motion {
            self.motion = Motion::Halt { at };
        } else if let Motion::Align { .. } = self.motion {
            self.motion = Motion::Stay { ordered: None };
        }
    }

    /// Its servo stands where it was told to stay.
    fn after_stay(&mut self, now: Instant, ordered: Option<(Instant, f64)>, goes_on: bool) {
        if goes_on {
            self.motion = Motion::Idle;
            self.power = Power::Rising { step: PowerUpStep::WriteGoal, is_on: true, is_tripped: false };
        } else if let Some(ending) = self.arming.ending() {
            // The servo holds a goal of its own beyond the joint's limits, which no setpoint can express. So it is
            // monitored, and told to stay again if it moves.
            self.power = Power::Found { watchdog: Watchdog::Armed, stay: ordered };
            self.motion = Motion::Idle;
            self.arming = ending.state();
            if ending.cause == JointCause::Alert {
                // A servo beyond its limits is not lowered, because it accepts no goal there.
                self.cut_at = Some(now + self.policy.settings.alert.hold_ms.duration());
            }
        }
    }

    /// The joint holds and is being disarmed. After an alert it is lowered, or its torque goes off.
    fn after_hold(&mut self, now: Instant, at: Setpoint, since: Instant) {
        let Some(ending) = self.arming.ending() else { return };
        if ending.cause == JointCause::Alert {
            if now < since + self.policy.settings.alert.hold_ms.duration() {
                return;
            }
            if self.reaction == Some(AlertReaction::Lower) {
                self.motion = Motion::Retreat {
                    at,
                    until: now + self.policy.settings.alert.lower_timeout_ms.duration(),
                };
            } else {
                self.switch_torque_off(now);
            }
        } else if now >= since + SETTLE {
            // The last setpoint has been repeated often enough: the servo holds it.
            self.rest(at, ending);
        }
    }

    /// Stops sending setpoints. The servo holds the last one.
    fn rest(&mut self, at: Setpoint, ending: Disarming) {
        self.motion = Motion::Idle;
        if let Power::On { goal_rad, .. } = &mut self.power {
            *goal_rad = at.position_rad;
        }
        self.arming = ending.state();
    }

    /// Whether its servo has the acceleration of normal operation.
    pub(super) const fn has_full_acceleration(&self) -> bool {
        matches!(self.power, Power::On { has_full_acceleration: true, .. })
    }

    /// Tracking error against a setpoint, in radians; `None` without a recent reading.
    fn error_rad(&self, now: Instant, at: Setpoint) -> Option<f64> {
        let (read_at, reading) = self.reading?;
        (now.since(read_at) <= MAX_READING_AGE).then_some(at.position_rad - reading.position_rad)
    }

    /// Advances the setpoint by `dt_s` seconds: towards the goal, or to a stop without one.
    pub(super) fn steer(&mut self, now: Instant, dt_s: f64) {
        let Some(at) = self.motion.setpoint() else { return };
        let stop = Limits {
            velocity_rad_s: self.velocity_rad_s(),
            acceleration_rad_s2: self.settings.max_acceleration_rad_s2,
        };
        let share = self.spare();
        let slow_rad_s = self.policy.settings.soft_start_rad_s.get();
        // The acceleration limit is not derated: a moving joint could not stop within its limits otherwise.
        let limits = |bound_rad_s: f64| Limits {
            velocity_rad_s: (stop.velocity_rad_s * share).min(bound_rad_s),
            ..stop
        };
        let next = match (self.motion, self.goal.filter(|_| share > 0.0)) {
            (Motion::Soft { .. } | Motion::Track { .. }, Some(goal)) => {
                let is_soft = matches!(self.motion, Motion::Soft { .. });
                let limits = limits(if is_soft { slow_rad_s } else { f64::INFINITY });
                let within_s = goal.arrive_at.since(now).as_secs_f64();
                let velocity_rad_s = at.cruise(goal.position_rad, limits, within_s);
                at.towards(goal.position_rad, Limits { velocity_rad_s, ..limits }, dt_s)
            }
            (Motion::Retreat { .. }, _) => {
                let limits = Limits { velocity_rad_s: stop.velocity_rad_s.min(slow_rad_s), ..stop };
                at.towards(self.settings.rest_rad, limits, dt_s)
            }
            (Motion::Hold { .. }, _) => Some(at),
            _ => at.stopping(stop, dt_s),
        };
        let next = next.unwrap_or(Setpoint { velocity_rad_s: 0.0, ..at });
        // Steps of uneven length overshoot slightly, and the goal may be the limit.
        let next = match self.clamped(next.position_rad) {
            Some(within) if within.total_cmp(&next.position_rad).is_ne() => Setpoint::at(within),
            _ => next,
        };
        let next = self.no_further_ahead(now, at, next);
        let has_stopped = matches!(self.motion, Motion::Halt { .. }) && next.velocity_rad_s.abs() <= 0.0;
        if has_stopped {
            self.motion = Motion::Hold { at: next, since: now };
        } else if let Some(at) = self.motion.setpoint_mut() {
            *at = next;
        }
        self.watch_for_a_block(now, next);
    }

    /// Returns the next setpoint if its tracking error is within the bound. Otherwise the setpoint waits.
    fn no_further_ahead(&self, now: Instant, at: Setpoint, next: Setpoint) -> Setpoint {
        let (Some(before), Some(error)) = (self.error_rad(now, at), self.error_rad(now, next)) else {
            return next;
        };
        let bound_rad = self.max_tracking_error_rad();
        if error.abs() <= bound_rad || error.abs() <= before.abs() {
            return next;
        }
        // A setpoint within the bound may advance to its edge.
        let edge_rad = next.position_rad - error + bound_rad.copysign(error);
        Setpoint::at(if before.abs() <= bound_rad { edge_rad } else { at.position_rad })
    }

    /// Whether the tracking error is large enough to limit the PWM, so that a freed servo does not turn at full speed.
    /// With hysteresis: if it `was`, until the joint has caught up.
    pub(super) fn is_far_behind(&self, now: Instant, was: bool) -> bool {
        let Some(at) = self.motion.setpoint() else { return false };
        let Some(error_rad) = self.error_rad(now, at).map(f64::abs) else { return was };
        let is_far = error_rad > FAR_BEHIND * self.max_tracking_error_rad();
        // A servo that stands off its goal, for example under load, needs its full PWM.
        let stands = at.velocity_rad_s.abs() <= 0.0
            && self.reading.is_some_and(|(_, reading)| reading.velocity_rad_s.abs() <= STILL_RAD_S);
        is_far || (was && error_rad > CAUGHT_UP_RAD && !stands)
    }

    fn max_tracking_error_rad(&self) -> f64 {
        self.settings.max_tracking_error_rad.unwrap_or(self.policy.settings.max_tracking_error_rad.get())
    }

    /// Stops and locks the joint if its tracking error has been at the bound for too long.
    fn watch_for_a_block(&mut self, now: Instant, at: Setpoint) {
        let Some(error) = self.error_rad(now, at) else { return };
        if error.abs() < AT_BOUND * self.max_tracking_error_rad() {
            self.behind_since = None;
            return;
        }
        let since = *self.behind_since.get_or_insert(now);
        if now.since(since) < self.policy.settings.blocked_after_ms.duration() {
            return;
        }
        self.behind_since = None;
        if self.arming.ending().is_some_and(|ending| ending.locks) {
            // It is being stopped already, and must not press against the obstacle any longer.
            return self.switch_torque_off(now);
        }
        self.trouble = Some(JointFault::Blocked { by_mrad: quantity::number::round_i64(error * 1e3) });
        // The setpoint jumps to the present position, so that the joint does not press against the obstacle.
        let stands_rad = self.standing(now).unwrap_or(at.position_rad);
        self.motion = Motion::Halt { at: Setpoint::at(stands_rad) };
        self.begin_disarm(Disarming { cause: JointCause::Blocked, locks: true });
    }

    /// Highest speed of the joint, in rad/s: its own limit, or the velocity limit of its servo if that is lower.
    pub(super) fn velocity_rad_s(&self) -> f64 {
        let servo_rad_s = self.bounds.map_or(f64::INFINITY, |bounds| bounds.velocity_rad_s);
        self.settings.max_velocity_rad_s.min(servo_rad_s)
    }

    /// Derating factor of the speed, 0 to 1; below one until the servo is well within its bounds again.
    fn spare(&mut self) -> f64 {
        let Some((supply, bounds)) = self.supply.zip(self.bounds) else { return 1.0 };
        let share = derating(supply, bounds, self.settings.model.nominal_volts(), self.is_derated);
        self.is_derated = share < 1.0;
        share
    }

    /// Goal of its servo in this cycle, if any. The profile velocity is written only when it changes, and
    /// periodically. No servo acknowledges it, and it takes as much time on the wire as the goal position.
    pub(crate) fn command(&mut self, now: Instant) -> Option<Command> {
        let Some([velocity, position]) = self.command_counts(now) else {
            self.sent_velocity = None;
            return None;
        };
        let is_at_rest = self.motion.setpoint().is_some_and(|at| at.velocity_rad_s.abs() <= 0.0);
        let is_known = self.sent_velocity.is_some_and(|(sent, sent_at)| {
            // At rest the profile only has to be fast enough. In motion a faster servo would run ahead of its
            // setpoint.
            let is_same = if is_at_rest {
                (velocity..=velocity + CLOSE_COUNTS).contains(&sent)
            } else {
                sent == velocity
            };
            is_same && now < sent_at + REWRITE_PERIOD
        });
        if !is_known {
            self.sent_velocity = Some((velocity, now));
        }
        Some(Command { position, velocity: (!is_known).then_some(velocity) })
    }

    /// Profile velocity and goal position of its servo, in counts.
    ///
    /// The profile runs at the speed of the setpoint, limited to the joint's speed. Its goal is the point where the
    /// setpoint would come to a stop. So the servo does not stop between two cycles, and soon stops by itself if no
    /// more goals arrive.
    pub(crate) fn command_counts(&self, now: Instant) -> Option<[i32; 2]> {
        if !self.may_move() {
            return None;
        }
        let slow_rad_s = self.policy.settings.soft_start_rad_s.get().min(self.velocity_rad_s());
        let fastest = velocity_below(self.velocity_rad_s());
        let (goal_rad, speed_rad_s) = match self.motion {
            Motion::Idle | Motion::Stay { .. } => return None,
            Motion::Align { to_rad } => (to_rad, slow_rad_s),
            Motion::Soft { at, .. } => (self.lead_rad(at), self.speed_rad_s(now, at).min(slow_rad_s)),
            Motion::Retreat { at, .. } => (self.lead_rad(at), self.speed_rad_s(now, at).min(slow_rad_s)),
            Motion::Track { at } | Motion::Halt { at } | Motion::Hold { at, .. } => {
                (self.lead_rad(at), self.speed_rad_s(now, at))
            }
        };
        let within = self.clamped(goal_rad)?;
        Some([velocity(speed_rad_s).min(fastest), position_count(self.settings.servo_rad(within))])
    }

    /// Stopping position of the setpoint one cycle later, in radians, not beyond the goal.
    fn lead_rad(&self, at: Setpoint) -> f64 {
        let acceleration_rad_s2 = if self.has_full_acceleration() {
            self.settings.max_acceleration_rad_s2 * ACCELERATION_MARGIN
        } else {
            LOW_ACCELERATION_RAD_S2
        };
        let velocity = at.velocity_rad_s;
        let ahead_rad = velocity * self.policy.settings.rate_hz.period().as_secs_f64()
            + velocity * velocity.abs() / (2.0 * acceleration_rad_s2);
        let is_lowered = matches!(self.motion, Motion::Retreat { .. });
        let goal_rad =
            if is_lowered { Some(self.settings.rest_rad) } else { self.goal.map(|goal| goal.position_rad) };
        let lead_rad = at.position_rad + ahead_rad;
        match goal_rad {
            Some(goal) if velocity > 0.0 => lead_rad.min(goal.max(at.position_rad)),
            Some(goal) if velocity < 0.0 => lead_rad.max(goal.min(at.position_rad)),
            _ => lead_rad,
        }
    }

    /// Speed at which the servo keeps up with the setpoint, in rad/s; at most the speed limit of the joint.
    fn speed_rad_s(&self, now: Instant, at: Setpoint) -> f64 {
        let (speed, error) = (at.velocity_rad_s.abs(), self.error_rad(now, at).unwrap_or(0.0));
        // The reading is one cycle old. At rest the joint lags in either direction of the error.
        let behind_rad = if speed > 0.0 {
            error * at.velocity_rad_s.signum() - speed * self.policy.settings.rate_hz.period().as_secs_f64()
        } else {
            error.abs()
        };
        let speed_rad_s =
            (speed + VELOCITY_GAIN_PER_S * behind_rad).max(MIN_SPEED_RATIO * speed).max(SLOWEST_RAD_S);
        speed_rad_s.min(self.velocity_rad_s())
    }
}

/// A profile velocity in counts, at least 1: zero would mean unlimited.
pub(super) fn velocity(rad_s: f64) -> i32 {
    velocity_count(rad_s).clamp(1, 32_767)
}

/// The highest profile velocity in counts that is no faster than `rad_s`, at least 1.
fn velocity_below(rad_s: f64) -> i32 {
    let count = velocity(rad_s);
    let is_faster = servo::velocity_rad_s(count) > rad_s;
    (count - i32::from(is_faster)).max(1)
}
