//! The settings of a percept's classifier, and the percept set that a [`Perception`](crate::Perception) is made of.

use std::fmt;

use message::{Feature, MAX_SYMBOLS, NAME_CAPACITY, Name, State};
use quantity::number::single;
use quantity::srgb;
use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use settings::number::{NotNegative, Positive};

/// A region or a range gates its children: they are evaluated only if its degree exceeds this.
const INSIDE: f32 = 0.5;

/// The percept set P with its threshold, as a configuration defines it.
#[derive(Clone, Debug)]
pub struct PerceptSet<'a> {
    /// k: an evaluation passes if match times confidence exceeds it (Eq. 2).
    pub threshold: f64,
    /// The percepts; a percept's number is its index in this list. A parent precedes its children.
    pub percepts: Vec<Definition<'a>>,
}

/// The definition of a percept.
#[derive(Clone, Copy, Debug)]
pub struct Definition<'a> {
    /// Its unique name.
    pub name: &'a str,
    /// The number of the earlier percept that gates this one.
    pub parent: Option<u16>,
    /// Its classifier.
    pub kernel: &'a Kernel,
}

/// How a percept classifies an observation (Eq. 1).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Kernel {
    /// The object's position in the perspective's frame, in metres.
    Position,
    /// The object's orientation in the perspective's frame.
    Orientation,
    /// Half the extents along the object's own axes, in metres.
    Extents,
    /// The number of the source that observed it, as a symbol; the same for every perspective.
    Source,
    /// The degree of a state; no match if the object has no such state.
    State(StateName),
    /// The nearest prototype in a feature space.
    Nearest(Nearest),
    /// 1 inside a box of the perspective's frame and 0 outside; an indexical percept.
    Region(Region),
    /// Whether a number that the parent derived lies within limits; indexical if that number is.
    Range(Range),
    /// A classifier that the program registers under this name.
    Plugin(String),
}

/// The name of a state in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StateName {
    /// The object's hole holds a peg.
    Filled,
    /// The object carries a marker.
    Marked,
    /// The object sits in a hole.
    Inserted,
    /// The object is switched on.
    On,
}

impl StateName {
    /// The state as used in observations.
    #[must_use]
    pub fn state(self) -> State {
        match self {
            Self::Filled => State::Filled,
            Self::Marked => State::Marked,
            Self::Inserted => State::Inserted,
            Self::On => State::On,
        }
    }
}

/// Parameters of the nearest-prototype kernel.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Nearest {
    /// The feature space.
    pub space: Space,
    /// The distance from a prototype at which the match reaches zero.
    pub scale: Positive,
    /// The prototypes; a prototype's index in this list is its symbol.
    pub prototypes: Vec<Prototype>,
}

/// A feature space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Space {
    /// Elongated, flat, round and tapered, each in [0, 1].
    Shape,
    /// Linear red, green and blue.
    Colour,
    /// The cube root of the volume of the object's bounding box, in metres.
    EdgeM,
}

impl Space {
    /// The number of dimensions.
    #[must_use]
    pub const fn dimensions(self) -> usize {
        match self {
            Self::Shape => 4,
            Self::Colour => 3,
            Self::EdgeM => 1,
        }
    }

    /// Whether an observation can have this coordinate; false for NaN.
    fn holds(self, coordinate: f64) -> bool {
        match self {
            Self::Shape | Self::Colour => (0.0..=1.0).contains(&coordinate),
            Self::EdgeM => coordinate > 0.0 && coordinate.is_finite(),
        }
    }

    /// What [`Self::holds`] requires; completes the sentence "the space has …".
    const fn range(self) -> &'static str {
        match self {
            Self::Shape => "elongated, flat, round and tapered, each from 0 to 1",
            Self::Colour => "linear red, green and blue, each from 0 to 1, or \"#rrggbb\"",
            Self::EdgeM => "an edge in metres, finite and above 0",
        }
    }
}

/// A prototype.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prototype {
    /// The name of its symbol.
    pub name: String,
    /// Its coordinates, one per dimension of the space. The file may give a colour as `"#rrggbb"` in sRGB; it is
    /// converted to linear red, green and blue.
    #[serde(deserialize_with = "coordinates")]
    pub at: Vec<f64>,
}

/// Reads the coordinates of a prototype: a list of numbers, or a colour of sRGB as `"#rrggbb"`.
fn coordinates<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
    struct Coordinates;

    impl<'de> Visitor<'de> for Coordinates {
        type Value = Vec<f64>;

        fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
            out.write_str("a list of numbers, or a colour as \"#rrggbb\"")
        }

        fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Self::Value, E> {
            let srgb8 = srgb::parse_hex(text).ok_or_else(|| {
                E::custom(format_args!("`{text}` is no colour: give \"#rrggbb\", six hexadecimal digits"))
            })?;
            Ok(srgb::linear(srgb8).to_vec())
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut from: A) -> Result<Self::Value, A::Error> {
            let mut numbers = Vec::new();
            while let Some(number) = from.next_element()? {
                numbers.push(number);
            }
            Ok(numbers)
        }
    }

    from.deserialize_any(Coordinates)
}

/// A box in the perspective's frame; its sides may be infinite.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Minimum x, y and z, in metres.
    pub min_m: [f64; 3],
    /// Maximum x, y and z, in metres.
    pub max_m: [f64; 3],
}

impl Region {
    /// Whether a position is in the box, sides included.
    #[must_use]
    pub fn holds(&self, position_m: [f32; 3]) -> bool {
        let sides = self.min_m.iter().zip(&self.max_m);
        position_m.iter().zip(sides).all(|(at, (minimum, maximum))| {
            let at = f64::from(*at);
            *minimum <= at && at <= *maximum
        })
    }
}

/// Limits of a number in the parent's feature. A missing limit is infinite; both limits belong to the range.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// The number of the parent's feature; the other keys are in its unit.
    pub component: Component,
    /// Lower limit.
    pub from: Option<f64>,
    /// Upper limit.
    pub to: Option<f64>,
    /// The distance outside a limit over which the degree falls from 1 to 0; if absent, it falls at the limit.
    pub softness: Option<NotNegative>,
}

/// A number in a feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// x of a vector; of a position the distance ahead, in metres.
    XM,
    /// y of a vector; of a position the distance to the left, in metres.
    YM,
    /// z of a vector; of a position the height, in metres.
    ZM,
    /// The norm of a vector; of a position the distance from the origin of the perspective's frame, in metres.
    DistanceM,
    /// The longest full side of extents, in metres.
    LongestM,
    /// The shortest full side of extents, in metres.
    ShortestM,
    /// A plain number; of a state, a region or a range the degree.
    Number,
}

impl Component {
    /// Its name in the file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::XM => "x_m",
            Self::YM => "y_m",
            Self::ZM => "z_m",
            Self::DistanceM => "distance_m",
            Self::LongestM => "longest_m",
            Self::ShortestM => "shortest_m",
            Self::Number => "number",
        }
    }

    /// Whether features derived by this kernel have such a number. A registered classifier may derive numbers and
    /// vectors; its vectors do not count as extents.
    #[must_use]
    pub const fn is_of(self, kernel: &Kernel) -> bool {
        match self {
            Self::XM | Self::YM | Self::ZM | Self::DistanceM => {
                matches!(kernel, Kernel::Position | Kernel::Plugin(_))
            }
            Self::LongestM | Self::ShortestM => matches!(kernel, Kernel::Extents),
            Self::Number => {
                matches!(kernel, Kernel::State(_) | Kernel::Region(_) | Kernel::Range(_) | Kernel::Plugin(_))
            }
        }
    }

    fn of(self, feature: Feature) -> Option<f32> {
        match (self, feature) {
            (Self::XM, Feature::Vector([x, _, _])) => Some(x),
            (Self::YM, Feature::Vector([_, y, _])) => Some(y),
            (Self::ZM, Feature::Vector([_, _, z])) => Some(z),
            (Self::DistanceM, Feature::Vector(vector)) => Some(single(
                vector.iter().map(|part| f64::from(*part) * f64::from(*part)).sum::<f64>().sqrt(),
            )),
            // Extents are half sides.
            (Self::LongestM, Feature::Vector([a, b, c])) => Some(2.0 * a.max(b).max(c)),
            (Self::ShortestM, Feature::Vector([a, b, c])) => Some(2.0 * a.min(b).min(c)),
            (Self::Number, Feature::Number(number)) => Some(number),
            (
                Self::XM
                | Self::YM
                | Self::ZM
                | Self::DistanceM
                | Self::LongestM
                | Self::ShortestM
                | Self::Number,
                _,
            ) => None,
        }
    }
}

impl Range {
    /// The degree to which a feature's number lies within the limits: 1 inside, falling linearly to 0 over the softness
    /// outside. `None` if the feature has no such number.
    ///
    /// Limits are compared in single precision, like observations: 0.7 is within a range from 0.7.
    #[must_use]
    pub fn degree(&self, feature: Feature) -> Option<f32> {
        Some(self.degree_of(self.component.of(feature)?))
    }

    fn degree_of(&self, number: f32) -> f32 {
        let limit = |limit: Option<f64>, none: f64| f64::from(single(limit.unwrap_or(none)));
        let (from, to) = (limit(self.from, f64::NEG_INFINITY), limit(self.to, f64::INFINITY));
        let number = f64::from(number);
        // Written so that NaN counts as outside.
        if from <= number && number <= to {
            return 1.0;
        }
        let outside = (from - number).max(number - to);
        let softness = self.softness.map_or(0.0, NotNegative::get);
        if outside < softness { single(1.0 - outside / softness) } else { 0.0 }
    }

    /// The match m (Eq. 1) of a degree: that of the better of the two answers inside and outside. Outside is an answer
    /// too, so an object that left the range is remembered as outside. Half way, both match by 0.5.
    #[must_use]
    pub const fn matching(degree: f32) -> f32 {
        degree.max(1.0 - degree)
    }
}

impl Kernel {
    /// Checks the numbers and names of the classifier, given the name and the classifier of its parent.
    ///
    /// # Errors
    ///
    /// What is wrong, and what would be valid.
    pub fn check(&self, parent: Option<(&str, &Self)>) -> Result<(), String> {
        match self {
            Self::Nearest(nearest) => check_prototypes(nearest),
            Self::Region(region) => check_region(region),
            Self::Range(range) => check_range(range, parent),
            Self::Position
            | Self::Orientation
            | Self::Extents
            | Self::Source
            | Self::State(_)
            | Self::Plugin(_) => Ok(()),
        }
    }

    /// Whether it reads the parent's feature d instead of the observation, for a parent of that kernel:
    ///
    /// - a range reads its number;
    /// - a region reads the position, from a position or from a vector of a registered classifier;
    /// - a nearest prototype in `edge_m` reads half extents, from extents or from a vector of a registered classifier;
    /// - a nearest prototype in `colour` reads linear red, green and blue, from a vector of a registered classifier.
    ///
    /// In all other cases the parent only gates the evaluation.
    #[must_use]
    pub fn reads(&self, parent: &Self) -> bool {
        let is_own = matches!(parent, Self::Plugin(_));
        match self {
            Self::Range(range) => range.component.is_of(parent),
            Self::Region(_) => is_own || matches!(parent, Self::Position),
            Self::Nearest(nearest) => match nearest.space {
                Space::EdgeM => is_own || matches!(parent, Self::Extents),
                Space::Colour => is_own,
                Space::Shape => false,
            },
            Self::Position
            | Self::Orientation
            | Self::Extents
            | Self::Source
            | Self::State(_)
            | Self::Plugin(_) => false,
        }
    }

    /// Whether children are evaluated, given the `feature` that this kernel derived. A region or a range admits only
    /// what is inside; any other kernel admits everything.
    #[must_use]
    pub fn admits(&self, feature: Feature) -> bool {
        !self.is_gate() || is_inside(feature)
    }

    /// Whether its children are evaluated only for what [is inside](is_inside).
    #[must_use]
    pub const fn is_gate(&self) -> bool {
        matches!(self, Self::Region(_) | Self::Range(_))
    }
}

/// Whether the feature of a region or a range means inside.
#[must_use]
#[inline]
pub fn is_inside(feature: Feature) -> bool {
    matches!(feature, Feature::Number(degree) if degree > INSIDE)
}

fn check_prototypes(nearest: &Nearest) -> Result<(), String> {
    if nearest.prototypes.is_empty() {
        return Err("`nearest` needs a prototype: give at least one".to_owned());
    }
    if nearest.prototypes.len() > MAX_SYMBOLS {
        return Err(format!("{} prototypes: at most {MAX_SYMBOLS} are possible", nearest.prototypes.len()));
    }
    for (index, prototype) in nearest.prototypes.iter().enumerate() {
        let dimensions = nearest.space.dimensions();
        let name = &prototype.name;
        check_name(name)?;
        if prototype.at.len() != dimensions {
            let given = prototype.at.len();
            return Err(format!("prototype `{name}` has {given} numbers: its space has {dimensions}"));
        }
        if let Some(outside) = prototype.at.iter().find(|part| !nearest.space.holds(**part)) {
            let range = nearest.space.range();
            return Err(format!("`at` of prototype `{name}` has {outside}: its space has {range}"));
        }
        if nearest.prototypes.iter().take(index).any(|earlier| earlier.name == *name) {
            return Err(format!("a second prototype named `{name}`"));
        }
    }
    Ok(())
}

/// Checks the name of a percept or of a symbol. Readers in other processes get it in a field of fixed size.
///
/// # Errors
///
/// What is wrong, and what would be valid.
pub fn check_name(name: &str) -> Result<(), String> {
    if Name::is_valid(name) {
        Ok(())
    } else {
        Err(format!("{name:?} is not a name: it needs 1 to {NAME_CAPACITY} bytes, on one line"))
    }
}

fn check_region(region: &Region) -> Result<(), String> {
    // Written so that NaN is rejected.
    if region.min_m.iter().zip(&region.max_m).all(|(minimum, maximum)| minimum < maximum) {
        Ok(())
    } else {
        Err("an empty region: every minimum must be below its maximum".to_owned())
    }
}

fn check_range(range: &Range, parent: Option<(&str, &Kernel)>) -> Result<(), String> {
    let of = range.component.name();
    let Some((name, kernel)) = parent else {
        return Err(format!(
            "a range without a parent, from which it takes its `{of}`: name an earlier percept with `parent`"
        ));
    };
    if !range.component.is_of(kernel) {
        return Err(format!(
            "the parent `{name}` derives no `{of}`: a position has x_m, y_m, z_m and distance_m, extents have \
             longest_m and shortest_m, a state, a region and a range have number; a program's own may have any \
             but longest_m and shortest_m"
        ));
    }
    let limits = [("from", range.from), ("to", range.to)];
    if let Some((key, limit)) =
        limits.into_iter().find_map(|(key, limit)| Some((key, limit.filter(|limit| !limit.is_finite())?)))
    {
        return Err(format!("`{key}` is {limit}: it must be finite; leave out a limit that is not there"));
    }
    match (range.from, range.to) {
        (None, None) => Err("a range without limits holds everything: give `from`, `to` or both".to_owned()),
        (Some(from), Some(to)) if from < to => Ok(()),
        (Some(from), Some(to)) => {
            Err(format!("an empty range from {from} to {to}: `from` must be below `to`"))
        }
        (Some(_), None) | (None, Some(_)) => Ok(()),
    }
}
