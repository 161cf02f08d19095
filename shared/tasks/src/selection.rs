use geometry::{Base, Person, Pose, Position};

use crate::{Object, Snapshot};

/// Distances that differ by less than this are the same, in metres.
const SAME_M: f64 = 1e-6;

/// Which of the objects of its classes a rule is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Selection {
    /// All of them: what the robot of the paper could say.
    #[default]
    All,
    /// So many of them, whichever: what is already done counts.
    Exactly(usize),
    /// All but so many of them, whichever.
    AllBut(usize),
    /// Those that stand so among them.
    Standing(Relation),
}

/// Where a thing stands among others, as seen from the perspective's own frame: left and right as
/// it faces, distances level from where it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Relation {
    /// The one furthest to the left.
    Leftmost,
    /// The one furthest to the right.
    Rightmost,
    /// The one nearest to it.
    Nearest,
    /// The one furthest from it.
    Farthest,
    /// Those on its left-hand side.
    Left,
    /// Those on its right-hand side.
    Right,
    /// Those nearer than the middle between the nearest and the farthest.
    Near,
    /// Those further than that.
    Far,
    /// Those with another one on either side: all but the leftmost and the rightmost.
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

    /// What people say: "the leftmost", "the far ones".
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

    /// Whether a thing stands so among things with this extent.
    pub(crate) fn holds(self, place: Place, extent: &Extent) -> bool {
        let Extent { left_m, distance_m } = extent;
        let middle_m = f64::midpoint(distance_m.least, distance_m.most);
        match self {
            Self::Leftmost => place.left_m >= left_m.most - SAME_M,
            Self::Rightmost => place.left_m <= left_m.least + SAME_M,
            Self::Nearest => place.distance_m <= distance_m.least + SAME_M,
            Self::Farthest => place.distance_m >= distance_m.most - SAME_M,
            Self::Left => place.left_m > SAME_M,
            Self::Right => place.left_m < -SAME_M,
            Self::Near => place.distance_m < middle_m - SAME_M,
            Self::Far => place.distance_m > middle_m + SAME_M,
            Self::Between => place.left_m < left_m.most - SAME_M && place.left_m > left_m.least + SAME_M,
        }
    }
}

/// Where a thing is in the frame of a perspective, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    /// How far to its left.
    pub(crate) left_m: f64,
    /// How far away on the level.
    pub(crate) distance_m: f64,
}

impl Place {
    /// Where an object of a snapshot is in the frame of its perspective; that frame is the base
    /// frame where the snapshot's numbers are none.
    pub(crate) fn of(frame: &Pose<Person, Base>, object: &Object) -> Option<Self> {
        let place: Position<Person> = *frame * object.position()?;
        let [x, y, _] = place.to_array();
        let place = Self { left_m: y, distance_m: x.hypot(y) };
        (place.left_m.is_finite() && place.distance_m.is_finite()).then_some(place)
    }
}

/// The base frame as a snapshot's perspective sees it.
pub(crate) fn frame_of(snapshot: &Snapshot) -> Pose<Person, Base> {
    let x_base_person =
        Pose::<Base, Person>::from_parts(snapshot.frame_position_m, snapshot.frame_orientation_xyzw);
    x_base_person.unwrap_or_else(Pose::identity).inverse()
}

/// What a set of things reaches over.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    left_m: Range,
    distance_m: Range,
}

#[derive(Clone, Copy, Debug)]
struct Range {
    least: f64,
    most: f64,
}

impl Extent {
    pub(crate) fn of(places: impl Iterator<Item = Place>) -> Self {
        let nothing = Range { least: f64::INFINITY, most: f64::NEG_INFINITY };
        let mut extent = Self { left_m: nothing, distance_m: nothing };
        for place in places {
            extent.left_m.take(place.left_m);
            extent.distance_m.take(place.distance_m);
        }
        extent
    }
}

impl Range {
    fn take(&mut self, value: f64) {
        self.least = self.least.min(value);
        self.most = self.most.max(value);
    }
}

impl Selection {
    /// How many of `of` objects shall be as the goal wants; `None` where it does not say so, or
    /// where there are too few.
    pub(crate) fn wanted(self, of: usize) -> Option<usize> {
        match self {
            Self::Exactly(count) => (count <= of).then_some(count),
            Self::AllBut(count) => (count < of).then(|| of - count),
            Self::All | Self::Standing(_) => None,
        }
    }
}

/// A small number in words.
pub(crate) fn in_words(number: usize) -> String {
    let words = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"];
    words.get(number).map_or_else(|| number.to_string(), |&word| word.to_owned())
}
