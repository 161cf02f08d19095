use config::motor::Joint;
use message::JointState;

/// What is lost in rounding, in radians and in radians per second.
const SLIGHT: f64 = 1e-9;

/// The command of a joint after a cycle.
#[derive(Clone, Copy, Debug)]
struct Command {
    position_rad: f64,
    /// How fast it went there in that cycle, on average; none where it has just begun.
    velocity_rad_s: Option<f64>,
}

/// What all joints were commanded, cycle by cycle: it is compared with their limits.
#[derive(Debug)]
pub(crate) struct Commands {
    before: Vec<Option<Command>>,
    before_s: f64,
    /// Pairs of cycles whose velocities were compared.
    pub(crate) compared: u64,
}

impl Commands {
    pub(crate) fn new(joints: usize) -> Self {
        Self { before: vec![None; joints], before_s: 0.0, compared: 0 }
    }

    /// Compares what was commanded in a cycle in which commands moved on by `dt_s`.
    pub(crate) fn check(&mut self, dt_s: f64, states: impl Iterator<Item = JointState>, joints: &[Joint]) {
        for ((state, joint), before) in states.zip(joints).zip(&mut self.before) {
            let name = &joint.name;
            let Some(position_rad) = state.command_position_rad() else {
                *before = None;
                continue;
            };
            assert!((joint.min_rad..=joint.max_rad).contains(&position_rad), "{name}: {position_rad} rad");
            let velocity_rad_s = before.map(|before| (position_rad - before.position_rad) / dt_s);
            if let Some(velocity) = velocity_rad_s {
                let most = joint.velocity_rad_s;
                assert!(velocity.abs() <= most + SLIGHT / dt_s, "{name}: {velocity} rad/s, {most} at most");
            }
            if let Some((now, then)) = velocity_rad_s.zip(before.and_then(|before| before.velocity_rad_s)) {
                // From the middle of the cycle before to the middle of this one.
                let most = joint.acceleration_rad_s2 * f64::midpoint(self.before_s, dt_s);
                let by = now - then;
                assert!(by.abs() <= most + SLIGHT / dt_s, "{name}: {by} rad/s more, {most} at most");
                self.compared += 1;
            }
            *before = Some(Command { position_rad, velocity_rad_s });
        }
        self.before_s = dt_s;
    }
}
