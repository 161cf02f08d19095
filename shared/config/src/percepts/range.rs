//! The range kernel: a number that a parent extracted, and the limits it lies within or not.

use message::Feature;
use quantity::number::single;
use serde::Deserialize;

use super::{Kernel, Percept};
use crate::number::NotNegative;

/// Children of a region or a range are asked only of what lies inside to a degree above this.
const INSIDE: f32 = 0.5;

/// Limits of a number that the parent's feature has. Whichever limit is missing is infinitely far; both
/// belong to the range.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Which number of the parent's feature; the other keys are in its unit.
    pub of: Component,
    /// The least.
    pub from: Option<f64>,
    /// The greatest.
    pub to: Option<f64>,
    /// How far outside a limit the degree has fallen from 1 to 0; without it, it falls at the limit.
    pub softness: Option<NotNegative>,
}

/// A number that a feature has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// x of a vector: of a position, how far ahead it is, in metres.
    XM,
    /// y of a vector: of a position, how far to the left it is, in metres.
    YM,
    /// z of a vector: of a position, how high it is, in metres.
    ZM,
    /// The length of a vector: of a position, how far it is from where the perspective stands, in metres.
    DistanceM,
    /// The longest whole side of extents, in metres.
    LongestM,
    /// The shortest whole side of extents, in metres.
    ShortestM,
    /// A number itself: of a state, a region or a range the degree.
    Number,
}

impl Component {
    /// As the file calls it.
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

    /// Whether features that a percept of this kernel derives have such a number. What a program's own
    /// derive is its own affair; its vectors are not extents.
    #[must_use]
    pub const fn is_of(self, kernel: &Kernel) -> bool {
        match self {
            Self::XM | Self::YM | Self::ZM | Self::DistanceM => {
                matches!(kernel, Kernel::Position | Kernel::Own(_))
            }
            Self::LongestM | Self::ShortestM => matches!(kernel, Kernel::Extents),
            Self::Number => {
                matches!(kernel, Kernel::State(_) | Kernel::Region(_) | Kernel::Range(_) | Kernel::Own(_))
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
            // Extents are halves.
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
    /// To what degree the number of a feature lies within the limits: 1 inside, and outside falling
    /// linearly to 0 over the softness. `None` where the feature has no such number.
    ///
    /// Limits count in single precision, as what is observed does: 0.7 is within a range from 0.7.
    #[must_use]
    pub fn degree(&self, feature: Feature) -> Option<f32> {
        Some(self.degree_of(self.of.of(feature)?))
    }

    fn degree_of(&self, number: f32) -> f32 {
        let limit = |limit: Option<f64>, none: f64| f64::from(single(limit.unwrap_or(none)));
        let (from, to) = (limit(self.from, f64::NEG_INFINITY), limit(self.to, f64::INFINITY));
        let number = f64::from(number);
        // Written so that NaN is outside.
        if from <= number && number <= to {
            return 1.0;
        }
        let outside = (from - number).max(number - to);
        let softness = self.softness.map_or(0.0, NotNegative::get);
        if outside < softness { single(1.0 - outside / softness) } else { 0.0 }
    }

    /// The match m (Eq. 1) of a degree: how well the better of two answers, inside and outside,
    /// matches. Outside is an answer too, so that what has left the range is remembered as outside;
    /// half way both match by a half.
    #[must_use]
    pub const fn matching(degree: f32) -> f32 {
        degree.max(1.0 - degree)
    }
}

impl Kernel {
    /// Whether it reads its data from what a parent of that kernel derived (the parent's feature d), and
    /// not from the observation:
    ///
    /// - a range reads the number that it is of;
    /// - a region reads the place, of a position or of a program's own that derived a vector;
    /// - the nearest prototype reads the half extents of extents or of a program's own for `edge_m`, and
    ///   linear red, green and blue of a program's own for `colour`, where that derived a vector.
    ///
    /// For all others, and where a program's own derived something else, the parent decides only whether
    /// they are asked.
    #[must_use]
    pub fn reads(&self, parent: &Self) -> bool {
        let is_own = matches!(parent, Self::Own(_));
        match self {
            Self::Range(range) => range.of.is_of(parent),
            Self::Region(_) => is_own || matches!(parent, Self::Position),
            Self::Nearest(nearest) => match nearest.of {
                super::Space::EdgeM => is_own || matches!(parent, Self::Extents),
                super::Space::Colour => is_own,
                super::Space::Shape => false,
            },
            Self::Position
            | Self::Orientation
            | Self::Extents
            | Self::Source
            | Self::State(_)
            | Self::Own(_) => false,
        }
    }

    /// Whether children are asked of a thing of which a percept of this kernel derived `feature`: those of
    /// a region or a range only of what is rather inside than outside, all others whatever it was.
    #[must_use]
    pub fn opens(&self, feature: Feature) -> bool {
        !self.is_gate() || is_inside(feature)
    }

    /// Whether its children are asked only of what [is inside](is_inside).
    #[must_use]
    pub const fn is_gate(&self) -> bool {
        matches!(self, Self::Region(_) | Self::Range(_))
    }
}

/// Whether what a region or a range derived says rather inside than outside.
#[must_use]
#[inline]
pub fn is_inside(feature: Feature) -> bool {
    matches!(feature, Feature::Number(degree) if degree > INSIDE)
}

/// The percept from which a percept's data come in the end: of a range what its parent, or the parent of
/// the ranges above it, is; of any other itself.
#[must_use]
pub fn origin<'a>(percepts: &'a [Percept], percept: &'a Percept) -> &'a Percept {
    let mut origin = percept;
    // A parent stands before its children: this ends.
    while let (Kernel::Range(_), Some(parent)) = (&origin.kernel, origin.parent) {
        match percepts.get(usize::from(parent)) {
            Some(parent) => origin = parent,
            None => break,
        }
    }
    origin
}
