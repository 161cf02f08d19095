//! The range kernel: whether a number of the parent's feature lies within limits.

use message::Feature;
use quantity::number::single;
use serde::Deserialize;

use super::{Kernel, Percept};
use crate::number::NotNegative;

/// A region or a range gates its children: they are evaluated only if its degree exceeds this.
const INSIDE: f32 = 0.5;

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
                super::Space::EdgeM => is_own || matches!(parent, Self::Extents),
                super::Space::Colour => is_own,
                super::Space::Shape => false,
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

/// The percept that supplies a percept's data: for a range its nearest ancestor that is not a range, for any other
/// percept itself.
#[must_use]
pub fn origin<'a>(percepts: &'a [Percept], percept: &'a Percept) -> &'a Percept {
    let mut origin = percept;
    // Parents precede their children in the list, so the loop ends.
    while let (Kernel::Range(_), Some(parent)) = (&origin.kernel, origin.parent) {
        match percepts.get(usize::from(parent)) {
            Some(parent) => origin = parent,
            None => break,
        }
    }
    origin
}
