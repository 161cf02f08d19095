use geometry::{Base, Pose, Position, Thing};
use glam::{BVec4A, Mat3, Vec3, Vec4};
use nalgebra::Vector3;
use quantity::number::single;

use crate::Samples;
use crate::occluders::{CONTACT_MARGIN_M, Occluder};
use crate::samples::Fours;

/// Margin for rounding, in metres and as a share of the distances. Rays that pass the sides of a box more closely are
/// tested in double precision. A rounding is at most 6e-8 of a number, and fewer than twenty of them lie between a pose
/// and the result. So outside the margin the result equals that in double precision.
const MARGIN_M: f32 = 1e-4;
const MARGIN: f32 = 4e-6;
/// Smallest extent of a ray along an axis, in metres, to avoid a division by zero.
const MIN_EXTENT_M: f32 = 1e-9;

/// The rays from an eye to the sample points of a thing, in single precision.
pub(crate) struct RayBundle {
    /// From the eye to the centre, along the axes of the base frame.
    centre: Vec3,
    /// From the centre to the middles of three faces.
    axes: [Vec3; 3],
    radius_m: f32,
    fours: &'static Fours,
}

/// A box, prepared for the test against a bundle of rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxTarget {
    /// The axes of the base frame in the frame of the box.
    turn: Mat3,
    /// The eye in the frame of the box.
    eye: Vec3,
    half: Vec3,
}

/// The rays of a bundle that a box stops, one bit each.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StoppedRays {
    pub(crate) certain: u32,
    /// A superset of `certain`. The others pass a side too closely for single precision to decide.
    pub(crate) possible: u32,
}

impl RayBundle {
    pub(crate) fn new(
        eye: &Position<Base>,
        x_base_thing: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
        radius_m: f64,
        samples: Samples,
    ) -> Self {
        let turn = x_base_thing.isometry().rotation.to_rotation_matrix();
        let [x, y, z] = half_extents_m;
        let axes = [Vector3::new(x, 0.0, 0.0), Vector3::new(0.0, y, 0.0), Vector3::new(0.0, 0.0, z)];
        Self {
            centre: vec3((x_base_thing.origin().point() - eye.point()).into()),
            axes: axes.map(|axis| vec3((turn * axis).into())),
            radius_m: single(radius_m),
            fours: samples.fours(),
        }
    }
}

impl BoxTarget {
    pub(crate) fn new(occluder: &Occluder, eye: &Position<Thing>) -> Self {
        let turn = occluder.x_box_base().isometry().rotation.to_rotation_matrix();
        let axis = |axis: Vector3<f64>| vec3((turn * axis).into());
        Self {
            turn: Mat3::from_cols(axis(Vector3::x()), axis(Vector3::y()), axis(Vector3::z())),
            eye: vec3(eye.to_array()),
            half: vec3(occluder.half_extents_m()),
        }
    }

    /// The slab test of all rays against the box grown and shrunk by a margin. A ray that misses the grown box misses
    /// the box; a ray that hits the shrunk box hits the box.
    pub(crate) fn stopped_rays(&self, bundle: &RayBundle) -> StoppedRays {
        let centre = self.turn * bundle.centre;
        let axes = bundle.axes.map(|axis| self.turn * axis);
        let distance_m = centre.length();
        let margin = MARGIN_M + MARGIN * (distance_m + bundle.radius_m + self.eye.length());
        let (grown, shrunk) = (self.half + margin, self.half - margin);
        // Near the thing's surface the exact test decides whether the box is in front.
        let nearest_m = distance_m - bundle.radius_m;
        let reach = 1.0 - (4.0 * single(CONTACT_MARGIN_M) + margin) / nearest_m;
        let may_stop_surely = nearest_m > 0.0 && shrunk.min_element() >= 0.0;
        let mut stopped = StoppedRays::default();
        for (signs, shift) in bundle.fours.iter().zip((0..).step_by(4)) {
            let mut outer = Slabs { enter: Vec4::ZERO, leave: Vec4::ONE };
            let mut inner = Slabs { enter: Vec4::ZERO, leave: Vec4::splat(reach) };
            for axis in 0..3 {
                let [x, y, z] = signs;
                let [a, b, c] = axes.map(|ax| ax[axis]);
                let along = *x * a + *y * b + *z * c + centre[axis];
                let per_along = away_from_zero(along).recip();
                outer.cut(self.eye[axis], grown[axis], per_along);
                inner.cut(self.eye[axis], shrunk[axis], per_along);
            }
            stopped.possible |= outer.are_crossed().bitmask() << shift;
            if may_stop_surely {
                stopped.certain |= inner.are_crossed().bitmask() << shift;
            }
        }
        stopped
    }
}

/// The interval of four rays inside all slabs tested so far, as a share of their lengths.
struct Slabs {
    enter: Vec4,
    leave: Vec4,
}

impl Slabs {
    fn cut(&mut self, eye: f32, half: f32, per_along: Vec4) {
        let (one, other) = (per_along * (-half - eye), per_along * (half - eye));
        self.enter = self.enter.max(one.min(other));
        self.leave = self.leave.min(one.max(other));
    }

    fn are_crossed(&self) -> BVec4A {
        self.enter.cmple(self.leave)
    }
}

fn away_from_zero(along: Vec4) -> Vec4 {
    Vec4::select(along.abs().cmplt(Vec4::splat(MIN_EXTENT_M)), Vec4::splat(MIN_EXTENT_M), along)
}

fn vec3(numbers: [f64; 3]) -> Vec3 {
    Vec3::from_array(numbers.map(single))
}
