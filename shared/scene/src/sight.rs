use geometry::{Base, Eye, Pose, Position, Thing};
use quantity::number::float_of_count;

use crate::{Cone, Occluders, Samples};

/// An eye at its place, with the cone that it sees and the boxes that stand in its way.
#[derive(Clone, Copy, Debug)]
pub struct Sight<'a> {
    eye: Position<Base>,
    x_eye_base: Pose<Eye, Base>,
    cone: Cone,
    occluders: &'a Occluders,
}

impl<'a> Sight<'a> {
    /// The sight of an eye, x along its line of sight.
    #[must_use]
    pub fn new(x_base_eye: Pose<Base, Eye>, cone: Cone, occluders: &'a Occluders) -> Self {
        Self { eye: x_base_eye.origin(), x_eye_base: x_base_eye.inverse(), cone, occluders }
    }

    /// Where the eye is.
    #[must_use]
    pub fn eye(&self) -> Position<Base> {
        self.eye
    }

    /// Whether a point is in the cone and behind no occluder.
    #[must_use]
    pub fn sees(&self, point: &Position<Base>) -> bool {
        self.cone.contains(&(self.x_eye_base * *point)) && !self.occluders.occluded(&self.eye, point)
    }

    /// The share of a box's sample points that are seen, from 0 to 1.
    #[must_use]
    pub fn visible_share(
        &self,
        x_base_thing: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
        samples: Samples,
    ) -> f64 {
        let [half_x, half_y, half_z] = half_extents_m;
        let points = samples.points();
        let seen = points
            .iter()
            .map(|[x, y, z]| Position::<Thing>::new(x * half_x, y * half_y, z * half_z))
            .filter(|p_thing| self.sees(&(*x_base_thing * *p_thing)))
            .count();
        float_of_count(seen) / float_of_count(points.len())
    }
}
