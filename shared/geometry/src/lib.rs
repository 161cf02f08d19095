//! Poses and positions with their coordinate frames in the type.
//!
//! `Pose<A, B>` is the pose *of B in A*: `Pose<A, B> * Pose<B, C>` compiles, and `Pose<A, B> * Pose<C, B>` does not.
//! Variables follow monogram notation in snake case, as in `x_world_base * p_base_cup`; adjacent frame names must
//! match.
//!
//! ```compile_fail
//! use geometry::{Base, Pose, World};
//! let x_world_base = Pose::<World, Base>::identity();
//! let wrong = x_world_base * x_world_base;
//! ```
//!
//! A frame is a type that derives `Clone`, `Copy` and `PartialEq`.
//!
//! Lengths are in metres, angles in radians, quaternions `[x, y, z, w]`. Frames are right-handed with z up; for a
//! body, x is forward and y left (REP 103).

use std::fmt;
use std::marker::PhantomData;
use std::ops::Mul;

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// The room: fixed, z up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum World {}
/// The robot's base: x forward, y left, z up. Observations are in this frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {}
/// A partner's body frame, levelled: x forward, y left, z up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Person {}
/// An eye or camera: x along the line of sight, z up in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Eye {}
/// A hand: origin between the fingertips, x along the fingers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hand {}
/// A sensory source: the frame of its raw reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {}
/// An object of the scene: origin at its centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Thing {}

/// A point in frame `A`, in metres.
#[derive(Clone, Copy, PartialEq)]
pub struct Position<A> {
    point: Point3<f64>,
    frame: PhantomData<fn() -> A>,
}

/// The pose of frame `B` in frame `A`.
#[derive(Clone, Copy, PartialEq)]
pub struct Pose<A, B> {
    isometry: Isometry3<f64>,
    frames: PhantomData<fn() -> (A, B)>,
}

impl<A> Position<A> {
    /// The point at `(x, y, z)` metres.
    #[must_use]
    pub fn new(x: f64, y: f64, z: f64) -> Self {
        Self::from_point(Point3::new(x, y, z))
    }

    /// A point from bare coordinates; the caller guarantees the frame.
    #[must_use]
    pub fn from_point(point: Point3<f64>) -> Self {
        Self { point, frame: PhantomData }
    }

    /// The bare coordinates.
    #[must_use]
    pub fn point(&self) -> Point3<f64> {
        self.point
    }

    /// Coordinates in metres.
    #[must_use]
    pub fn to_array(&self) -> [f64; 3] {
        [self.point.x, self.point.y, self.point.z]
    }

    /// Distance to another point of the same frame, in metres.
    #[must_use]
    pub fn distance(&self, other: &Self) -> f64 {
        nalgebra::distance(&self.point, &other.point)
    }
}

impl<A, B> Pose<A, B> {
    /// The identity pose: both frames coincide.
    #[must_use]
    pub fn identity() -> Self {
        Self::from_isometry(Isometry3::identity())
    }

    /// A pose from a bare transform; the caller guarantees the frames.
    #[must_use]
    pub fn from_isometry(isometry: Isometry3<f64>) -> Self {
        Self { isometry, frames: PhantomData }
    }

    /// The pose with B's origin at `position_m` in A, and B's orientation as the quaternion `[x, y, z, w]`.
    ///
    /// `None` if a number is not finite, or if the quaternion's norm differs from one by 1 % or more. Such input is
    /// invalid, and normalising it would hide the error.
    #[must_use]
    pub fn from_parts(position_m: [f64; 3], orientation_xyzw: [f64; 4]) -> Option<Self> {
        let [x, y, z, w] = orientation_xyzw;
        let quaternion = Quaternion::new(w, x, y, z);
        let finite = position_m.iter().chain(&orientation_xyzw).all(|number| number.is_finite());
        if finite && (quaternion.norm() - 1.0).abs() < 0.01 {
            let rotation = UnitQuaternion::from_quaternion(quaternion);
            let translation = Translation3::from(Vector3::from(position_m));
            Some(Self::from_isometry(Isometry3::from_parts(translation, rotation)))
        } else {
            None
        }
    }

    /// The pose with B's origin at `(x, y, z)` metres in A, rotated by `heading_rad` about the vertical.
    #[must_use]
    pub fn upright(x: f64, y: f64, z: f64, heading_rad: f64) -> Self {
        let rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, heading_rad);
        Self::from_isometry(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
    }

    /// The pose of B at `from` in A, with its x axis towards `towards` and its y axis level. If the points coincide
    /// or lie on one vertical, the heading is A's.
    #[must_use]
    pub fn looking(from: &Position<A>, towards: &Position<A>) -> Self {
        let [dx, dy, dz]: [f64; 3] = (towards.point - from.point).into();
        let level = dx.hypot(dy);
        let heading = if level > 1e-9 { dy.atan2(dx) } else { 0.0 };
        let pitch = if level > 1e-9 || dz.abs() > 1e-9 { -dz.atan2(level) } else { 0.0 };
        let rotation = UnitQuaternion::from_euler_angles(0.0, pitch, heading);
        Self::from_isometry(Isometry3::from_parts(Translation3::from(from.point), rotation))
    }

    /// The bare transform.
    #[must_use]
    pub fn isometry(&self) -> &Isometry3<f64> {
        &self.isometry
    }

    /// The pose of A in B.
    #[must_use]
    pub fn inverse(&self) -> Pose<B, A> {
        Pose::from_isometry(self.isometry.inverse())
    }

    /// B's origin in A.
    #[must_use]
    pub fn origin(&self) -> Position<A> {
        Position::from_point(Point3::from(self.isometry.translation.vector))
    }

    /// B's origin in A, in metres.
    #[must_use]
    pub fn position_m(&self) -> [f64; 3] {
        self.isometry.translation.vector.into()
    }

    /// B's orientation in A as a unit quaternion `[x, y, z, w]`.
    #[must_use]
    pub fn orientation_xyzw(&self) -> [f64; 4] {
        self.isometry.rotation.coords.into()
    }

    /// B's orientation in A as a rotation matrix, by rows.
    #[must_use]
    pub fn rotation(&self) -> [[f64; 3]; 3] {
        // The arrays of a matrix are its columns.
        self.isometry.rotation.to_rotation_matrix().matrix().transpose().into()
    }

    /// The standard deviations of a position along the axes of A, in metres, of those along the axes of B. Covariances
    /// between axes are neglected.
    ///
    /// ```
    /// # use geometry::{Base, Person, Pose};
    /// // The x axis of the one frame is the y axis of the other.
    /// let x = Pose::<Base, Person>::upright(1.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2);
    /// let [along_x, along_y, along_z] = x.position_sd_m([0.03, 0.01, 0.02]);
    /// assert!((along_x - 0.01).abs() < 1e-9 && (along_y - 0.03).abs() < 1e-9 && (along_z - 0.02).abs() < 1e-9);
    /// ```
    #[must_use]
    pub fn position_sd_m(&self, sd_m: [f64; 3]) -> [f64; 3] {
        if let [x, y, z] = sd_m
            && x.to_bits() == y.to_bits()
            && y.to_bits() == z.to_bits()
        {
            return sd_m;
        }
        let variance =
            |row: [f64; 3]| row.iter().zip(sd_m).map(|(part, sd_m)| (part * sd_m).powi(2)).sum::<f64>();
        self.rotation().map(|row| variance(row).sqrt())
    }

    /// Heading of B's x axis, as an angle about A's vertical, in radians.
    #[must_use]
    pub fn heading_rad(&self) -> f64 {
        let forward = self.isometry.rotation * Vector3::x();
        forward.y.atan2(forward.x)
    }

    /// The same position and heading, with roll and pitch set to zero.
    #[must_use]
    pub fn levelled(&self) -> Self {
        let [x, y, z] = self.position_m();
        Self::upright(x, y, z, self.heading_rad())
    }

    /// Distance in metres and angle in radians between two poses of the same frames.
    #[must_use]
    pub fn difference(&self, other: &Self) -> (f64, f64) {
        let metres = (self.isometry.translation.vector - other.isometry.translation.vector).norm();
        (metres, self.isometry.rotation.angle_to(&other.isometry.rotation))
    }
}

impl<A, B, C> Mul<Pose<B, C>> for Pose<A, B> {
    type Output = Pose<A, C>;

    fn mul(self, rhs: Pose<B, C>) -> Pose<A, C> {
        Pose::from_isometry(self.isometry * rhs.isometry)
    }
}

impl<A, B> Mul<Position<B>> for Pose<A, B> {
    type Output = Position<A>;

    fn mul(self, rhs: Position<B>) -> Position<A> {
        Position::from_point(self.isometry * rhs.point)
    }
}

impl<A> fmt::Debug for Position<A> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "Position{:?}", self.to_array())
    }
}
impl<A, B> fmt::Debug for Pose<A, B> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "Pose{:?}{:?}", self.position_m(), self.orientation_xyzw())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_pose_and_its_inverse_restore_a_point(
            x in -5.0..5.0, y in -5.0..5.0, z in -5.0..5.0, heading in -3.0..3.0,
            px in -5.0..5.0, py in -5.0..5.0, pz in -5.0..5.0,
        ) {
            let x_world_base = Pose::<World, Base>::upright(x, y, z, heading);
            let p_base = Position::new(px, py, pz);
            let back = x_world_base.inverse() * (x_world_base * p_base);
            prop_assert!(back.distance(&p_base) < 1e-9);
        }

        #[test]
        fn a_looking_pose_points_its_axis_at_the_target(
            fx in -5.0..5.0, fy in -5.0..5.0, fz in -5.0..5.0, tx in -5.0..5.0, ty in -5.0..5.0, tz in -5.0..5.0,
        ) {
            let (from, towards) = (Position::<World>::new(fx, fy, fz), Position::new(tx, ty, tz));
            let x_world_eye = Pose::<World, Eye>::looking(&from, &towards);
            let seen = (x_world_eye.inverse() * towards).to_array();
            prop_assert!(seen[0] >= 0.0 && seen[1].abs() < 1e-6 && seen[2].abs() < 1e-6, "{:?}", seen);
        }
    }

    #[test]
    fn an_invalid_pose_is_refused() {
        let upright = [0.0, 0.0, 0.0, 1.0];
        assert!(Pose::<World, Base>::from_parts([0.0; 3], upright).is_some());
        assert!(Pose::<World, Base>::from_parts([f64::NAN, 0.0, 0.0], upright).is_none());
        assert!(Pose::<World, Base>::from_parts([0.0; 3], [0.0; 4]).is_none());
    }
}
