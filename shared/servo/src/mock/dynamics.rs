use clock::Duration;
use quantity::number::round_i64;

use crate::mock::memory::Memory;
use crate::model::{acceleration_rad_s2, velocity_rad_s};
use crate::table::{
    GOAL_POSITION, MOVING, POSITION_TRAJECTORY, PRESENT_CURRENT, PRESENT_INPUT_VOLTAGE, PRESENT_POSITION,
    PRESENT_TEMPERATURE, PRESENT_VELOCITY, PROFILE_ACCELERATION, PROFILE_VELOCITY, TEMPERATURE_LIMIT,
    TORQUE_ENABLE, VELOCITY_LIMIT, VELOCITY_TRAJECTORY,
};
use crate::{Limits, Model, Motion, position_count, position_rad, velocity_count};

/// The longest step of the integration.
const STEP: Duration = Duration::from_millis(1);
/// Beyond this, time only heats or cools: the servo has long arrived.
const STEPS_MOST: u64 = 10_000;
/// What no servo exceeds, in radians per second squared: for a profile without acceleration.
const ACCELERATION_MOST_RAD_S2: f64 = 2000.0;
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

/// What moves.
#[derive(Clone, Debug)]
pub(super) struct Dynamics {
    model: Model,
    motion: Motion,
    /// Whether it goes to the goal, or stands until there is one.
    going: bool,
    current_a: f64,
    temperature_c: f64,
}

impl Dynamics {
    pub(super) const fn new(model: Model, position_rad: f64) -> Self {
        let motion = Motion::at(position_rad);
        Self { model, motion, going: false, current_a: 0.0, temperature_c: AMBIENT_C }
    }

    pub(super) const fn motion(&self) -> Motion {
        self.motion
    }

    pub(super) const fn go(&mut self) {
        self.going = true;
    }

    pub(super) const fn stop(&mut self) {
        self.going = false;
    }

    pub(super) const fn warm_to(&mut self, temperature_c: f64) {
        self.temperature_c = temperature_c;
    }

    pub(super) fn overheats(&self, memory: &Memory) -> bool {
        round_i64(self.temperature_c) > memory.get(TEMPERATURE_LIMIT)
    }

    pub(super) fn advance(&mut self, memory: &Memory, by: Duration) {
        let torque = memory.get(TORQUE_ENABLE) == 1;
        let limits = limits(memory);
        let goal_rad = position_rad(i32::try_from(memory.get(GOAL_POSITION)).unwrap_or(0));
        let mut left = by;
        let mut steps = 0;
        while !left.is_zero() {
            let step = if steps < STEPS_MOST { left.min(STEP) } else { left };
            let dt_s = step.as_secs_f64();
            let next = if torque && self.going {
                self.motion.towards(goal_rad, limits, dt_s)
            } else {
                self.motion.stopping(limits, dt_s)
            };
            // The numbers come from a table of integers: there is always a next motion.
            let next = next.unwrap_or(self.motion);
            let acceleration = (next.velocity_rad_s - self.motion.velocity_rad_s) / dt_s;
            self.current_a = if torque {
                let friction =
                    if next.velocity_rad_s.abs() > 0.0 { IDLE_A.copysign(next.velocity_rad_s) } else { 0.0 };
                friction + A_PER_RAD_S * next.velocity_rad_s + A_PER_RAD_S2 * acceleration
            } else {
                0.0
            };
            let cooling = COOLING_PER_S * (self.temperature_c - AMBIENT_C);
            let heating = HEATING_C_PER_A2_S * self.current_a * self.current_a - cooling;
            self.temperature_c += heating * dt_s.min(1.0);
            self.motion = next;
            left -= step;
            steps += 1;
        }
    }

    pub(super) fn show(&self, memory: &mut Memory) {
        let position = i64::from(position_count(self.motion.position_rad));
        let velocity = i64::from(velocity_count(self.motion.velocity_rad_s));
        let volts = self.model.nominal_volts() - SUPPLY_OHM * self.current_a.abs();
        memory.set(MOVING, i64::from(velocity != 0));
        memory.set(PRESENT_CURRENT, round_i64(self.current_a / self.model.amperes_per_count()));
        memory.set(PRESENT_VELOCITY, velocity);
        memory.set(PRESENT_POSITION, position);
        memory.set(VELOCITY_TRAJECTORY, velocity);
        memory.set(POSITION_TRAJECTORY, position);
        memory.set(PRESENT_INPUT_VOLTAGE, round_i64(10.0 * volts));
        memory.set(PRESENT_TEMPERATURE, round_i64(self.temperature_c));
    }
}

/// What the profile allows: the velocity limit and a great acceleration where it says nothing.
fn limits(memory: &Memory) -> Limits {
    let most = memory.get(VELOCITY_LIMIT).max(1);
    let velocity = match memory.get(PROFILE_VELOCITY) {
        0 => most,
        profile => profile.min(most),
    };
    let acceleration = match memory.get(PROFILE_ACCELERATION) {
        0 => ACCELERATION_MOST_RAD_S2,
        profile => acceleration_rad_s2(i32::try_from(profile).unwrap_or(1)).min(ACCELERATION_MOST_RAD_S2),
    };
    let velocity_rad_s = velocity_rad_s(i32::try_from(velocity).unwrap_or(1));
    Limits { velocity_rad_s, acceleration_rad_s2: acceleration }
}
