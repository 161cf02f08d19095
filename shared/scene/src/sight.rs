use geometry::{Base, Eye, Pose, Position, Thing};
use quantity::number::{float, float_of_count};

use crate::bundle::Bundle;
use crate::cone::Within;
use crate::occluders::norm;
use crate::shades::Shades;
use crate::{Cone, Occluders, Samples};

/// An eye at its place, with the cone that it sees and the boxes that stand in its way.
///
/// What depends on the eye and the boxes alone is computed once, when it looks. Allocates in `new`
/// alone, as long as it looks at sets of boxes with no more room than the one it was made with.
#[derive(Clone, Debug)]
pub struct Sight {
    eye: Position<Base>,
    x_eye_base: Pose<Eye, Base>,
    cone: Cone,
    shades: Shades,
}

impl Sight {
    /// The sight of an eye, x along its line of sight.
    #[must_use]
    pub fn new(x_base_eye: Pose<Base, Eye>, cone: Cone, occluders: &Occluders) -> Self {
        let shades = Shades::with_room_for(occluders);
        let mut sight = Self { eye: x_base_eye.origin(), x_eye_base: x_base_eye.inverse(), cone, shades };
        sight.look(&x_base_eye, occluders);
        sight
    }

    /// Looks anew, from another place or past other boxes. Both are as they are now: boxes that are
    /// added later are not in the way.
    pub fn look(&mut self, x_base_eye: &Pose<Base, Eye>, occluders: &Occluders) {
        self.eye = x_base_eye.origin();
        self.x_eye_base = x_base_eye.inverse();
        self.shades.cast(&self.eye, occluders);
    }

    /// Where the eye is.
    #[must_use]
    pub fn eye(&self) -> Position<Base> {
        self.eye
    }

    /// Whether a point is in the cone and behind no occluder.
    #[must_use]
    pub fn sees(&self, point: &Position<Base>) -> bool {
        self.cone.contains(&(self.x_eye_base * *point))
            && !self.shades.all().iter().any(|shade| shade.hides(&(shade.x_box_base() * *point)))
    }

    /// The share of a box's sample points that are seen, from 0 to 1.
    ///
    /// Most things lie wholly in the cone or wholly outside, and most occluders hide nothing of
    /// most things: the ball round the box decides those cases. Of the others the rays decide, four
    /// at a time and with a margin, and each ray within the margin by itself.
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
        if seen != 0 && !self.shades.all().is_empty() {
            seen = self.past_boxes(seen, x_base_thing, half_extents_m, samples);
        }
        float(u64::from(seen.count_ones())) / float_of_count(points.len())
    }

    /// One bit for each of a box's points that is in the cone.
    #[inline(always)]
    fn in_cone(
        &self,
        x_base_thing: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
        points: &[[f64; 3]],
    ) -> u32 {
        match self.cone.holds(&(self.x_eye_base * x_base_thing.origin()), norm(half_extents_m)) {
            Within::Wholly => (1 << points.len()) - 1,
            Within::Not => 0,
            Within::Partly => {
                let x_eye_thing = self.x_eye_base * *x_base_thing;
                let contains = |p_thing| self.cone.contains(&(x_eye_thing * p_thing));
                filter(points, half_extents_m, u32::MAX, contains)
            }
        }
    }

    /// Of the points whose bits are set in `seen`, those that no occluder hides.
    #[inline(never)]
    fn past_boxes(
        &self,
        mut seen: u32,
        x_base_thing: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
        samples: Samples,
    ) -> u32 {
        let radius_m = norm(half_extents_m);
        let mut bundle = None;
        for shade in self.shades.upon(&self.eye, &x_base_thing.origin(), radius_m) {
            let bundle = bundle.get_or_insert_with(|| {
                Bundle::new(&self.eye, x_base_thing, half_extents_m, radius_m, samples)
            });
            let stopped = shade.stops(bundle);
            let doubtful = seen & stopped.perhaps & !stopped.surely;
            seen &= !(stopped.surely | stopped.perhaps);
            if doubtful != 0 {
                let x_box_thing = shade.x_box_base() * *x_base_thing;
                let shows = |p_thing| !shade.hides(&(x_box_thing * p_thing));
                seen |= filter(samples.points(), half_extents_m, doubtful, shows);
            }
            if seen == 0 {
                break;
            }
        }
        seen
    }
}

/// Of the points whose bits are set in `among`, those for which `keep` holds.
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
