//! `percepts.toml`: the percepts, and how observations become beliefs.
//!
//! [`Percepts`] is the file with every name resolved and every reference checked, so its users need no further checks.
//! Equations are those of Berlin et al. 2006, "Belief Modeling".

mod file;
mod range;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::time::Duration;

use message::State;
use serde::Deserialize;

use crate::number::{Capacity, Positive, Unit};
use crate::{ConfigError, load};

pub use range::{Component, Range, is_inside, origin};

const BUILTIN: &str = include_str!("../../../config/percepts.toml");

/// The percept set P with its threshold k, and the parameters of the belief system.
#[derive(Clone, Debug, PartialEq)]
pub struct Percepts {
    /// k: an evaluation passes if match times confidence exceeds it (Eq. 2).
    pub threshold: f64,
    /// The percepts; a percept's number is its index in this list.
    pub percepts: Vec<Percept>,
    /// Distance, clustering and culling.
    pub belief: Belief,
}

/// One percept.
#[derive(Clone, Debug, PartialEq)]
pub struct Percept {
    /// Its unique name.
    pub name: String,
    /// The earlier percept that gates this one: it must have passed and, if it is a region or a range, evaluated to
    /// inside ([`Kernel::admits`]). Its feature is this percept's input if the kernel [reads](Kernel::reads) it.
    pub parent: Option<u16>,
    /// Its role in a goal belief.
    pub role: Role,
    /// Decay rate: confidence after the last sample falls as exp(-decay_per_s · seconds).
    pub decay_per_s: f64,
    /// Its history generator.
    pub history: History,
    /// Its classifier.
    pub kernel: Kernel,
}

/// The role of a percept in a goal belief.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// It selects the objects that are meant.
    Criteria,
    /// It describes the state that they are to reach.
    Expectation,
    /// Goal beliefs ignore it.
    Neither,
}

/// A history generator g of G (between Eqs. 3 and 4).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum History {
    /// Every sample, exactly, up to the capacity.
    Lossless {
        /// Maximum number of samples.
        samples: Capacity,
        /// Which sample is dropped when full.
        when_full: WhenFull,
    },
    /// y = a·x + (1 − a)·y: the current value only, no past.
    LowPass {
        /// a: the weight of the newest sample.
        alpha: Unit,
    },
    /// Samples thinned with age: a query for any age returns a sample whose age is within a factor of two.
    LogTimescale {
        /// Maximum number of samples; two per octave of age are needed.
        samples: Capacity,
    },
    /// A history generator that the program registers under this name.
    Plugin(String),
}

/// Which sample a full lossless history drops.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WhenFull {
    /// The oldest sample.
    ForgetOldest,
    /// The inner sample whose removal leaves the shortest gap; among equal ones the oldest.
    Thin,
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
}

/// A prototype.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prototype {
    /// The name of its symbol.
    pub name: String,
    /// Its coordinates, one per dimension of the space.
    pub at: Vec<f64>,
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

/// The parameters of the belief system: d, q, w and c of its tuple (B, G, M, d, q, w, c).
#[derive(Clone, Debug, PartialEq)]
pub struct Belief {
    /// Two beliefs whose distance D is below it are merged.
    pub threshold: f64,
    /// Whether D is divided by the sum of the weights of the terms that apply.
    pub normalised: bool,
    /// Cannot-link constraint: whether beliefs with observations of the same source and instant are never merged.
    pub cannot_link_same_source_instant: bool,
    /// D of two beliefs if no term applies.
    pub no_term_applies: NoTermApplies,
    /// The terms of D (Eq. 4).
    pub distance: Vec<Distance>,
    /// The culling functions, all of which must agree (Eq. 5).
    pub cull: Vec<Cull>,
}

/// The distance of two beliefs if no term applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoTermApplies {
    /// Infinite: such beliefs are never merged.
    Infinite,
    /// Zero: the empty sum, as in the paper.
    Zero,
}

/// One term w·q·d of the belief distance (Eq. 4).
#[derive(Clone, Debug, PartialEq)]
pub struct Distance {
    /// The percept that it compares; the term applies if both beliefs have it.
    pub percept: u16,
    /// The distance function.
    pub measure: Measure,
    /// w, zero or positive.
    pub weight: f64,
}

/// A belief distance function d.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Euclidean distance of two positions or of two extents.
    Metres,
    /// Angle between two orientations.
    AngleRad,
    /// Difference of two numbers.
    Difference,
    /// 1 for two different symbols, 0 for equal ones.
    Differs,
    /// A distance function that the program registers under this name.
    Plugin(String),
}

/// A culling function (Eq. 5).
#[derive(Clone, Debug, PartialEq)]
pub enum Cull {
    /// No observation was merged into it for longer than this.
    UnseenLongerThan(Duration),
    /// The remembered confidence of a percept has fallen below a floor.
    ConfidenceBelow {
        /// The percept; a belief without it satisfies the condition.
        percept: u16,
        /// The floor.
        floor: f64,
    },
    /// Its position has been in view of a source that saw it before, without a break for this long, and it was not
    /// observed there. A belief without a position never satisfies the condition.
    PlaceEmptyFor(Duration),
    /// A culling function that the program registers under this name.
    Plugin(String),
}

impl Percepts {
    /// Reads and checks the file.
    ///
    /// # Errors
    ///
    /// As [`crate::load`]; also a duplicate or unknown name, a history or measure that does not fit the percept's
    /// feature, or a range of a number that its parent does not derive.
    pub fn load(file: &Path) -> Result<Self, ConfigError> {
        let text = load::text(file)?;
        Self::parse(&text, file)
    }

    /// Checks the text of the file; errors name it as `file`.
    ///
    /// # Errors
    ///
    /// As [`Self::load`].
    pub fn parse(text: &str, file: &Path) -> Result<Self, ConfigError> {
        crate::parse::<file::File>(text, file)?
            .resolve()
            .map_err(|(span, reason)| load::invalid(text, file, span, reason))
    }

    /// The built-in percepts, `config/percepts.toml` at compile time.
    #[must_use]
    #[expect(clippy::expect_used, reason = "the text is compiled in, and a test parses it")]
    pub fn builtin() -> Self {
        Self::parse(BUILTIN, Path::new("config/percepts.toml")).expect("the built-in percepts are sound")
    }

    /// The number of the percept with that name.
    #[must_use]
    pub fn index(&self, name: &str) -> Option<u16> {
        let index = self.percepts.iter().position(|percept| percept.name == name)?;
        u16::try_from(index).ok()
    }

    /// The number of the position percept, if there is one.
    #[must_use]
    pub fn place(&self) -> Option<u16> {
        let index = self.percepts.iter().position(|percept| percept.kernel == Kernel::Position)?;
        u16::try_from(index).ok()
    }

    /// Association distance: how far apart two otherwise equal observations may be and still be of one object, in
    /// metres (Eq. 4). Infinite if the belief distance has no position term.
    #[must_use]
    pub fn association_distance_m(&self) -> f64 {
        let belief = &self.belief;
        let is_place = |term: &&Distance| {
            let kernel = self.get(term.percept).map(|percept| &percept.kernel);
            term.measure == Measure::Metres && kernel == Some(&Kernel::Position)
        };
        let place: f64 = belief.distance.iter().filter(is_place).map(|term| term.weight).sum();
        let all: f64 = belief.distance.iter().map(|term| term.weight).sum();
        let share = if belief.normalised { place / all } else { place };
        if share > 0.0 { belief.threshold / share } else { f64::INFINITY }
    }

    /// The percept with that number.
    #[must_use]
    pub fn get(&self, index: u16) -> Option<&Percept> {
        self.percepts.get(usize::from(index))
    }
}

impl Belief {
    /// Sets every switch to the paper's literal form. Returns one line per switch with its new and its old value, for
    /// people.
    pub fn make_literal(&mut self) -> Vec<String> {
        let was = self.clone();
        self.cannot_link_same_source_instant = false;
        self.no_term_applies = NoTermApplies::Zero;
        self.normalised = false;
        let no_term = |setting| match setting {
            NoTermApplies::Infinite => "\"infinite\"",
            NoTermApplies::Zero => "\"zero\"",
        };
        vec![
            format!("cannot_link_same_source_instant = false (was {})", was.cannot_link_same_source_instant),
            format!("no_term_applies = \"zero\" (was {})", no_term(was.no_term_applies)),
            format!("normalised = false (was {})", was.normalised),
        ]
    }
}

impl Percept {
    /// The names of its symbols, in the order of their numbers; empty if the kernel derives no named symbols.
    pub fn symbols(&self) -> impl Iterator<Item = &str> {
        let prototypes = match &self.kernel {
            Kernel::Nearest(nearest) => nearest.prototypes.as_slice(),
            Kernel::Position
            | Kernel::Orientation
            | Kernel::Extents
            | Kernel::Source
            | Kernel::State(_)
            | Kernel::Region(_)
            | Kernel::Range(_)
            | Kernel::Plugin(_) => &[],
        };
        prototypes.iter().map(|prototype| prototype.name.as_str())
    }
}
