use clock::Duration;
use quantity::number::{float_of_signed, round_i64};

use crate::mock::memory::{Memory, Mode};
use crate::model::{acceleration_rad_s2, velocity_rad_s};
use crate::table::{
    CURRENT_LIMIT, DRIVE_MODE, GOAL_CURRENT, GOAL_POSITION, GOAL_PWM, GOAL_VELOCITY, HOMING_OFFSET,
    MAX_VOLTAGE_LIMIT, MIN_VOLTAGE_LIMIT, MOVING, MOVING_STATUS, MOVING_THRESHOLD, POSITION_TRAJECTORY,
    PRESENT_CURRENT, PRESENT_INPUT_VOLTAGE, PRESENT_POSITION, PRESENT_PWM, PRESENT_TEMPERATURE,
    PRESENT_VELOCITY, PROFILE_ACCELERATION, PROFILE_VELOCITY, PWM_LIMIT, TEMPERATURE_LIMIT, TORQUE_ENABLE,
    VELOCITY_LIMIT, VELOCITY_TRAJECTORY,
};
use crate::{Limits, Model, Motion, position_count, position_rad, velocity_count};

use super::HardwareError;

/// Maximum integration step.
const STEP: Duration = Duration::from_millis(1);
/// Maximum number of integration steps; one long step covers the remaining time.
const MAX_STEPS: u64 = 10_000;
/// Acceleration limit of any servo, for a profile without one.
const MAX_ACCELERATION_RAD_S2: f64 = 2000.0;
/// Acceleration in PWM mode.
const PWM_ACCELERATION_RAD_S2: f64 = 50.0;
/// Current against constant friction.
const IDLE_A: f64 = 0.02;
/// Current against friction that grows with the speed.
const A_PER_RAD_S: f64 = 0.03;
/// Current that accelerates the inertia.
const A_PER_RAD_S2: f64 = 0.002;
/// Ambient temperature, and heating and cooling of the winding.
const AMBIENT_C: f64 = 25.0;
const HEATING_C_PER_A2_S: f64 = 0.5;
const COOLING_PER_S: f64 = 0.01;
/// Source resistance of the supply.
const SUPPLY_OHM: f64 = 0.1;
/// Overload: this share of the current limit for longer than `OVERLOAD_S` seconds.
const OVERLOAD: f64 = 0.8;
const OVERLOAD_S: f64 = 1.0;
/// Drive mode bit for reverse mode: positions, velocities, currents and duties change sign.
const REVERSE: i64 = 1;
/// Drive mode bit for time-based profiles.
const TIME_BASED: i64 = 1 << 2;
/// Tolerance for "in position", in counts.
const ARRIVED: i64 = 20;
/// Counts of a PWM duty of 100 %.
const FULL_DUTY: f64 = 885.0;
/// Duty per count of position error: the default Position P Gain (address 84) divided by 128.
const DUTY_PER_COUNT: f64 = 800.0 / 128.0 / FULL_DUTY;
/// Following error limit, in counts.
const CANNOT_FOLLOW: i64 = 50;
/// Tolerance for a velocity that exceeds the duty's limit by rounding only.
const ROUNDING: f64 = 1.000_001;

/// The state of the shaft, in the shaft's own frame; the drive mode determines the sign in the control table.
#[derive(Clone, Debug)]
pub(super) struct Dynamics {
    model: Model,
    motion: Motion,
    /// The state of the profile. It runs ahead of the shaft if an obstacle or a low duty holds the shaft back.
    trajectory: Motion,
    /// Whether it moves to the goal, or holds until a goal is written.
    going: bool,
    /// The profile limits at the time the goal was written.
    profile: Option<Limits>,
    /// Whether an obstacle blocks the shaft: set by a caller, and set by a fault.
    blocked: [bool; 2],
    /// The duty with which the shaft pushes against an obstacle.
    push: f64,
    current_a: f64,
    temperature_c: f64,
    /// Current of the external load, in addition to that of the motion.
    load_a: f64,
    supply_v: f64,
    /// The supply voltage while a fault reduces it.
    sag_v: Option<f64>,
    overloaded_s: f64,
}

/// The origin of an obstacle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Obstacle {
    Caller,
    Fault,
}

impl Dynamics {
    pub(super) const fn new(model: Model, position_rad: f64) -> Self {
        Self {
            model,
            motion: Motion::at(position_rad),
            trajectory: Motion::at(position_rad),
            going: false,
            profile: None,
            blocked: [false; 2],
            push: 0.0,
            current_a: 0.0,
            temperature_c: AMBIENT_C,
            load_a: 0.0,
            supply_v: model.nominal_volts(),
            sag_v: None,
            overloaded_s: 0.0,
        }
    }

    pub(super) const fn motion(&self) -> Motion {
        self.motion
    }

    pub(super) fn displace(&mut self, by_rad: f64) {
        self.motion.position_rad += by_rad;
        self.trajectory.position_rad += by_rad;
    }

    /// Blocks or releases the shaft.
    pub(super) const fn block(&mut self, obstacle: Obstacle, holds: bool) {
        let [caller, fault] = self.blocked;
        self.blocked = match obstacle {
            Obstacle::Caller => [holds, fault],
            Obstacle::Fault => [caller, holds],
        };
    }

    /// Whether the obstacle of this origin blocks the shaft.
    pub(super) const fn is_held_by(&self, obstacle: Obstacle) -> bool {
        let [caller, fault] = self.blocked;
        match obstacle {
            Obstacle::Caller => caller,
            Obstacle::Fault => fault,
        }
    }

    /// Whether any obstacle blocks the shaft.
    pub(super) const fn is_blocked(&self) -> bool {
        let [caller, fault] = self.blocked;
        caller || fault
    }

    pub(super) const fn set_temperature(&mut self, temperature_c: f64) {
        self.temperature_c = temperature_c;
    }

    pub(super) const fn load(&mut self, amperes: f64) {
        self.load_a = amperes;
    }

    pub(super) const fn supply(&mut self, volts: f64) {
        self.supply_v = volts;
    }

    /// Sets the supply voltage during a fault, in volts; `None` after it.
    pub(super) const fn sag(&mut self, volts: Option<f64>) {
        self.sag_v = volts;
    }

    pub(super) const fn sags(&self) -> Option<f64> {
        self.sag_v
    }

    /// Moves to the goal in the table, with the profile that the table holds now.
    pub(super) fn go(&mut self, memory: &Memory) {
        self.going = true;
        self.profile = Some(self.time_based(memory).unwrap_or_else(|| Self::limits(memory)));
    }

    pub(super) const fn stop(&mut self) {
        self.going = false;
        self.profile = None;
        self.trajectory = self.motion;
    }

    /// The shaft's position in counts, without the homing offset.
    pub(super) fn count(&self, memory: &Memory) -> i32 {
        position_count(direction(memory) * self.motion.position_rad)
    }

    /// Removes full turns.
    pub(super) fn remove_turns(&mut self, memory: &Memory) {
        let turns = f64::from(self.count(memory).div_euclid(4096));
        let by_rad = direction(memory) * turns * std::f64::consts::TAU;
        self.motion.position_rad -= by_rad;
        self.trajectory.position_rad -= by_rad;
    }

    /// The active hardware errors, one bit each.
    pub(super) fn errors(&self, memory: &Memory) -> i64 {
        let volts = round_i64(10.0 * self.volts());
        let mut errors = 0;
        if round_i64(self.temperature_c) > memory.get(TEMPERATURE_LIMIT) {
            errors |= HardwareError::Overheating.bit();
        }
        if !(memory.get(MIN_VOLTAGE_LIMIT)..=memory.get(MAX_VOLTAGE_LIMIT)).contains(&volts) {
            errors |= HardwareError::InputVoltage.bit();
        }
        if self.overloaded_s > OVERLOAD_S {
            errors |= HardwareError::Overload.bit();
        }
        errors
    }

    pub(super) fn advance(&mut self, memory: &Memory, by: Duration) {
        let torque = memory.get(TORQUE_ENABLE) == 1;
        let limits = self.profile.unwrap_or_else(|| Self::limits(memory));
        let max_a = OVERLOAD * float_of_signed(memory.get(CURRENT_LIMIT)) * self.model.amperes_per_count();
        let mut left = by;
        let mut steps = 0;
        while !left.is_zero() {
            let step = if steps < MAX_STEPS { left.min(STEP) } else { left };
            let dt_s = step.as_secs_f64();
            if !torque {
                self.trajectory = self.motion;
            }
            // The inputs are integers from the table, so there is always a next motion.
            let led = self.next(memory, torque, limits, dt_s).unwrap_or(self.trajectory);
            let next = self.follow(memory, torque, led, dt_s);
            let acceleration = (next.velocity_rad_s - self.motion.velocity_rad_s) / dt_s;
            self.trajectory = led;
            self.motion = next;
            self.push = if torque { self.push(memory) } else { 0.0 };
            self.current_a =
                if torque { self.current(memory, next.velocity_rad_s, acceleration) } else { 0.0 };
            let cooling = COOLING_PER_S * (self.temperature_c - AMBIENT_C);
            let heating = HEATING_C_PER_A2_S * self.current_a * self.current_a - cooling;
            self.temperature_c += heating * dt_s.min(1.0);
            let overloaded = max_a > 0.0 && self.current_a.abs() > max_a;
            self.overloaded_s = if overloaded { self.overloaded_s + dt_s } else { 0.0 };
            left -= step;
            steps += 1;
        }
    }

    /// The state of the profile after a step.
    fn next(&self, memory: &Memory, torque: bool, limits: Limits, dt_s: f64) -> Option<Motion> {
        if !(torque && self.going) {
            return self.trajectory.stopping(limits, dt_s);
        }
        let full_rad_s = self.full_rad_s();
        match memory.mode() {
            Mode::CurrentBasedPosition if memory.get(GOAL_CURRENT) == 0 => {
                self.trajectory.stopping(limits, dt_s)
            }
            Mode::Position | Mode::ExtendedPosition | Mode::CurrentBasedPosition => {
                self.trajectory.towards(goal_rad(memory), limits, dt_s)
            }
            Mode::Velocity => {
                let goal = velocity_rad_s(i32::try_from(memory.get(GOAL_VELOCITY)).unwrap_or(0));
                self.turn(direction(memory) * goal, limits.acceleration_rad_s2, dt_s)
            }
            Mode::Current => {
                let goal_a = float_of_signed(memory.get(GOAL_CURRENT)) * self.model.amperes_per_count();
                let driving =
                    direction(memory) * goal_a - self.load_a - A_PER_RAD_S * self.trajectory.velocity_rad_s;
                let moving = driving.abs() > IDLE_A;
                let goal = if moving { limits.velocity_rad_s.copysign(driving) } else { 0.0 };
                self.turn(goal, (driving.abs() / A_PER_RAD_S2).clamp(1.0, MAX_ACCELERATION_RAD_S2), dt_s)
            }
            Mode::Pwm => {
                let duty = float_of_signed(memory.get(GOAL_PWM)) / FULL_DUTY;
                self.turn(direction(memory) * duty * full_rad_s, PWM_ACCELERATION_RAD_S2, dt_s)
            }
        }
    }

    /// The state of the shaft after a step, when the profile is at `led`. The shaft follows the profile as far as
    /// obstacles and duty permit.
    fn follow(&self, memory: &Memory, torque: bool, led: Motion, dt_s: f64) -> Motion {
        let before = self.motion;
        if self.is_blocked() {
            return Motion::at(before.position_rad);
        }
        if !torque {
            return led;
        }
        let max_rad_s = duty(memory) * self.full_rad_s();
        let asked_rad_s = if self.going && !memory.mode().has_position() {
            led.velocity_rad_s
        } else {
            (led.position_rad - before.position_rad) / dt_s
        };
        if before == self.trajectory && led.velocity_rad_s.abs() <= max_rad_s * ROUNDING
            || asked_rad_s.abs() <= max_rad_s
        {
            return led;
        }
        // Released, or with too little duty, the shaft catches up as fast as its duty permits.
        let step = MAX_ACCELERATION_RAD_S2 * dt_s;
        let change = asked_rad_s.clamp(-max_rad_s, max_rad_s) - before.velocity_rad_s;
        let velocity_rad_s = before.velocity_rad_s + change.clamp(-step, step);
        Motion { position_rad: before.position_rad + velocity_rad_s * dt_s, velocity_rad_s }
    }

    /// The duty with which the shaft pushes against an obstacle that keeps it from its trajectory.
    fn push(&self, memory: &Memory) -> f64 {
        let max = duty(memory);
        if !self.is_blocked() {
            0.0
        } else if self.going && !memory.mode().has_position() {
            max * self.trajectory.velocity_rad_s.partial_cmp(&0.0).map_or(0.0, |order| match order {
                std::cmp::Ordering::Less => -1.0,
                std::cmp::Ordering::Equal => 0.0,
                std::cmp::Ordering::Greater => 1.0,
            })
        } else {
            let error_rad = self.trajectory.position_rad - self.motion.position_rad;
            let counts = error_rad * 4096.0 / std::f64::consts::TAU;
            (counts * DUTY_PER_COUNT).clamp(-max, max)
        }
    }

    /// Velocity at full duty.
    fn full_rad_s(&self) -> f64 {
        velocity_rad_s(i32::try_from(self.model.velocity_limit()).unwrap_or(i32::MAX))
    }

    /// The motion after a step in velocity control: accelerates towards the velocity `goal`.
    fn turn(&self, goal: f64, acceleration: f64, dt_s: f64) -> Option<Motion> {
        let step = acceleration * dt_s;
        if !(goal.is_finite() && step.is_finite()) {
            return None;
        }
        let before = self.trajectory.velocity_rad_s;
        let velocity_rad_s = before + (goal - before).max(-step).min(step);
        // Only the velocity is controlled, so the position continues from the shaft's own.
        let position_rad = self.motion.position_rad + (before + velocity_rad_s) / 2.0 * dt_s;
        Some(Motion { position_rad, velocity_rad_s })
    }

    fn current(&self, memory: &Memory, velocity: f64, acceleration: f64) -> f64 {
        let friction = if velocity.abs() > 0.0 { IDLE_A.copysign(velocity) } else { 0.0 };
        let limit_a = float_of_signed(memory.get(CURRENT_LIMIT)) * self.model.amperes_per_count();
        let moves = friction + A_PER_RAD_S * velocity + A_PER_RAD_S2 * acceleration;
        let asked = self.load_a + moves + self.push * limit_a;
        let bounded = memory.mode() == Mode::CurrentBasedPosition;
        let max = if bounded { GOAL_CURRENT } else { CURRENT_LIMIT };
        let max_a = float_of_signed(memory.get(max).abs()) * self.model.amperes_per_count();
        asked.max(-max_a).min(max_a)
    }

    fn volts(&self) -> f64 {
        self.sag_v.unwrap_or(self.supply_v) - SUPPLY_OHM * self.current_a.abs()
    }

    pub(super) fn show(&self, memory: &mut Memory) {
        let (offset, direction) = (memory.get(HOMING_OFFSET), direction(memory));
        let position = i64::from(self.count(memory)) + offset;
        let velocity = i64::from(velocity_count(direction * self.motion.velocity_rad_s));
        let led = i64::from(position_count(direction * self.trajectory.position_rad)) + offset;
        let led_velocity = i64::from(velocity_count(direction * self.trajectory.velocity_rad_s));
        let free_duty = self.motion.velocity_rad_s / self.full_rad_s() + self.current_a * SUPPLY_OHM;
        let duty = direction * if self.is_blocked() { self.push } else { free_duty };
        let pwm_limit = memory.get(PWM_LIMIT);
        let moving = velocity.abs() > memory.get(MOVING_THRESHOLD);
        let arrived = (memory.get(GOAL_POSITION) - position).abs() < ARRIVED;
        let profile = self.going && led_velocity != 0;
        let lags = (led - position).abs() > CANNOT_FOLLOW;
        let trapezoid = if memory.get(PROFILE_VELOCITY) == 0 { 0 } else { 0b11 << 4 };
        memory.set(MOVING, i64::from(moving));
        memory.set(
            MOVING_STATUS,
            i64::from(arrived) | i64::from(profile) << 1 | i64::from(lags) << 3 | trapezoid,
        );
        memory.set(PRESENT_PWM, round_i64(duty * FULL_DUTY).max(-pwm_limit).min(pwm_limit));
        memory.set(PRESENT_CURRENT, round_i64(direction * self.current_a / self.model.amperes_per_count()));
        memory.set(PRESENT_VELOCITY, velocity);
        memory.set(PRESENT_POSITION, position);
        memory.set(VELOCITY_TRAJECTORY, led_velocity);
        memory.set(POSITION_TRAJECTORY, led);
        memory.set(PRESENT_INPUT_VOLTAGE, round_i64(10.0 * self.volts()));
        memory.set(PRESENT_TEMPERATURE, round_i64(self.temperature_c));
    }

    /// The profile limits: the velocity limit and a high acceleration where the profile sets none.
    fn limits(memory: &Memory) -> Limits {
        let max = memory.get(VELOCITY_LIMIT).max(1);
        let timed = memory.get(DRIVE_MODE) & TIME_BASED != 0;
        let velocity = match memory.get(PROFILE_VELOCITY) {
            0 => max,
            _ if timed => max,
            profile => profile.min(max),
        };
        let acceleration_rad_s2 = match memory.get(PROFILE_ACCELERATION) {
            0 => MAX_ACCELERATION_RAD_S2,
            _ if timed => MAX_ACCELERATION_RAD_S2,
            profile => acceleration_rad_s2(i32::try_from(profile).unwrap_or(1)).min(MAX_ACCELERATION_RAD_S2),
        };
        Limits { velocity_rad_s: velocity_rad_s(i32::try_from(velocity).unwrap_or(1)), acceleration_rad_s2 }
    }

    /// The limits of a time-based profile, which sets the total time and the acceleration time in milliseconds.
    fn time_based(&self, memory: &Memory) -> Option<Limits> {
        let in_all_s = float_of_signed(memory.get(PROFILE_VELOCITY)) / 1000.0;
        if memory.get(DRIVE_MODE) & TIME_BASED == 0 || in_all_s <= 0.0 {
            return None;
        }
        let distance = (goal_rad(memory) - self.trajectory.position_rad).abs();
        let speeding_s = (float_of_signed(memory.get(PROFILE_ACCELERATION)) / 1000.0).min(in_all_s / 2.0);
        let limits = Self::limits(memory);
        let velocity_rad_s = (distance / (in_all_s - speeding_s)).min(limits.velocity_rad_s);
        let acceleration_rad_s2 = (velocity_rad_s / speeding_s).min(limits.acceleration_rad_s2);
        (velocity_rad_s > 0.0).then_some(Limits { velocity_rad_s, acceleration_rad_s2 })
    }
}

/// The goal in the shaft's frame, in radians.
fn goal_rad(memory: &Memory) -> f64 {
    let goal = memory.get(GOAL_POSITION) - memory.get(HOMING_OFFSET);
    direction(memory) * position_rad(i32::try_from(goal).unwrap_or(0))
}

/// Sign of the table's values relative to the shaft, by the reverse mode bit.
fn direction(memory: &Memory) -> f64 {
    if memory.get(DRIVE_MODE) & REVERSE == 0 { 1.0 } else { -1.0 }
}

/// Maximum duty: the PWM limit, and also the goal PWM unless it is the controlled value.
fn duty(memory: &Memory) -> f64 {
    let limit = memory.get(PWM_LIMIT);
    let max = if memory.mode() == Mode::Pwm { limit } else { limit.min(memory.get(GOAL_PWM).abs()) };
    float_of_signed(max) / FULL_DUTY
}
