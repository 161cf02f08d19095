use geometry::{Base, Pose, Position};
use invariant::require;
use kinematics::{ARM_JOINTS, HandGoal, Side, UnreachableError};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::gaze::look;
use crate::model::Model;
use crate::parts::set;
use crate::plan::{Plan, WaitFor};
use crate::{Phase, SkillError};

/// Maximum distance of a hand between two waypoints, in metres.
const STEP_M: f64 = 0.025;
/// Maximum rotation of a hand between two waypoints, in radians.
const TURN_RAD: f64 = 0.15;
/// Maximum motion of an arm joint between two waypoints, in radians. A larger one is a jump to another solution of
/// the inverse kinematics, in which the hand would leave the line.
const MAX_JUMP_RAD: f64 = 0.5;
/// Joint positions of closed fingers, in radians. A hand counts as closed from 0.7 rad and as open below 0.5 rad.
const CLOSED_RAD: f64 = 1.05;
const THUMB_CLOSED_RAD: f64 = 0.6;

/// A plan under construction.
pub(crate) struct PlanBuilder<'a> {
    pub(crate) model: &'a Model,
    pub(crate) plan: &'a mut Plan,
    /// Present joint positions, in radians.
    pub(crate) start: &'a [f64],
    /// Joint positions of the next waypoint, in radians.
    pub(crate) at: &'a mut [f64],
}

impl PlanBuilder<'_> {
    /// Empties the plan, and resets the draft to the present joint positions.
    pub(crate) fn restart(&mut self) {
        self.at.copy_from_slice(self.start);
        self.plan.restart(self.start);
    }

    /// Adds the present configuration of the draft as a waypoint.
    pub(crate) fn push(&mut self, phase: Phase, awaits: WaitFor) -> Result<(), SkillError> {
        self.plan.push(&self.model.body, phase, awaits, self.at)
    }

    pub(crate) fn look(&mut self, target: &Position<Base>) {
        look(self.model, self.at, target);
    }

    pub(crate) fn set_arm(&mut self, side: Side, arm_rad: [f64; ARM_JOINTS]) {
        for (joint, position_rad) in self.model.body.arm_joints(side).into_iter().zip(arm_rad) {
            set(self.at, joint, position_rad);
        }
    }

    pub(crate) fn open(&mut self, side: Side) {
        self.bend(side, 0.0, 0.0);
    }

    pub(crate) fn close(&mut self, side: Side) {
        self.bend(side, CLOSED_RAD, THUMB_CLOSED_RAD);
    }

    fn bend(&mut self, side: Side, fingers_rad: f64, thumb_rad: f64) {
        let fingers = side.of(self.model.parts.fingers);
        for joint in fingers.pitch {
            set(self.at, joint, fingers_rad);
        }
        set(self.at, fingers.thumb_pitch, thumb_rad);
    }

    /// Moves a hand along a straight line. Either the fingers stay down and the hand turns freely, or it rotates about
    /// the vertical by an angle in radians and in no other way.
    pub(crate) fn line(
        &mut self,
        side: Side,
        phase: Phase,
        to: &Position<Base>,
        by_rad: Option<f64>,
    ) -> Result<(), SkillError> {
        let x_base_hand = self.model.body.hand(side, self.at);
        let from = x_base_hand.origin();
        let turns = by_rad.map_or(1, |by_rad| steps_of(by_rad.abs(), TURN_RAD));
        self.points(side, phase, steps_of(from.distance(to), STEP_M).max(turns), |share| {
            let point = from.point() + (to.point() - from.point()) * share;
            let Some(by_rad) = by_rad else { return HandGoal::Down(Position::from_point(point)) };
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), by_rad * share);
            let rotation = turn * x_base_hand.isometry().rotation;
            HandGoal::Pose(Pose::from_isometry(Isometry3::from_parts(point.into(), rotation)))
        })
    }

    /// Lifts a hand straight up to a height without rotating it, as far as the arm reaches.
    pub(crate) fn raise(&mut self, side: Side, height_m: f64) -> Result<(), SkillError> {
        let x_base_hand = self.model.body.hand(side, self.at);
        let distance_m = height_m - x_base_hand.origin().point().z;
        let raised = self.points(side, Phase::Raise, steps_of(distance_m, STEP_M), |share| {
            let mut isometry = *x_base_hand.isometry();
            isometry.translation.z += distance_m * share;
            HandGoal::Pose(Pose::from_isometry(isometry))
        });
        match raised {
            // Higher is better, but no height is required: the next motion starts where this one ends.
            Err(SkillError::Unreachable { .. }) => Ok(()),
            other => other,
        }
    }

    /// Adds waypoints along a path, dense enough that the hand stays on it.
    fn points(
        &mut self,
        side: Side,
        phase: Phase,
        steps: u32,
        aim: impl Fn(f64) -> HandGoal,
    ) -> Result<(), SkillError> {
        for step in 1..=steps {
            let arm_rad = self
                .model
                .body
                .inverse_kinematics_from_seed(side, &aim(f64::from(step) / f64::from(steps)), self.at)
                .and_then(|arm_rad| self.near(side, arm_rad))
                .map_err(|why| SkillError::Unreachable { phase, why })?;
            self.set_arm(side, arm_rad);
            self.push(phase, WaitFor::MovedButGaze)?;
        }
        Ok(())
    }

    fn near(&self, side: Side, arm_rad: [f64; ARM_JOINTS]) -> Result<[f64; ARM_JOINTS], UnreachableError> {
        let leap =
            self.model.body.arm_joints(side).into_iter().zip(arm_rad).fold(0.0_f64, |leap, (joint, to)| {
                let from = require!(self.at.get(joint), "joint {joint} exists").copied().unwrap_or(0.0);
                leap.max((to - from).abs())
            });
        if leap <= MAX_JUMP_RAD {
            Ok(arm_rad)
        } else {
            Err(UnreachableError { side, distance_m: 0.0, angle_rad: leap })
        }
    }
}

/// Number of steps of at most `longest` along a path; at least one.
fn steps_of(distance_m: f64, longest: f64) -> u32 {
    u32::try_from(quantity::number::round_i32((distance_m / longest).ceil())).unwrap_or(0).max(1)
}
