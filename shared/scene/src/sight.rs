use geometry::{Base, Eye, Pose, Position, Thing};
use quantity::number::{float, float_of_count};

use crate::cone::Within;
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
    ///
    /// Most things lie wholly in the cone or wholly outside, and most occluders hide nothing of
    /// most things: the ball round the box decides those cases, and its points the others.
    #[must_use]
    pub fn visible_share(
        &self,
        x_base_thing: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
        samples: Samples,
    ) -> f64 {
        let radius_m = half_extents_m.iter().map(|half| half * half).sum::<f64>().sqrt();
        let centre = x_base_thing.origin();
        let points = samples.points();
        // One bit for each point that is seen.
        let mut seen = match self.cone.holds(&(self.x_eye_base * centre), radius_m) {
            Within::Wholly => (1 << points.len()) - 1,
            Within::Not => return 0.0,
            Within::Partly => {
                let x_eye_thing = self.x_eye_base * *x_base_thing;
                filter(points, half_extents_m, u16::MAX, |p_thing| {
                    self.cone.contains(&(x_eye_thing * p_thing))
                })
            }
        };
        for occluder in self.occluders.boxes() {
            let x_box_base = occluder.x_box_base();
            let eye = x_box_base * self.eye;
            if seen != 0 && occluder.may_hide(&eye, &(x_box_base * centre), radius_m) {
                let x_box_thing = x_box_base * *x_base_thing;
                seen = filter(points, half_extents_m, seen, |p_thing| {
                    !occluder.hides(&eye, &(x_box_thing * p_thing))
                });
            }
        }
        float(u64::from(seen.count_ones())) / float_of_count(points.len())
    }
}

/// Of the points whose bits are set in `among`, those for which `keep` holds.
fn filter(
    points: &[[f64; 3]],
    half_extents_m: [f64; 3],
    among: u16,
    keep: impl Fn(Position<Thing>) -> bool,
) -> u16 {
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
