//! Which objects of its classes a rule applies to: all, a number of them, or those with a spatial relation.

use geometry::{Base, Person, Pose, Position};

use crate::demonstration::{Object, Snapshot};

/// Distances that differ by less than this are equal, in metres.
const SAME_M: f64 = 1e-6;

/// Which of the objects of its classes a rule applies to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Selection {
    /// All of them: the only selection of the paper.
    #[default]
    All,
    /// Any objects of this number; objects already in the goal state count.
    Exactly(usize),
    /// All but any objects of this number.
    AllBut(usize),
    /// Those with this spatial relation to the others.
    Relation(Relation),
}

/// A spatial relation within a set of objects, in the frame of the perspective. Left and right are along its
/// y axis; distances are horizontal, from its origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Relation {
    /// The leftmost one.
    Leftmost,
    /// The rightmost one.
    Rightmost,
    /// The nearest one.
    Nearest,
    /// The farthest one.
    Farthest,
    /// Those left of the x axis of the frame.
    Left,
    /// Those right of the x axis of the frame.
    Right,
    /// Those nearer than halfway between the nearest and the farthest.
    Near,
    /// Those farther than halfway between the nearest and the farthest.
    Far,
    /// All but the leftmost and the rightmost.
    Between,
}

impl Relation {
    /// All relations.
    pub const ALL: [Self; 9] = [
        Self::Leftmost,
        Self::Rightmost,
        Self::Nearest,
        Self::Farthest,
        Self::Left,
        Self::Right,
        Self::Near,
        Self::Far,
        Self::Between,
    ];

    /// The phrase for the relation: "the leftmost", "the far ones".
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Leftmost => "the leftmost",
            Self::Rightmost => "the rightmost",
            Self::Nearest => "the nearest",
            Self::Farthest => "the farthest",
            Self::Left => "the left-hand ones",
            Self::Right => "the right-hand ones",
            Self::Near => "the near ones",
            Self::Far => "the far ones",
            Self::Between => "the ones in between",
        }
    }

    /// Whether an object at `place` has this relation within a set of this extent.
    pub(crate) fn holds(self, place: Place, extent: &Extent) -> bool {
        let Extent { left_m, distance_m } = extent;
        let middle_m = f64::midpoint(distance_m.lower, distance_m.upper);
        match self {
            Self::Leftmost => place.left_m >= left_m.upper - SAME_M,
            Self::Rightmost => place.left_m <= left_m.lower + SAME_M,
            Self::Nearest => place.distance_m <= distance_m.lower + SAME_M,
            Self::Farthest => place.distance_m >= distance_m.upper - SAME_M,
            Self::Left => place.left_m > SAME_M,
            Self::Right => place.left_m < -SAME_M,
            Self::Near => place.distance_m < middle_m - SAME_M,
            Self::Far => place.distance_m > middle_m + SAME_M,
            Self::Between => place.left_m < left_m.upper - SAME_M && place.left_m > left_m.lower + SAME_M,
        }
    }
}

/// The position of an object in the frame of a perspective, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    /// Coordinate to the left (y).
    pub(crate) left_m: f64,
    /// Horizontal distance from the origin of the frame.
    pub(crate) distance_m: f64,
}

impl Place {
    /// The position of an object of a snapshot; `None` if it has none or it is not finite.
    pub(crate) fn of(frame: &Pose<Person, Base>, object: &Object) -> Option<Self> {
        let place: Position<Person> = *frame * object.position()?;
        let [x, y, _] = place.to_array();
        let place = Self { left_m: y, distance_m: x.hypot(y) };
        (place.left_m.is_finite() && place.distance_m.is_finite()).then_some(place)
    }
}

/// The pose of the base frame in the frame of the snapshot's perspective; the identity if the snapshot's pose is
/// invalid.
pub(crate) fn frame_of(snapshot: &Snapshot) -> Pose<Person, Base> {
    let x_base_person =
        Pose::<Base, Person>::from_parts(snapshot.frame_position_m, snapshot.frame_orientation_xyzw);
    x_base_person.unwrap_or_else(Pose::identity).inverse()
}

/// The range of positions of a set of objects.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    left_m: Range,
    distance_m: Range,
}

#[derive(Clone, Copy, Debug)]
struct Range {
    lower: f64,
    upper: f64,
}

impl Extent {
    pub(crate) fn of(places: impl Iterator<Item = Place>) -> Self {
        let nothing = Range { lower: f64::INFINITY, upper: f64::NEG_INFINITY };
        let mut extent = Self { left_m: nothing, distance_m: nothing };
        for place in places {
            extent.left_m.include(place.left_m);
            extent.distance_m.include(place.distance_m);
        }
        extent
    }
}

impl Range {
    fn include(&mut self, value: f64) {
        self.lower = self.lower.min(value);
        self.upper = self.upper.max(value);
    }
}

impl Selection {
    /// The number of objects, out of `of`, that shall be in the goal state. `None` if the selection has no
    /// number or there are too few objects.
    pub(crate) fn wanted(self, of: usize) -> Option<usize> {
        match self {
            Self::Exactly(count) => (count <= of).then_some(count),
            Self::AllBut(count) => (count < of).then(|| of - count),
            Self::All | Self::Relation(_) => None,
        }
    }
}
