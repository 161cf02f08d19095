use geometry::{Base, Pose, Position, Thing};
use glam::Vec4;
use quantity::number::single;

use crate::Occluders;
use crate::bundle::{Bundle, Stopped, Target};
use crate::occluders::Occluder;

/// Room for rounding in single precision, in cosines and in shares of a distance: what is nearer
/// than this to a border is looked at closely.
const SLACK: f32 = 4e-6;
/// The same in metres: a ball is taken to be so much larger.
const SLACK_M: f64 = 1e-3;

/// The shades of a set of boxes, as one eye at its place casts them.
///
/// Round every box lies a ball, and the ball fills a cone before the eye. A thing may be hidden
/// only by boxes whose cone touches its own and whose ball is not further than it: a few
/// multiplications for four boxes at once refuse most of the others.
#[derive(Clone, Debug)]
pub(crate) struct Shades {
    fours: Vec<Four>,
    shades: Vec<Shade>,
}

/// A box, and the eye in its frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shade {
    occluder: Occluder,
    eye: Position<Thing>,
    target: Target,
}

/// The cones of four boxes, by coordinate. Where there are fewer, the others hide nothing.
#[derive(Clone, Copy, Debug)]
struct Four {
    /// Where the ball is: a unit vector in the base frame.
    x: Vec4,
    y: Vec4,
    z: Vec4,
    /// Cosine and sine of the angle from there to the cone's surface.
    cos: Vec4,
    sin: Vec4,
    /// How near the ball comes, in metres.
    nearest_m: Vec4,
}

/// The cone of one box.
#[derive(Clone, Copy)]
struct Bound {
    direction: [f32; 3],
    cos: f32,
    sin: f32,
    nearest_m: f32,
}

impl Bound {
    /// What hides nothing: it is infinitely far.
    const NOTHING: Self = Self { direction: [0.0; 3], cos: 0.0, sin: 0.0, nearest_m: f32::INFINITY };
    /// What may hide anything, or be hidden by anything: the eye is in the ball. No cone passes it by,
    /// for the cosine with any other is 0, and so is what is asked of it.
    const ANYTHING: Self = Self { direction: [0.0; 3], cos: 0.0, sin: 0.0, nearest_m: 0.0 };

    /// The ball of a radius round a point, given as it lies from the eye in metres.
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

impl Four {
    fn of(group: &[Occluder], eye: &Position<Base>) -> Self {
        let bounds: [Bound; 4] = std::array::from_fn(|lane| {
            group.get(lane).map_or(Bound::NOTHING, |occluder| {
                Bound::of(from(eye, &occluder.centre()), occluder.radius_m())
            })
        });
        let lanes = |part: fn(&Bound) -> f32| Vec4::from_array(bounds.map(|bound| part(&bound)));
        Self {
            x: lanes(|bound| bound.direction[0]),
            y: lanes(|bound| bound.direction[1]),
            z: lanes(|bound| bound.direction[2]),
            cos: lanes(|bound| bound.cos),
            sin: lanes(|bound| bound.sin),
            nearest_m: lanes(|bound| bound.nearest_m),
        }
    }

    /// One bit for each box that may hide something of a ball: the angle between the two is not
    /// above the sum of their cones' angles, cos(a + b) = cos a cos b - sin a sin b, and the box
    /// does not begin beyond the ball's end.
    fn may_hide(&self, ball: &Bound, farthest_m: f32) -> u32 {
        let [x, y, z] = ball.direction;
        let cosine = self.x * x + self.y * y + self.z * z;
        let asked = self.cos * ball.cos - self.sin * ball.sin - SLACK;
        let near = self.nearest_m.cmple(Vec4::splat(farthest_m * (1.0 + SLACK)));
        (cosine.cmpge(asked) & near).bitmask()
    }
}

impl Shades {
    /// Room for the shades of as many boxes as the set has room for.
    pub(crate) fn with_room_for(occluders: &Occluders) -> Self {
        let room = occluders.capacity();
        Self { fours: Vec::with_capacity(room.div_ceil(4)), shades: Vec::with_capacity(room) }
    }

    /// Casts the shades anew.
    pub(crate) fn cast(&mut self, eye: &Position<Base>, occluders: &Occluders) {
        let boxes = occluders.boxes();
        self.fours.clear();
        self.fours.extend(boxes.chunks(4).map(|group| Four::of(group, eye)));
        self.shades.clear();
        self.shades.extend(boxes.iter().map(|occluder| {
            let eye = occluder.x_box_base() * *eye;
            Shade { occluder: *occluder, eye, target: Target::new(occluder, &eye) }
        }));
    }

    /// All of them.
    pub(crate) fn all(&self) -> &[Shade] {
        &self.shades
    }

    /// Those that may hide something of the ball of a radius round a point.
    pub(crate) fn upon(
        &self,
        eye: &Position<Base>,
        centre: &Position<Base>,
        radius_m: f64,
    ) -> impl Iterator<Item = &Shade> {
        let offset = from(eye, centre);
        let ball = Bound::of(offset, radius_m);
        let [x, y, z] = offset;
        let farthest_m = single((x * x + y * y + z * z).sqrt() + radius_m);
        self.fours.iter().zip(self.shades.chunks(4)).flat_map(move |(four, group)| {
            let among = four.may_hide(&ball, farthest_m);
            group.iter().enumerate().filter(move |(lane, _)| among >> lane & 1 != 0).map(|(_, shade)| shade)
        })
    }
}

impl Shade {
    /// The base frame in the frame of the box.
    pub(crate) fn x_box_base(&self) -> Pose<Thing, Base> {
        self.occluder.x_box_base()
    }

    /// Which rays of a bundle the box stops, as far as can be told cheaply.
    pub(crate) fn stops(&self, bundle: &Bundle) -> Stopped {
        self.target.stops(bundle)
    }

    /// Whether the box stands between the eye and a point in its frame.
    pub(crate) fn hides(&self, point: &Position<Thing>) -> bool {
        self.occluder.hides(&self.eye, point)
    }
}

/// A point as it lies from the eye.
fn from(eye: &Position<Base>, point: &Position<Base>) -> [f64; 3] {
    (point.point() - eye.point()).into()
}
