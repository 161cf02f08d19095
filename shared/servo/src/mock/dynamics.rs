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

/// The longest step of the integration.
const STEP: Duration = Duration::from_millis(1);
/// Beyond this, time only heats or cools: the servo has long arrived.
const STEPS_MOST: u64 = 10_000;
/// What no servo exceeds, in radians per second squared: for a profile without acceleration.
const ACCELERATION_MOST_RAD_S2: f64 = 2000.0;
/// How quickly it follows its duty.
const PWM_ACCELERATION_RAD_S2: f64 = 50.0;
/// Current that moves the servo without load, and what its inertia and friction add.
const IDLE_A: f64 = 0.02;
const A_PER_RAD_S: f64 = 0.03;
const A_PER_RAD_S2: f64 = 0.002;
/// The air, and how the winding heats and cools.
const AMBIENT_C: f64 = 25.0;
const HEATING_C_PER_A2_S: f64 = 0.5;
const COOLING_PER_S: f64 = 0.01;
/// Resistance of the supply.
const SUPPLY_OHM: f64 = 0.1;
/// Of the factory's current limit, what is too much for longer than a second.
const OVERLOAD: f64 = 0.8;
const OVERLOAD_S: f64 = 1.0;
/// The drive mode in which profiles are times.
const TIME_BASED: i64 = 1 << 2;
/// As near as this to the goal, in counts, it has arrived.
const ARRIVED: i64 = 20;
/// The counts of a duty of 100 %.
const FULL_DUTY: f64 = 885.0;

/// What moves.
#[derive(Clone, Debug)]
pub(super) struct Dynamics {
    model: Model,
    motion: Motion,
    /// Whether it goes to the goal, or stands until there is one.
    going: bool,
    /// What the profile allows on the way to the goal, where it is a time.
    timed: Option<Limits>,
    current_a: f64,
    temperature_c: f64,
    /// What the load takes, beside what the motion does.
    load_a: f64,
    supply_v: f64,
    overloaded_s: f64,
}

impl Dynamics {
    pub(super) const fn new(model: Model, position_rad: f64) -> Self {
        Self {
            model,
            motion: Motion::at(position_rad),
            going: false,
            timed: None,
            current_a: 0.0,
            temperature_c: AMBIENT_C,
            load_a: 0.0,
            supply_v: model.nominal_volts(),
            overloaded_s: 0.0,
        }
    }

    pub(super) const fn motion(&self) -> Motion {
        self.motion
    }

    pub(super) fn push_by(&mut self, by_rad: f64) {
        self.motion.position_rad += by_rad;
    }

    pub(super) const fn warm_to(&mut self, temperature_c: f64) {
        self.temperature_c = temperature_c;
    }

    pub(super) const fn load(&mut self, amperes: f64) {
        self.load_a = amperes;
    }

    pub(super) const fn supply(&mut self, volts: f64) {
        self.supply_v = volts;
    }

    /// Goes to the goal that stands in the table.
    pub(super) fn go(&mut self, memory: &Memory) {
        self.going = true;
        self.timed = self.time_based(memory);
    }

    pub(super) const fn stop(&mut self) {
        self.going = false;
    }

    /// Forgets whole turns.
    pub(super) fn unwind(&mut self) {
        let count = position_count(self.motion.position_rad);
        let turns = count.div_euclid(4096);
        self.motion.position_rad -= f64::from(turns) * std::f64::consts::TAU;
    }

    /// What the servo protects itself from, one bit each.
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
        let limits = self.limits(memory);
        let mut left = by;
        let mut steps = 0;
        while !left.is_zero() {
            let step = if steps < STEPS_MOST { left.min(STEP) } else { left };
            let dt_s = step.as_secs_f64();
            // The numbers come from a table of integers: there is always a next motion.
            let next = self.next(memory, torque, limits, dt_s).unwrap_or(self.motion);
            let acceleration = (next.velocity_rad_s - self.motion.velocity_rad_s) / dt_s;
            self.current_a =
                if torque { self.current(memory, next.velocity_rad_s, acceleration) } else { 0.0 };
            let cooling = COOLING_PER_S * (self.temperature_c - AMBIENT_C);
            let heating = HEATING_C_PER_A2_S * self.current_a * self.current_a - cooling;
            self.temperature_c += heating * dt_s.min(1.0);
            let most_a =
                OVERLOAD * float_of_signed(memory.get(CURRENT_LIMIT)) * self.model.amperes_per_count();
            let overloaded = most_a > 0.0 && self.current_a.abs() > most_a;
            self.overloaded_s = if overloaded { self.overloaded_s + dt_s } else { 0.0 };
            self.motion = next;
            left -= step;
            steps += 1;
        }
    }

    fn next(&self, memory: &Memory, torque: bool, limits: Limits, dt_s: f64) -> Option<Motion> {
        if !(torque && self.going) {
            return self.motion.stopping(limits, dt_s);
        }
        match memory.mode() {
            Mode::CurrentBasedPosition if memory.get(GOAL_CURRENT) == 0 => self.motion.stopping(limits, dt_s),
            Mode::Position | Mode::ExtendedPosition | Mode::CurrentBasedPosition => {
                self.motion.towards(goal_rad(memory), self.timed.unwrap_or(limits), dt_s)
            }
            Mode::Velocity => {
                let goal = velocity_rad_s(i32::try_from(memory.get(GOAL_VELOCITY)).unwrap_or(0));
                self.turn(goal, limits.acceleration_rad_s2, dt_s)
            }
            Mode::Current => {
                let goal_a = float_of_signed(memory.get(GOAL_CURRENT)) * self.model.amperes_per_count();
                let driving = goal_a - self.load_a - A_PER_RAD_S * self.motion.velocity_rad_s;
                let moving = driving.abs() > IDLE_A;
                let goal = if moving { limits.velocity_rad_s.copysign(driving) } else { 0.0 };
                self.turn(goal, (driving.abs() / A_PER_RAD_S2).clamp(1.0, ACCELERATION_MOST_RAD_S2), dt_s)
            }
            Mode::Pwm => {
                let duty = float_of_signed(memory.get(GOAL_PWM)) / FULL_DUTY;
                self.turn(duty * no_load_rad_s(memory), PWM_ACCELERATION_RAD_S2, dt_s)
            }
        }
    }

    /// The motion later, when it turns as fast as `goal` as soon as it may.
    fn turn(&self, goal: f64, acceleration: f64, dt_s: f64) -> Option<Motion> {
        let step = acceleration * dt_s;
        if !(goal.is_finite() && step.is_finite()) {
            return None;
        }
        let before = self.motion.velocity_rad_s;
        let velocity_rad_s = before + (goal - before).max(-step).min(step);
        let position_rad = self.motion.position_rad + (before + velocity_rad_s) / 2.0 * dt_s;
        Some(Motion { position_rad, velocity_rad_s })
    }

    fn current(&self, memory: &Memory, velocity: f64, acceleration: f64) -> f64 {
        let friction = if velocity.abs() > 0.0 { IDLE_A.copysign(velocity) } else { 0.0 };
        let asked = self.load_a + friction + A_PER_RAD_S * velocity + A_PER_RAD_S2 * acceleration;
        let bounded = memory.mode() == Mode::CurrentBasedPosition;
        let most = if bounded { GOAL_CURRENT } else { CURRENT_LIMIT };
        let most_a = float_of_signed(memory.get(most).abs()) * self.model.amperes_per_count();
        asked.max(-most_a).min(most_a)
    }

    fn volts(&self) -> f64 {
        self.supply_v - SUPPLY_OHM * self.current_a.abs()
    }

    pub(super) fn show(&self, memory: &mut Memory) {
        let offset = memory.get(HOMING_OFFSET);
        let position = i64::from(position_count(self.motion.position_rad)) + offset;
        let velocity = i64::from(velocity_count(self.motion.velocity_rad_s));
        let duty = self.motion.velocity_rad_s / no_load_rad_s(memory) + self.current_a * SUPPLY_OHM;
        let pwm_limit = memory.get(PWM_LIMIT);
        let moving = velocity.abs() > memory.get(MOVING_THRESHOLD);
        let arrived = (memory.get(GOAL_POSITION) - position).abs() < ARRIVED;
        let profile = self.going && velocity != 0;
        let trapezoid = if memory.get(PROFILE_VELOCITY) == 0 { 0 } else { 0b11 << 4 };
        memory.set(MOVING, i64::from(moving));
        memory.set(MOVING_STATUS, i64::from(arrived) | i64::from(profile) << 1 | trapezoid);
        memory.set(PRESENT_PWM, round_i64(duty * FULL_DUTY).max(-pwm_limit).min(pwm_limit));
        memory.set(PRESENT_CURRENT, round_i64(self.current_a / self.model.amperes_per_count()));
        memory.set(PRESENT_VELOCITY, velocity);
        memory.set(PRESENT_POSITION, position);
        memory.set(VELOCITY_TRAJECTORY, velocity);
        memory.set(POSITION_TRAJECTORY, position);
        memory.set(PRESENT_INPUT_VOLTAGE, round_i64(10.0 * self.volts()));
        memory.set(PRESENT_TEMPERATURE, round_i64(self.temperature_c));
    }

    /// What the profile allows: the velocity limit and a great acceleration where it says nothing.
    fn limits(&self, memory: &Memory) -> Limits {
        let most = memory.get(VELOCITY_LIMIT).max(1);
        let timed = memory.get(DRIVE_MODE) & TIME_BASED != 0;
        let velocity = match memory.get(PROFILE_VELOCITY) {
            0 => most,
            _ if timed => most,
            profile => profile.min(most),
        };
        let acceleration_rad_s2 = match memory.get(PROFILE_ACCELERATION) {
            0 => ACCELERATION_MOST_RAD_S2,
            _ if timed => ACCELERATION_MOST_RAD_S2,
            profile => acceleration_rad_s2(i32::try_from(profile).unwrap_or(1)).min(ACCELERATION_MOST_RAD_S2),
        };
        Limits { velocity_rad_s: velocity_rad_s(i32::try_from(velocity).unwrap_or(1)), acceleration_rad_s2 }
    }

    /// The limits of a profile that says how long it takes in all and how long it accelerates, in
    /// milliseconds.
    fn time_based(&self, memory: &Memory) -> Option<Limits> {
        let in_all_s = float_of_signed(memory.get(PROFILE_VELOCITY)) / 1000.0;
        if memory.get(DRIVE_MODE) & TIME_BASED == 0 || in_all_s <= 0.0 {
            return None;
        }
        let distance = (goal_rad(memory) - self.motion.position_rad).abs();
        let speeding_s = (float_of_signed(memory.get(PROFILE_ACCELERATION)) / 1000.0).min(in_all_s / 2.0);
        let limits = self.limits(memory);
        let velocity_rad_s = (distance / (in_all_s - speeding_s)).min(limits.velocity_rad_s);
        let acceleration_rad_s2 = (velocity_rad_s / speeding_s).min(limits.acceleration_rad_s2);
        (velocity_rad_s > 0.0).then_some(Limits { velocity_rad_s, acceleration_rad_s2 })
    }
}

fn goal_rad(memory: &Memory) -> f64 {
    let goal = memory.get(GOAL_POSITION) - memory.get(HOMING_OFFSET);
    position_rad(i32::try_from(goal).unwrap_or(0))
}

/// How fast it turns at full duty.
fn no_load_rad_s(memory: &Memory) -> f64 {
    velocity_rad_s(i32::try_from(memory.get(VELOCITY_LIMIT).max(1)).unwrap_or(1))
}
