use geometry::{Base, Pose, Position, Thing};
use glam::{BVec4A, Mat3, Vec3, Vec4};
use nalgebra::Vector3;
use quantity::number::single;

use crate::Samples;
use crate::occluders::{Occluder, TOUCHING_M};
use crate::samples::Fours;

/// Room for rounding, in metres and, of longer ways, in shares of them: the rays that pass the sides of
/// a box nearer than this are looked at closely.
const MARGIN_M: f32 = 1e-4;
const MARGIN: f32 = 4e-6;
/// A way along an axis is taken to be no shorter, in metres, so that one can divide by it.
const LEAST_M: f32 = 1e-9;

/// The rays from an eye to the sample points of a thing, in single precision.
pub(crate) struct Bundle {
    /// To the centre, along the axes of the base frame.
    centre: Vec3,
    /// From there to the middles of three faces.
    axes: [Vec3; 3],
    radius_m: f32,
    fours: &'static Fours,
}

/// A box as a bundle of rays meets it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    /// The axes of the base frame in the frame of the box.
    turn: Mat3,
    /// The eye in the frame of the box.
    eye: Vec3,
    half: Vec3,
}

/// Which rays of a bundle a box stops: one bit for each.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stopped {
    pub(crate) surely: u32,
    /// Those among them that pass a side so closely that single precision cannot tell are not sure.
    pub(crate) perhaps: u32,
}

impl Bundle {
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

impl Target {
    pub(crate) fn new(occluder: &Occluder, eye: &Position<Thing>) -> Self {
        let turn = occluder.x_box_base().isometry().rotation.to_rotation_matrix();
        let axis = |axis: Vector3<f64>| vec3((turn * axis).into());
        Self {
            turn: Mat3::from_cols(axis(Vector3::x()), axis(Vector3::y()), axis(Vector3::z())),
            eye: vec3(eye.to_array()),
            half: vec3(occluder.half_extents_m()),
        }
    }

    /// The slab test of all rays against the box grown and shrunk by a margin: what passes the first
    /// passes the box, and what the second stops, the box stops.
    pub(crate) fn stops(&self, bundle: &Bundle) -> Stopped {
        let centre = self.turn * bundle.centre;
        let axes = bundle.axes.map(|axis| self.turn * axis);
        let distance_m = centre.length();
        let margin = MARGIN_M + MARGIN * (distance_m + bundle.radius_m + self.eye.length());
        let (grown, shrunk) = (self.half + margin, self.half - margin);
        // Within so much of the thing itself, it is for the closer look to say what is behind it.
        let nearest_m = distance_m - bundle.radius_m;
        let reach = 1.0 - (4.0 * single(TOUCHING_M) + margin) / nearest_m;
        let may_stop_surely = nearest_m > 0.0 && shrunk.min_element() >= 0.0;
        let mut stopped = Stopped::default();
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
            stopped.perhaps |= outer.are_crossed().bitmask() << shift;
            if may_stop_surely {
                stopped.surely |= inner.are_crossed().bitmask() << shift;
            }
        }
        stopped
    }
}

/// Where four rays are between all pairs of sides looked at so far, in shares of their ways.
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
    Vec4::select(along.abs().cmplt(Vec4::splat(LEAST_M)), Vec4::splat(LEAST_M), along)
}

fn vec3(numbers: [f64; 3]) -> Vec3 {
    Vec3::from_array(numbers.map(single))
}
