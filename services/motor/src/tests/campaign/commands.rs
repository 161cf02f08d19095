use config::motor::{Joint, Motor};
use message::{JointCause, JointState};
use servo::mock::Servo;
use servo::table::{GOAL_POSITION, Item, PROFILE_ACCELERATION, PROFILE_VELOCITY, TORQUE_ENABLE};
use servo::{acceleration_count, position_count, velocity_count};

use super::DUPLICATED_BUS;

/// Rounding error, in radians and in radians per second.
const SLIGHT: f64 = 1e-9;
/// A setpoint that is further ahead of its joint may wait at any moment: the bound is 0.3 rad.
const WAITS_RAD: f64 = 0.2;
/// How much faster than its joint a servo's profile may be, and how much more it may accelerate.
const VELOCITY_MARGIN: f64 = 1.5;
const ACCELERATION_MARGIN: f64 = 8.0;

/// Setpoint of a joint after a cycle.
#[derive(Clone, Copy, Debug)]
struct Command {
    position_rad: f64,
    /// Average velocity in that cycle; `None` if the motion has just begun.
    velocity_rad_s: Option<f64>,
}

/// Checks the setpoints of all joints, and what reached their servos, against their limits.
#[derive(Debug)]
pub(crate) struct Commands {
    before: Vec<Option<Command>>,
    before_s: f64,
    /// Pairs of cycles whose velocities were compared.
    pub(crate) compared: u64,
    /// Servos with torque whose goals and profiles were checked.
    pub(crate) obeyed: u64,
}

fn value(servo: &Servo, item: Item) -> i32 {
    let bytes = servo.read(item.address, item.length).unwrap();
    i32::from_le_bytes(bytes.try_into().unwrap())
}

/// Checks the registers of a servo with torque: the goal is within the joint's limits, and the profile is limited.
/// Returns whether it has torque.
pub(crate) fn check_servo(servo: &Servo, joint: &Joint) -> bool {
    if servo.read(TORQUE_ENABLE.address, 1) != Ok(&[1]) {
        return false;
    }
    let [one, other] = [joint.min_rad, joint.max_rad].map(|rad| position_count(joint.servo_rad(rad)));
    let velocity = velocity_count(joint.max_velocity_rad_s * VELOCITY_MARGIN);
    let acceleration = acceleration_count(joint.max_acceleration_rad_s2 * ACCELERATION_MARGIN);
    for (item, min, max) in [
        (GOAL_POSITION, one.min(other), one.max(other)),
        // Zero would mean unlimited.
        (PROFILE_VELOCITY, 1, velocity),
        (PROFILE_ACCELERATION, 1, acceleration),
    ] {
        let told = value(servo, item);
        let (name, address) = (&joint.name, item.address);
        assert!((min..=max).contains(&told), "{name}: item {address} is {told}, not {min} to {max}");
    }
    true
}

/// Checks the causes of failures: no servo is sent anything that it must refuse, and only one bus has a duplicate
/// identifier.
pub(crate) fn check_causes(states: impl Iterator<Item = JointState>, robot: &Motor) {
    for (state, joint) in states.zip(&robot.joints) {
        let is_wrong = match state.cause() {
            Some(JointCause::Refused) => true,
            Some(JointCause::DuplicateId) => robot.buses[joint.bus].name != DUPLICATED_BUS,
            _ => false,
        };
        assert!(!is_wrong, "{}: {state:?}", joint.name);
    }
}

impl Commands {
    pub(crate) fn new(joints: usize) -> Self {
        Self { before: vec![None; joints], before_s: 0.0, compared: 0, obeyed: 0 }
    }

    /// Checks the setpoints of a cycle in which they advanced by `dt_s`.
    pub(crate) fn check(&mut self, dt_s: f64, states: impl Iterator<Item = JointState>, joints: &[Joint]) {
        for ((state, joint), before) in states.zip(joints).zip(&mut self.before) {
            let name = &joint.name;
            // The setpoint of a blocked joint jumps to its position, and one that is far ahead waits: both stop at
            // once.
            let is_blocked = state.cause() == Some(JointCause::Blocked);
            let Some(position_rad) = state.command_position_rad().filter(|_| !is_blocked) else {
                *before = None;
                continue;
            };
            let waits = state
                .present_position_rad()
                .is_some_and(|present| (position_rad - present).abs() > WAITS_RAD);
            if waits {
                *before = Some(Command { position_rad, velocity_rad_s: None });
                continue;
            }
            assert!((joint.min_rad..=joint.max_rad).contains(&position_rad), "{name}: {position_rad} rad");
            let velocity_rad_s = before.map(|before| (position_rad - before.position_rad) / dt_s);
            if let Some(velocity) = velocity_rad_s {
                let max = joint.max_velocity_rad_s;
                assert!(velocity.abs() <= max + SLIGHT / dt_s, "{name}: {velocity} rad/s, {max} at most");
            }
            if let Some((now, then)) = velocity_rad_s.zip(before.and_then(|before| before.velocity_rad_s)) {
                // From the middle of the previous cycle to the middle of this one.
                let max = joint.max_acceleration_rad_s2 * f64::midpoint(self.before_s, dt_s);
                let by = now - then;
                assert!(by.abs() <= max + SLIGHT / dt_s, "{name}: {by} rad/s more, {max} at most");
                self.compared += 1;
            }
            *before = Some(Command { position_rad, velocity_rad_s });
        }
        self.before_s = dt_s;
    }
}
