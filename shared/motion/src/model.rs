use geometry::Position;
use invariant::require;
use kinematics::{ARM_JOINTS, Body, HandGoal, Side};

use crate::parts::{MissingJointError, Parts, set};

/// Position of a hand that waits in front of the chest, in metres, before the torso turns; y points outwards.
const READY_M: [f64; 3] = [0.30, 0.20, 0.26];
/// Height of the shoulders above the waist, in metres.
const SHOULDER_M: f64 = 0.4;
/// Torso configurations that help an arm, as (yaw, pitch) in radians, smallest first.
const STANCES: [(f64, f64); 6] =
    [(0.0, 0.0), (0.0, 0.25), (0.4, 0.0), (-0.4, 0.0), (0.4, 0.25), (-0.4, 0.25)];
/// Initial arm configuration in the search for the ready pose, in radians: elbow out and bent, hand down.
const ELBOW_OUT: [f64; ARM_JOINTS] = [-0.5, 0.5, 0.0, -1.4, 0.0, 1.2, 0.0];

/// The constant data of a performer.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) body: Body,
    pub(crate) parts: Parts,
    pub(crate) rest_rad: Vec<f64>,
    pub(crate) stances: Vec<Stance>,
}

/// A torso configuration, and the arm configurations with the hands ready in front of the chest, fingers down.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stance {
    yaw_rad: f64,
    pitch_rad: f64,
    /// Left and right, in radians; `None` if the arm does not reach that.
    pub(crate) ready: [Option<[f64; ARM_JOINTS]>; 2],
}

impl Model {
    pub(crate) fn new(body: &Body, rest_rad: &[f64]) -> Result<Self, MissingJointError> {
        let parts = Parts::new(body)?;
        let rest = |joint: usize| rest_rad.get(joint).copied().unwrap_or(0.0);
        let limited = body.joints().iter().enumerate().map(|(index, joint)| joint.limited(rest(index)));
        let mut model = Self { body: body.clone(), parts, rest_rad: limited.collect(), stances: Vec::new() };
        model.stances = STANCES.iter().map(|(yaw, pitch)| model.stance(*yaw, *pitch)).collect();
        Ok(model)
    }

    fn stance(&self, yaw_rad: f64, pitch_rad: f64) -> Stance {
        let mut stance = Stance { yaw_rad, pitch_rad, ready: [None; 2] };
        let mut at = self.rest_rad.clone();
        stance.stand(&self.parts, &mut at);
        stance.ready = Side::BOTH.map(|side| {
            let sign = if side == Side::Left { 1.0 } else { -1.0 };
            let [pitch, roll, yaw, elbow, wrist_yaw, wrist_pitch, wrist_roll] = ELBOW_OUT;
            let arm = [pitch, roll * sign, yaw, elbow, wrist_yaw, wrist_pitch, wrist_roll];
            for (joint, position) in self.body.arm_joints(side).into_iter().zip(arm) {
                set(&mut at, joint, position);
            }
            let [x, y, z] = READY_M;
            // Leaning forward moves the shoulders, which are 0.4 m above the waist.
            let x = x + SHOULDER_M * pitch_rad.sin();
            let (sine, cosine) = yaw_rad.sin_cos();
            let y = y * sign;
            let ready = Position::new(x * cosine - y * sine, x * sine + y * cosine, z);
            self.body.inverse_kinematics(side, &HandGoal::Down(ready), &at).ok()
        });
        stance
    }

    /// Position of a joint clamped to its limits.
    pub(crate) fn limited(&self, joint: usize, position_rad: f64) -> f64 {
        let known = require!(self.body.joints().get(joint), "joint {joint} exists");
        known.map_or(0.0, |joint| joint.limited(position_rad))
    }
}

impl Stance {
    /// Sets the torso in a configuration.
    pub(crate) fn stand(&self, parts: &Parts, at: &mut [f64]) {
        for (joint, position_rad) in parts.torso.into_iter().zip([self.yaw_rad, self.pitch_rad, 0.0]) {
            set(at, joint, position_rad);
        }
    }
}
