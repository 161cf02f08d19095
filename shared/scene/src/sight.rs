use geometry::{Base, Eye, Pose, Position, Thing};
use quantity::number::{float, float_of_count};

use crate::bundle::RayBundle;
use crate::cone::BallInCone;
use crate::occluder_cones::OccluderCones;
use crate::occluders::norm;
use crate::{Cone, Occluders, Samples};

/// The view of an eye: its pose, its view cone, and the occluders.
///
/// Data that depends only on the eye and the occluders is precomputed by [`Self::update_view`]. Only `new` allocates,
/// as long as later sets of occluders have no larger capacity than the first one.
#[derive(Clone, Debug)]
pub struct Sight {
    eye: Position<Base>,
    x_eye_base: Pose<Eye, Base>,
    cone: Cone,
    occluder_cones: OccluderCones,
}

impl Sight {
    /// The view of an eye whose x axis is the line of sight.
    #[must_use]
    pub fn new(x_base_eye: Pose<Base, Eye>, cone: Cone, occluders: &Occluders) -> Self {
        let occluder_cones = OccluderCones::with_capacity_of(occluders);
        let mut sight =
            Self { eye: x_base_eye.origin(), x_eye_base: x_base_eye.inverse(), cone, occluder_cones };
        sight.update_view(&x_base_eye, occluders);
        sight
    }

    /// Updates the pose of the eye and the occluders. Boxes added to the set later are not considered.
    pub fn update_view(&mut self, x_base_eye: &Pose<Base, Eye>, occluders: &Occluders) {
        self.eye = x_base_eye.origin();
        self.x_eye_base = x_base_eye.inverse();
        self.occluder_cones.update(&self.eye, occluders);
    }

    /// The position of the eye.
    #[must_use]
    pub fn eye(&self) -> Position<Base> {
        self.eye
    }

    /// The angle between the line of sight and the direction of a point, in radians; zero at the eye.
    #[must_use]
    pub fn angle_rad(&self, point: &Position<Base>) -> f64 {
        let [forward, left, up] = (self.x_eye_base * *point).to_array();
        left.hypot(up).atan2(forward)
    }

    /// Whether a point is in the view cone and not occluded.
    #[must_use]
    pub fn sees(&self, point: &Position<Base>) -> bool {
        self.cone.contains(&(self.x_eye_base * *point))
            && !self
                .occluder_cones
                .all()
                .iter()
                .any(|occluder_view| occluder_view.hides(&(occluder_view.x_box_base() * *point)))
    }

    /// The share of a box's sample points that are visible, from 0 to 1.
    ///
    /// Most things lie wholly inside or outside the cone, and most occluders do not affect most things: the bounding
    /// sphere decides those cases. For the others, rays are tested four at a time in single precision with a margin,
    /// and rays within the margin one by one.
    #[must_use]
    #[inline(always)]
    pub fn visible_share(
        &self,
        x_base_thing: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
        samples: Samples,
    ) -> f64 {
        let points = samples.points();
        let mut seen = self.in_cone(x_base_thing, half_extents_m, points);
        if seen != 0 && !self.occluder_cones.all().is_empty() {
            seen = self.unoccluded(seen, x_base_thing, half_extents_m, samples);
        }
        float(u64::from(seen.count_ones())) / float_of_count(points.len())
    }

    /// One bit for each sample point that is in the cone.
    #[inline(always)]
    fn in_cone(
        &self,
        x_base_thing: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
        points: &[[f64; 3]],
    ) -> u32 {
        match self.cone.classify_ball(&(self.x_eye_base * x_base_thing.origin()), norm(half_extents_m)) {
            BallInCone::Inside => (1 << points.len()) - 1,
            BallInCone::Outside => 0,
            BallInCone::Undecided => {
                let x_eye_thing = self.x_eye_base * *x_base_thing;
                let contains = |p_thing| self.cone.contains(&(x_eye_thing * p_thing));
                filter(points, half_extents_m, u32::MAX, contains)
            }
        }
    }

    /// The subset of the points in `seen` that no occluder hides.
    #[inline(never)]
    fn unoccluded(
        &self,
        mut seen: u32,
        x_base_thing: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
        samples: Samples,
    ) -> u32 {
        let radius_m = norm(half_extents_m);
        let mut bundle = None;
        for occluder_view in self.occluder_cones.candidates(&self.eye, &x_base_thing.origin(), radius_m) {
            let bundle = bundle.get_or_insert_with(|| {
                RayBundle::new(&self.eye, x_base_thing, half_extents_m, radius_m, samples)
            });
            let stopped = occluder_view.stopped_rays(bundle);
            let undecided = seen & stopped.possible & !stopped.certain;
            seen &= !(stopped.certain | stopped.possible);
            if undecided != 0 {
                let x_box_thing = occluder_view.x_box_base() * *x_base_thing;
                let shows = |p_thing| !occluder_view.hides(&(x_box_thing * p_thing));
                seen |= filter(samples.points(), half_extents_m, undecided, shows);
            }
            if seen == 0 {
                break;
            }
        }
        seen
    }
}

/// The subset of the points in `among` for which `keep` holds.
#[inline(never)]
fn filter(
    points: &[[f64; 3]],
    half_extents_m: [f64; 3],
    among: u32,
    keep: impl Fn(Position<Thing>) -> bool,
) -> u32 {
    let [half_x, half_y, half_z] = half_extents_m;
    let mut kept = 0;
    let mut bit = 1;
    for [x, y, z] in points {
        if among & bit != 0 && keep(Position::new(x * half_x, y * half_y, z * half_z)) {
            kept |= bit;
        }
        bit <<= 1;
    }
    kept
}
