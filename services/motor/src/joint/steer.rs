//! How a joint moves: what begins and ends each motion, and the command of every cycle.

use clock::{Duration, Instant};
use config::leo::AlertReaction;
use message::JointCause;
use servo::{Limits, Motion as Setpoint, position_count, velocity_count};

use super::{Ending, FRESH, Joint, Motion, Power, Rise, SETTLE, STILL_RAD_S, Watchdog};
use crate::Trouble;
use crate::derating::derating;

/// A joint that is so close to the bound of its tracking error, as a share of it, is at the bound: its command waits.
const AT_BOUND: f64 = 0.9;
/// Of the bound, how far behind a joint is whose servo's duty is bounded. One that is this close has caught up: what is
/// left it cannot turn fast.
const FAR_BEHIND: f64 = 0.4;
const CAUGHT_UP_RAD: f64 = 0.006;
/// How much faster than its command a servo turns for each radian that it is behind, and how much slower where it is
/// ahead: by half at most.
const CATCH_UP_PER_S: f64 = 8.0;
const SLOWER: f64 = 0.5;
/// The slowest profile: what is left of a motion is not crept over.
const SLOWEST_RAD_S: f64 = 0.05;
/// The acceleration of the soft start: slow, so that what is wrong is seen before it is fast.
pub(super) const LOW_ACCELERATION_RAD_S2: f64 = 5.0;
/// How much more than the joint its servo's profile may accelerate: enough to keep up with commands that are smooth,
/// and yet a limit.
pub(super) const ACCELERATION_MARGIN: f64 = 8.0;
/// At rest, how much faster than needed a profile may be, in counts.
const CLOSE_COUNTS: i32 = 4;
/// How long a profile's velocity that did not change is believed to be what was told.
const TOLD_EVERY: Duration = Duration::from_millis(500);
/// A joint that is so close to its rest pose has arrived there.
const ARRIVED_RAD: f64 = 0.02;

/// What a servo is told in a cycle, in counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Command {
    /// The goal position.
    pub(crate) position: i32,
    /// The velocity of the profile, where the servo may have another one.
    pub(crate) velocity: Option<i32>,
}

impl Joint {
    /// Begins and ends motions, by what is known now.
    pub(super) fn conduct(&mut self, now: Instant) {
        let goes_on = self.licence.is_given() && self.orders.live && self.orders.halt.is_none();
        match self.motion {
            Motion::Idle if self.may_move() && goes_on => self.set_out(now),
            Motion::Align { to_rad } => {
                if !goes_on {
                    self.halt();
                } else if !self.is_far_from(to_rad) {
                    self.begin_soft(now, Setpoint::at(to_rad));
                }
            }
            Motion::Stay { .. } if self.stays() => self.after_stay(now, goes_on),
            Motion::Soft { .. } | Motion::Track { .. } if !goes_on => self.halt(),
            Motion::Soft { at, until } if now >= until && self.is_quick() => {
                self.motion = Motion::Track { at }
            }
            Motion::Halt { at } | Motion::Hold { at, .. } if goes_on => self.begin_soft(now, at),
            Motion::Hold { at, since } => self.after_hold(now, at, since),
            Motion::Retreat { at, until } => {
                let is_there = (at.position_rad - self.settings.rest_rad).abs() <= ARRIVED_RAD
                    && at.velocity_rad_s.abs() <= 0.0
                    && self.error_rad(now, at).is_none_or(|error| error.abs() <= ARRIVED_RAD);
                if is_there || now >= until {
                    self.cut(now);
                }
            }
            Motion::Idle
            | Motion::Stay { .. }
            | Motion::Soft { .. }
            | Motion::Track { .. }
            | Motion::Halt { .. } => {}
        }
        if self.cut_at.is_some_and(|at| now >= at) {
            self.cut(now);
        }
    }

    /// Begins to move from what its servo holds.
    fn set_out(&mut self, now: Instant) {
        let Power::On { goal_rad, .. } = self.power else { return };
        if self.is_far_from(goal_rad) {
            // It was moved by a hand meanwhile, or stands beyond its limits: it is aimed anew.
            self.power = Power::Rising { step: Rise::Aim, is_on: true, is_tripped: false };
        } else {
            self.begin_soft(now, Setpoint::at(goal_rad));
        }
    }

    pub(super) fn begin_soft(&mut self, now: Instant, at: Setpoint) {
        self.motion = Motion::Soft { at, until: now + self.policy.soft_start };
    }

    /// Brings it to a stop, whatever it does.
    pub(super) fn halt(&mut self) {
        self.motion = match self.motion {
            Motion::Soft { at, .. } | Motion::Track { at } => Motion::Halt { at },
            Motion::Align { .. } => Motion::Stay { told: None },
            still @ (Motion::Idle
            | Motion::Stay { .. }
            | Motion::Halt { .. }
            | Motion::Hold { .. }
            | Motion::Retreat { .. }) => still,
        };
    }

    /// Its servo stands where it was told to stay.
    fn after_stay(&mut self, now: Instant, goes_on: bool) {
        if goes_on {
            self.motion = Motion::Idle;
            self.power = Power::Rising { step: Rise::Aim, is_on: true, is_tripped: false };
        } else if let Some(ending) = self.licence.ending() {
            // Its goal is not one of this joint's: it is watched, and told again to stay where it goes on.
            let Motion::Stay { told } = self.motion else { return };
            self.power = Power::Found { watchdog: Watchdog::Armed, stay: told };
            self.motion = Motion::Idle;
            self.licence = ending.licence();
            if ending.cause == JointCause::Alert {
                // A servo beyond its limits is not lowered: it takes no goal there.
                self.cut_at = Some(now + self.policy.hold);
            }
        }
    }

    /// It holds, and its licence ends: after an alert it is lowered, or lets go.
    fn after_hold(&mut self, now: Instant, at: Setpoint, since: Instant) {
        let Some(ending) = self.licence.ending() else { return };
        if ending.cause == JointCause::Alert {
            if now < since + self.policy.hold {
                return;
            }
            if self.reaction == Some(AlertReaction::Lower) {
                self.motion = Motion::Retreat { at, until: now + self.policy.lower_within };
            } else {
                self.cut(now);
            }
        } else if now >= since + SETTLE {
            // The last command has been said often enough: the servo holds it.
            self.rest(at, ending);
        }
    }

    /// Sends no more commands: the servo holds the last one.
    fn rest(&mut self, at: Setpoint, ending: Ending) {
        self.motion = Motion::Idle;
        if let Power::On { is_quick, is_bounded, .. } = self.power {
            self.power = Power::On { goal_rad: at.position_rad, is_quick, is_bounded };
        }
        self.licence = ending.licence();
    }

    /// Whether its servo has the acceleration of operation.
    pub(super) const fn is_quick(&self) -> bool {
        matches!(self.power, Power::On { is_quick: true, .. })
    }

    /// How far it is behind a command, in radians; `None` where it was not read lately.
    fn error_rad(&self, now: Instant, at: Setpoint) -> Option<f64> {
        let (read_at, reading) = self.reading?;
        (now.since(read_at) <= FRESH).then_some(at.position_rad - reading.position_rad)
    }

    /// Moves the command on by `dt_s`: towards the goal, or to a stop without one.
    pub(super) fn steer(&mut self, now: Instant, dt_s: f64) {
        let Some(at) = self.motion.setpoint() else { return };
        let stop = Limits {
            velocity_rad_s: self.velocity_rad_s(),
            acceleration_rad_s2: self.settings.acceleration_rad_s2,
        };
        let share = self.spare();
        let slow_rad_s = self.policy.soft_start_rad_s;
        // The acceleration stays: with less of it, what moves already could not stop within its limits.
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
        // Steps of uneven length miss the goal by a hair, and the goal may be the limit.
        let next = match self.clamped(next.position_rad) {
            Some(within) if within.total_cmp(&next.position_rad).is_ne() => Setpoint::at(within),
            _ => next,
        };
        let next = self.no_further_ahead(now, at, next);
        let has_stopped = matches!(self.motion, Motion::Halt { .. }) && next.velocity_rad_s.abs() <= 0.0;
        self.motion =
            if has_stopped { Motion::Hold { at: next, since: now } } else { self.motion.with(next) };
        self.watch_for_a_block(now, next);
    }

    /// The next command, where it is not further ahead of the joint than the bound; else the command waits.
    fn no_further_ahead(&self, now: Instant, at: Setpoint, next: Setpoint) -> Setpoint {
        let (Some(before), Some(error)) = (self.error_rad(now, at), self.error_rad(now, next)) else {
            return next;
        };
        let bound_rad = self.max_tracking_error_rad();
        if error.abs() <= bound_rad || error.abs() <= before.abs() {
            return next;
        }
        // From within the bound to its edge, and no further.
        let edge_rad = next.position_rad - error + bound_rad.copysign(error);
        Setpoint::at(if before.abs() <= bound_rad { edge_rad } else { at.position_rad })
    }

    /// Whether it is so far behind its command that its servo would turn at full speed if nothing held it any more; until
    /// it has caught up, where it `was`.
    pub(super) fn is_far_behind(&self, now: Instant, was: bool) -> bool {
        let Some(at) = self.motion.setpoint() else { return false };
        let Some(error_rad) = self.error_rad(now, at).map(f64::abs) else { return was };
        let is_far = error_rad > FAR_BEHIND * self.max_tracking_error_rad();
        // A servo that stands off its goal, with a load say, needs all that it has.
        let stands = at.velocity_rad_s.abs() <= 0.0
            && self.reading.is_some_and(|(_, reading)| reading.velocity_rad_s.abs() <= STILL_RAD_S);
        is_far || (was && error_rad > CAUGHT_UP_RAD && !stands)
    }

    fn max_tracking_error_rad(&self) -> f64 {
        self.settings.max_tracking_error_rad.unwrap_or(self.policy.max_tracking_error_rad)
    }

    /// Halts it where it has not followed its command for long.
    fn watch_for_a_block(&mut self, now: Instant, at: Setpoint) {
        let Some(error) = self.error_rad(now, at) else { return };
        if error.abs() < AT_BOUND * self.max_tracking_error_rad() {
            self.behind_since = None;
            return;
        }
        let since = *self.behind_since.get_or_insert(now);
        if now.since(since) < self.policy.blocked_after {
            return;
        }
        self.behind_since = None;
        if self.licence.ending().is_some_and(|ending| ending.locks) {
            // It is stopped already, and what it presses against shall not be pressed any longer.
            return self.cut(now);
        }
        self.trouble = Some(Trouble::Blocked { by_mrad: quantity::number::round_i64(error * 1e3) });
        self.incidents.blocked += 1;
        // It no longer presses against what holds it.
        let stands_rad = self.standing(now).unwrap_or(at.position_rad);
        self.motion = Motion::Halt { at: Setpoint::at(stands_rad) };
        self.end_licence(Ending { cause: JointCause::Blocked, locks: true });
    }

    /// The highest speed of the joint: its own, or less where its servo is set to less.
    pub(super) fn velocity_rad_s(&self) -> f64 {
        let servo_rad_s = self.bounds.map_or(f64::INFINITY, |bounds| bounds.velocity_rad_s);
        self.settings.velocity_rad_s.min(servo_rad_s)
    }

    /// The share of its speed that it is allowed; kept below one until the servo is well out of the bound again.
    fn spare(&mut self) -> f64 {
        let Some((condition, bounds)) = self.condition.zip(self.bounds) else { return 1.0 };
        let share = derating(condition, bounds, self.model.nominal_volts(), self.is_spared);
        self.is_spared = share < 1.0;
        share
    }

    /// Whether it is allowed less than its speed.
    pub(super) const fn is_spared(&self) -> bool {
        self.is_spared
    }

    /// What its servo is told in this cycle. The velocity of its profile is told when it changed, and now and then all the
    /// same: no servo acknowledges it, and it costs as much of the wire as the goal.
    pub(crate) fn command(&mut self, now: Instant) -> Option<Command> {
        let Some([velocity, position]) = self.command_counts(now) else {
            self.told = None;
            return None;
        };
        let is_at_rest = self.motion.setpoint().is_some_and(|at| at.velocity_rad_s.abs() <= 0.0);
        let is_known = self.told.is_some_and(|(told, told_at)| {
            // At rest the profile only has to be fast enough; in motion the servo would run ahead of its command.
            let is_same = if is_at_rest {
                (velocity..=velocity + CLOSE_COUNTS).contains(&told)
            } else {
                told == velocity
            };
            is_same && now < told_at + TOLD_EVERY
        });
        if !is_known {
            self.told = Some((velocity, now));
        }
        Some(Command { position, velocity: (!is_known).then_some(velocity) })
    }

    /// The velocity of its servo's profile and its goal position, in counts.
    ///
    /// The profile turns as fast as the command, and not faster than the joint may; its goal lies where it would come to
    /// a stop. So the servo does not stop between two cycles, and if no more is said it stops by itself, soon.
    pub(crate) fn command_counts(&self, now: Instant) -> Option<[i32; 2]> {
        if !self.may_move() {
            return None;
        }
        let slow_rad_s = self.policy.soft_start_rad_s.min(self.velocity_rad_s());
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

    /// Where the servo would come to a stop that turns as fast as the command, one cycle later; not beyond the goal.
    fn lead_rad(&self, at: Setpoint) -> f64 {
        let acceleration_rad_s2 = if self.is_quick() {
            self.settings.acceleration_rad_s2 * ACCELERATION_MARGIN
        } else {
            LOW_ACCELERATION_RAD_S2
        };
        let velocity = at.velocity_rad_s;
        let ahead_rad = velocity * self.policy.period.as_secs_f64()
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

    /// How fast the servo turns to keep up with the command: no faster than the joint may.
    fn speed_rad_s(&self, now: Instant, at: Setpoint) -> f64 {
        let (speed, error) = (at.velocity_rad_s.abs(), self.error_rad(now, at).unwrap_or(0.0));
        // The reading is as old as a cycle, and at rest it is behind whichever way it is off.
        let behind_rad = if speed > 0.0 {
            error * at.velocity_rad_s.signum() - speed * self.policy.period.as_secs_f64()
        } else {
            error.abs()
        };
        let speed_rad_s = (speed + CATCH_UP_PER_S * behind_rad).max(SLOWER * speed).max(SLOWEST_RAD_S);
        speed_rad_s.min(self.velocity_rad_s())
    }
}

/// A velocity of a profile in counts. Zero would be without limit.
pub(super) fn velocity(rad_s: f64) -> i32 {
    velocity_count(rad_s).clamp(1, 32_767)
}

/// The highest velocity of a profile, in counts, that is no faster than this.
fn velocity_below(rad_s: f64) -> i32 {
    let count = velocity(rad_s);
    let is_faster = servo::velocity_rad_s(count) > rad_s;
    (count - i32::from(is_faster)).max(1)
}
