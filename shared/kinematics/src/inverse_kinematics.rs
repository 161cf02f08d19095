use geometry::{Base, Hand, Pose, Position};
use nalgebra::{Isometry3, Point3, SMatrix, SVector, UnitQuaternion, Vector3, Vector6};

use crate::body::Arm;
use crate::{ARM_JOINTS, Body, Side};

/// Tolerances of a solution.
const CLOSE_M: f64 = 1e-5;
const CLOSE_RAD: f64 = 1e-4;
/// Iterations of one attempt, and restarts after a failed attempt from the seed.
const ITERATIONS: usize = 80;
const RESTARTS: usize = 64;
/// Number of solutions found by restarts, of which the nearest to the seed is used.
const CHOICES: usize = 3;
/// Maximum joint step of one iteration, in radians, within which the linearisation holds.
const STEP_RAD: f64 = 0.4;
/// Minimum damping, for a vanishing error.
const DAMPING: f64 = 1e-7;
/// An attempt has converged if no joint moves more than this in an iteration.
const STILL_RAD: f64 = 1e-9;

type ArmVector = SVector<f64, ARM_JOINTS>;

/// Jacobian of a hand with respect to the joints of its arm, one column each. Rows 0 to 2 are m/s per rad/s,
/// rows 3 to 5 rad/s per rad/s.
pub type Jacobian = SMatrix<f64, 6, ARM_JOINTS>;

/// The goal of a hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HandGoal {
    /// A pose.
    Pose(Pose<Base, Hand>),
    /// A position with the fingers straight down; the rotation about the vertical is free.
    Down(Position<Base>),
}

/// No solution within the joint limits was found.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the {} hand cannot get there: it stays {distance_m:.3} m and {angle_rad:.2} rad away", side.name())]
pub struct UnreachableError {
    /// The side of the hand.
    pub side: Side,
    /// Remaining distance of the best attempt, in metres.
    pub distance_m: f64,
    /// Remaining angle of the best attempt, in radians.
    pub angle_rad: f64,
}

/// The result of an attempt.
struct Found {
    positions_rad: ArmVector,
    distance_m: f64,
    angle_rad: f64,
}

impl Found {
    fn is_close(&self) -> bool {
        self.distance_m < CLOSE_M && self.angle_rad < CLOSE_RAD
    }
}

impl Body {
    /// Inverse kinematics: joint positions of an arm in radians, within the limits, that reach the aim to
    /// within 10 µm and 0.1 mrad.
    ///
    /// `seed_rad` is a configuration of the whole body. Its other joints stay fixed, and the search starts
    /// from the arm's positions in it. If that fails, the search restarts from a fixed sequence of
    /// configurations. Of the first few solutions, the nearest to the seed is returned.
    ///
    /// # Errors
    ///
    /// [`UnreachableError`] if no attempt converged to the aim.
    pub fn inverse_kinematics(
        &self,
        side: Side,
        aim: &HandGoal,
        seed_rad: &[f64],
    ) -> Result<[f64; ARM_JOINTS], UnreachableError> {
        let problem = Problem::new(self, side, aim, seed_rad);
        let mut best = problem.attempt(problem.seed);
        if best.is_close() {
            return Ok(best.positions_rad.into());
        }
        let mut solutions = 0;
        for restart in 1..=RESTARTS {
            let found = problem.attempt(problem.elsewhere(restart));
            solutions += usize::from(found.is_close());
            if problem.is_better(&found, &best) {
                best = found;
            }
            if solutions == CHOICES {
                break;
            }
        }
        problem.judge(side, &best)
    }

    /// As [`inverse_kinematics`](Self::inverse_kinematics), but only from the seed: for successive points of a path,
    /// where another solution would be a jump.
    ///
    /// # Errors
    ///
    /// [`UnreachableError`] if the attempt from the seed did not reach the aim.
    pub fn inverse_kinematics_from_seed(
        &self,
        side: Side,
        aim: &HandGoal,
        seed_rad: &[f64],
    ) -> Result<[f64; ARM_JOINTS], UnreachableError> {
        let problem = Problem::new(self, side, aim, seed_rad);
        problem.judge(side, &problem.attempt(problem.seed))
    }

    /// The hand's Jacobian in the base frame.
    #[must_use]
    pub fn jacobian(&self, side: Side, positions_rad: &[f64]) -> Jacobian {
        let arm = self.arm(side);
        let positions = of_arm(arm, positions_rad);
        arm.hand_and_jacobian(&arm.mount(positions_rad), &positions).1
    }
}

/// The constant part of one search.
struct Problem<'a> {
    arm: &'a Arm,
    aim: &'a HandGoal,
    mount: Isometry3<f64>,
    lower_rad: ArmVector,
    upper_rad: ArmVector,
    seed: ArmVector,
}

impl<'a> Problem<'a> {
    fn new(body: &'a Body, side: Side, aim: &'a HandGoal, seed_rad: &[f64]) -> Self {
        let arm = body.arm(side);
        let limit = |of: fn(&crate::Joint) -> f64| {
            ArmVector::from(arm.joints.map(|joint| body.joints().get(joint).map_or(0.0, of)))
        };
        let (lower_rad, upper_rad) = (limit(|joint| joint.lower_rad), limit(|joint| joint.upper_rad));
        let seed = within(&of_arm(arm, seed_rad), &lower_rad, &upper_rad);
        Self { arm, aim, mount: arm.mount(seed_rad), lower_rad, upper_rad, seed }
    }

    /// Levenberg-Marquardt with damping by the remaining error (Sugihara, "Solvability-Unconcerned Inverse
    /// Kinematics by the Levenberg-Marquardt Method", IEEE T-RO 27(5), 2011). A joint at its limit is held
    /// there while the others continue.
    fn attempt(&self, start: ArmVector) -> Found {
        let mut at = start;
        let mut found = Found { positions_rad: at, distance_m: f64::INFINITY, angle_rad: f64::INFINITY };
        for _iteration in 0..ITERATIONS {
            let (hand, mut jacobian) = self.arm.hand_and_jacobian(&self.mount, &at);
            let error = self.error(&hand, &mut jacobian);
            found = Found {
                positions_rad: at,
                distance_m: error.fixed_rows::<3>(0).norm(),
                angle_rad: error.fixed_rows::<3>(3).norm(),
            };
            if found.is_close() {
                break;
            }
            let Some(step) = self.step(&at, &jacobian, &error) else { break };
            let next = within(&(at + step), &self.lower_rad, &self.upper_rad);
            if (next - at).amax() < STILL_RAD {
                break;
            }
            at = next;
        }
        found
    }

    /// The pose error in the base frame; clears the Jacobian's rows that the aim does not constrain.
    fn error(&self, hand: &Isometry3<f64>, jacobian: &mut Jacobian) -> Vector6<f64> {
        let (goal, turn): (Vector3<f64>, Vector3<f64>) = match self.aim {
            HandGoal::Pose(x_base_goal) => {
                let goal = x_base_goal.isometry();
                (goal.translation.vector, (goal.rotation * hand.rotation.inverse()).scaled_axis())
            }
            HandGoal::Down(goal) => {
                // The rotation about the vertical is unconstrained.
                jacobian.row_mut(5).fill(0.0);
                (goal.point().coords, turn_down(&hand.rotation))
            }
        };
        let offset = goal - hand.translation.vector;
        Vector6::new(offset.x, offset.y, offset.z, turn.x, turn.y, turn.z)
    }

    fn step(&self, at: &ArmVector, jacobian: &Jacobian, error: &Vector6<f64>) -> Option<ArmVector> {
        let damping = 0.5 * error.norm_squared() * 0.1 + DAMPING;
        let mut jacobian = *jacobian;
        loop {
            let curvature = jacobian.transpose() * jacobian
                + SMatrix::<f64, ARM_JOINTS, ARM_JOINTS>::identity() * damping;
            let mut step = curvature.cholesky()?.solve(&(jacobian.transpose() * error));
            let longest = step.amax();
            if longest > STEP_RAD {
                step *= STEP_RAD / longest;
            }
            // Removes the column of a joint that would exceed its limit.
            let mut stopped = false;
            for (joint, mut column) in jacobian.column_iter_mut().enumerate() {
                let (Some(at), Some(step)) = (at.get(joint), step.get(joint)) else { continue };
                let (Some(lower), Some(upper)) = (self.lower_rad.get(joint), self.upper_rad.get(joint))
                else {
                    continue;
                };
                let beyond = (at <= lower && *step < 0.0) || (at >= upper && *step > 0.0);
                if beyond && column.amax() > 0.0 {
                    column.fill(0.0);
                    stopped = true;
                }
            }
            if !stopped {
                return Some(step);
            }
        }
    }

    /// Start of a restart: a point of the Halton sequence within the limits, which covers them evenly and is
    /// deterministic.
    fn elsewhere(&self, restart: usize) -> ArmVector {
        let share = ArmVector::from([2, 3, 5, 7, 11, 13, 17].map(|base| radical_inverse(restart, base)));
        self.lower_rad + (self.upper_rad - self.lower_rad).component_mul(&share)
    }

    fn is_better(&self, found: &Found, than: &Found) -> bool {
        match (found.is_close(), than.is_close()) {
            (true, true) => {
                (found.positions_rad - self.seed).norm() < (than.positions_rad - self.seed).norm()
            }
            (true, false) => true,
            (false, true) => false,
            (false, false) => found.distance_m + found.angle_rad < than.distance_m + than.angle_rad,
        }
    }

    fn judge(&self, side: Side, found: &Found) -> Result<[f64; ARM_JOINTS], UnreachableError> {
        if found.is_close() {
            Ok(found.positions_rad.into())
        } else {
            Err(UnreachableError { side, distance_m: found.distance_m, angle_rad: found.angle_rad })
        }
    }
}

impl Arm {
    fn hand_and_jacobian(
        &self,
        mount: &Isometry3<f64>,
        positions_rad: &ArmVector,
    ) -> (Isometry3<f64>, Jacobian) {
        let mut axes = [(Point3::origin(), Vector3::zeros()); ARM_JOINTS];
        let mut place = *mount;
        let mut turns = axes.iter_mut().zip(positions_rad);
        for step in &self.chain {
            place *= step.origin;
            if let Some(turn) = step.turn
                && let Some((axis, position_rad)) = turns.next()
            {
                *axis = (Point3::from(place.translation.vector), place.rotation * turn.axis.into_inner());
                place *= UnitQuaternion::from_axis_angle(&turn.axis, *position_rad);
            }
        }
        let hand = Point3::from(place.translation.vector);
        let mut jacobian = Jacobian::zeros();
        for ((origin, axis), mut column) in axes.iter().zip(jacobian.column_iter_mut()) {
            column.fixed_rows_mut::<3>(0).copy_from(&axis.cross(&(hand - origin)));
            column.fixed_rows_mut::<3>(3).copy_from(axis);
        }
        (place, jacobian)
    }
}

/// The smallest rotation that points the fingers straight down, as axis times angle. The axis is horizontal.
fn turn_down(hand: &UnitQuaternion<f64>) -> Vector3<f64> {
    let fingers = hand * Vector3::x();
    let level = Vector3::new(-fingers.y, fingers.x, 0.0);
    let sine = level.norm();
    let angle = sine.atan2(-fingers.z);
    if sine > 1e-12 {
        level * (angle / sine)
    } else if fingers.z < 0.0 {
        Vector3::zeros()
    } else {
        // Fingers straight up: any horizontal axis is equally good.
        hand * Vector3::y() * angle
    }
}

fn of_arm(arm: &Arm, positions_rad: &[f64]) -> ArmVector {
    ArmVector::from(arm.joints.map(|joint| positions_rad.get(joint).copied().unwrap_or(0.0)))
}

fn within(positions: &ArmVector, lower: &ArmVector, upper: &ArmVector) -> ArmVector {
    positions.zip_zip_map(lower, upper, |position, lower, upper| position.max(lower).min(upper))
}

/// Radical inverse of `number` in base `base` (van der Corput), in [0, 1).
fn radical_inverse(mut number: usize, base: usize) -> f64 {
    let (mut inverse, mut digit_weight) = (0.0, 1.0);
    let step = 1.0 / f64::from(u32::try_from(base).unwrap_or(1));
    while number > 0 {
        digit_weight *= step;
        inverse += digit_weight * f64::from(u32::try_from(number % base).unwrap_or(0));
        number /= base;
    }
    inverse
}
