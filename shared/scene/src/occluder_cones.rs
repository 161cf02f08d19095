use geometry::{Base, Pose, Position, Thing};
use glam::Vec4;
use quantity::number::single;

use crate::Occluders;
use crate::bundle::{BoxTarget, RayBundle, StoppedRays};
use crate::occluders::Occluder;

/// Margin for rounding in single precision, for cosines and as a share of a distance. Cases within the margin get the
/// exact test.
const SLACK: f32 = 4e-6;
/// Margin in metres by which the radius of a ball is enlarged.
const SLACK_M: f64 = 1e-3;

/// Bounding cones of a set of occluders, as seen from one eye.
///
/// Each box has a bounding sphere, which subtends a cone at the eye. A box can hide part of a thing only if its cone
/// touches the thing's cone and its sphere is not farther. A few multiplications for four boxes at once reject most
/// boxes.
#[derive(Clone, Debug)]
pub(crate) struct OccluderCones {
    fours: Vec<ConeBlock>,
    occluder_cones: Vec<OccluderView>,
}

/// A box, with the eye in its frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OccluderView {
    occluder: Occluder,
    eye: Position<Thing>,
    target: BoxTarget,
}

/// The bounding cones of four boxes, by coordinate. Unused entries hide nothing.
#[derive(Clone, Copy, Debug)]
struct ConeBlock {
    /// Direction to the sphere: a unit vector in the base frame.
    x: Vec4,
    y: Vec4,
    z: Vec4,
    /// Cosine and sine of the half angle of the cone.
    cos: Vec4,
    sin: Vec4,
    /// Smallest distance of the sphere, in metres.
    nearest_m: Vec4,
}

/// The bounding cone of one box.
#[derive(Clone, Copy)]
struct BoundingCone {
    direction: [f32; 3],
    cos: f32,
    sin: f32,
    nearest_m: f32,
}

impl BoundingCone {
    /// A cone that hides nothing: it is infinitely far.
    const NOTHING: Self = Self { direction: [0.0; 3], cos: 0.0, sin: 0.0, nearest_m: f32::INFINITY };
    /// A cone that may hide anything, or be hidden by anything, because the eye is inside the sphere. The cosine with
    /// any other cone is 0, and so is the threshold, so it always passes.
    const ANYTHING: Self = Self { direction: [0.0; 3], cos: 0.0, sin: 0.0, nearest_m: 0.0 };

    /// The bounding cone of a sphere whose centre is given relative to the eye, in metres.
    fn of([x, y, z]: [f64; 3], radius_m: f64) -> Self {
        let distance = (x * x + y * y + z * z).sqrt();
        let radius_m = radius_m + SLACK_M;
        let sin = radius_m / distance;
        if sin < 1.0 {
            Self {
                direction: [x, y, z].map(|part| single(part / distance)),
                cos: single((1.0 - sin * sin).sqrt()),
                sin: single(sin),
                nearest_m: single(distance - radius_m),
            }
        } else {
            Self::ANYTHING
        }
    }
}

impl ConeBlock {
    fn of(group: &[Occluder], eye: &Position<Base>) -> Self {
        let cones: [BoundingCone; 4] = std::array::from_fn(|lane| {
            group.get(lane).map_or(BoundingCone::NOTHING, |occluder| {
                BoundingCone::of(from(eye, &occluder.centre()), occluder.radius_m())
            })
        });
        let lanes = |part: fn(&BoundingCone) -> f32| Vec4::from_array(cones.map(|bound| part(&bound)));
        Self {
            x: lanes(|bound| bound.direction[0]),
            y: lanes(|bound| bound.direction[1]),
            z: lanes(|bound| bound.direction[2]),
            cos: lanes(|bound| bound.cos),
            sin: lanes(|bound| bound.sin),
            nearest_m: lanes(|bound| bound.nearest_m),
        }
    }

    /// One bit for each box that may hide part of a sphere. The angle between the directions must not exceed the sum of
    /// the half angles, with cos(a + b) = cos a cos b - sin a sin b. The box must not begin beyond the end of the
    /// sphere.
    fn may_hide(&self, ball: &BoundingCone, farthest_m: f32) -> u32 {
        let [x, y, z] = ball.direction;
        let cosine = self.x * x + self.y * y + self.z * z;
        let asked = self.cos * ball.cos - self.sin * ball.sin - SLACK;
        let near = self.nearest_m.cmple(Vec4::splat(farthest_m * (1.0 + SLACK)));
        (cosine.cmpge(asked) & near).bitmask()
    }
}

impl OccluderCones {
    /// Preallocates as many entries as the set has capacity.
    pub(crate) fn with_capacity_of(occluders: &Occluders) -> Self {
        let room = occluders.capacity();
        Self { fours: Vec::with_capacity(room.div_ceil(4)), occluder_cones: Vec::with_capacity(room) }
    }

    /// Recomputes all entries.
    pub(crate) fn update(&mut self, eye: &Position<Base>, occluders: &Occluders) {
        let boxes = occluders.boxes();
        self.fours.clear();
        self.fours.extend(boxes.chunks(4).map(|group| ConeBlock::of(group, eye)));
        self.occluder_cones.clear();
        self.occluder_cones.extend(boxes.iter().map(|occluder| {
            let eye = occluder.x_box_base() * *eye;
            OccluderView { occluder: *occluder, eye, target: BoxTarget::new(occluder, &eye) }
        }));
    }

    /// All entries.
    pub(crate) fn all(&self) -> &[OccluderView] {
        &self.occluder_cones
    }

    /// The boxes that may hide part of the sphere around a point.
    pub(crate) fn candidates(
        &self,
        eye: &Position<Base>,
        centre: &Position<Base>,
        radius_m: f64,
    ) -> impl Iterator<Item = &OccluderView> {
        let offset = from(eye, centre);
        let ball = BoundingCone::of(offset, radius_m);
        let [x, y, z] = offset;
        let farthest_m = single((x * x + y * y + z * z).sqrt() + radius_m);
        self.fours.iter().zip(self.occluder_cones.chunks(4)).flat_map(move |(four, group)| {
            let among = four.may_hide(&ball, farthest_m);
            group
                .iter()
                .enumerate()
                .filter(move |(lane, _)| among >> lane & 1 != 0)
                .map(|(_, occluder_view)| occluder_view)
        })
    }
}

impl OccluderView {
    /// The base frame in the frame of the box.
    pub(crate) fn x_box_base(&self) -> Pose<Thing, Base> {
        self.occluder.x_box_base()
    }

    /// Which rays of a bundle the box stops, in single precision with a margin.
    pub(crate) fn stopped_rays(&self, bundle: &RayBundle) -> StoppedRays {
        self.target.stopped_rays(bundle)
    }

    /// Whether the box lies between the eye and a point in its frame.
    pub(crate) fn hides(&self, point: &Position<Thing>) -> bool {
        self.occluder.hides(&self.eye, point)
    }
}

/// The vector from the eye to a point.
fn from(eye: &Position<Base>, point: &Position<Base>) -> [f64; 3] {
    (point.point() - eye.point()).into()
}
