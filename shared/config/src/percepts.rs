//! `percepts.toml`: what Leo perceives, and how observations become beliefs.
//!
//! [`Percepts`] is the file with every name resolved and every reference checked: whoever holds
//! one need not doubt it. Equations are those of Berlin et al. 2006, "Belief Modeling".

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

/// The percept set P with its threshold k, and the parameters of the Belief System.
#[derive(Clone, Debug, PartialEq)]
pub struct Percepts {
    /// k: an evaluation passes when match times confidence is above it (Eq. 2).
    pub threshold: f64,
    /// The percepts; the position in this list is a percept's number.
    pub percepts: Vec<Percept>,
    /// Distance, clustering and culling.
    pub belief: Belief,
}

/// One percept.
#[derive(Clone, Debug, PartialEq)]
pub struct Percept {
    /// What it is called.
    pub name: String,
    /// The earlier percept that must have passed for this one to be evaluated, and, where it is a region
    /// or a range, have said inside ([`Kernel::opens`]). What it derived is what this one reads, where
    /// it [can](Kernel::reads).
    pub parent: Option<u16>,
    /// What it may be to a goal belief.
    pub role: Role,
    /// Confidence after the last sample falls as exp(-decay_per_s · seconds).
    pub decay_per_s: f64,
    /// What is remembered of it.
    pub history: History,
    /// How it classifies.
    pub kernel: Kernel,
}

/// What a percept may be to a goal belief.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// It says which things are meant.
    Criteria,
    /// It says what is to become of them.
    Expectation,
    /// Goals do not speak of it.
    Neither,
}

/// A history generator g of G (between Eqs. 3 and 4).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum History {
    /// Every sample, exactly, as long as there is room.
    Lossless {
        /// Samples kept at most.
        samples: Capacity,
        /// What goes when there is no room.
        when_full: WhenFull,
    },
    /// y = a·x + (1 − a)·y: the present value, and no past.
    LowPass {
        /// a: the share of the newest sample.
        share: Unit,
    },
    /// Samples thinned with their age: a question about any age is answered by a sample whose
    /// age is within a factor of two.
    LogTimescale {
        /// Samples kept at most; two per octave of age are needed.
        samples: Capacity,
    },
    /// A generator that the program supplies under this name.
    Own(String),
}

/// What a lossless history gives up when it is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WhenFull {
    /// The oldest sample.
    ForgetOldest,
    /// The sample between the first and the last whose absence leaves the shortest gap; of equal
    /// ones the oldest.
    Thin,
}

/// How a percept classifies an observation (Eq. 1).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Kernel {
    /// Where the thing is, in the perspective's frame, in metres.
    Position,
    /// How it is turned, in the perspective's frame.
    Orientation,
    /// Half its extents along its own axes, in metres.
    Extents,
    /// Which source observed it, by its number as a symbol: the same for every perspective.
    Source,
    /// The degree of a state; no match where the thing has no such state.
    State(StateName),
    /// The prototype that is nearest in a space of features.
    Nearest(Nearest),
    /// 1 inside a box of the perspective's frame and 0 outside: an indexical percept.
    Region(Region),
    /// Whether a number that the parent derived is within limits: indexical where the number is.
    Range(Range),
    /// A classifier that the program supplies under this name.
    Own(String),
}

/// A state as the file calls it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StateName {
    /// Its hole holds a peg.
    Filled,
    /// It carries a marker.
    Marked,
    /// It sits in a hole.
    Inserted,
    /// It is switched on.
    On,
}

impl StateName {
    /// The state as observations number it.
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
    /// The space.
    pub of: Space,
    /// The distance from a prototype at which the match has fallen to zero.
    pub scale: Positive,
    /// The prototypes; the position in this list is the symbol.
    pub prototypes: Vec<Prototype>,
}

/// A space of features of an observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Space {
    /// How elongated, flat, round and tapered.
    Shape,
    /// Linear red, green and blue.
    Colour,
    /// The cube root of the volume of the thing's box, in metres.
    EdgeM,
}

impl Space {
    /// How many numbers a point of it has.
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
    /// What things like it are called.
    pub name: String,
    /// Where it lies: as many numbers as its space has dimensions.
    pub at: Vec<f64>,
}

/// A box of the perspective's frame; its sides may be infinitely far.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Least x, y and z, in metres.
    pub minimum_m: [f64; 3],
    /// Greatest x, y and z, in metres.
    pub maximum_m: [f64; 3],
}

impl Region {
    /// Whether the box holds a place; its sides belong to it.
    #[must_use]
    pub fn holds(&self, position_m: [f32; 3]) -> bool {
        let sides = self.minimum_m.iter().zip(&self.maximum_m);
        position_m.iter().zip(sides).all(|(at, (minimum, maximum))| {
            let at = f64::from(*at);
            *minimum <= at && at <= *maximum
        })
    }
}

/// The parameters of the Belief System: d, q, w and c of its tuple (B, G, M, d, q, w, c).
#[derive(Clone, Debug, PartialEq)]
pub struct Belief {
    /// Beliefs whose distance D is below it are of one thing.
    pub threshold: f64,
    /// Whether D is divided by the sum of the weights that apply.
    pub normalised: bool,
    /// Whether two beliefs that hold observations of one source and instant never merge.
    pub cannot_link_same_source_instant: bool,
    /// D of two beliefs to which no term applies.
    pub no_term_applies: NoTermApplies,
    /// The terms of D (Eq. 4).
    pub distance: Vec<Distance>,
    /// The culling functions, all of which must agree (Eq. 5).
    pub cull: Vec<Cull>,
}

/// The distance of two beliefs that no term can compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoTermApplies {
    /// They are never merged.
    Infinite,
    /// The empty sum, literally.
    Zero,
}

/// One term w·q·d of the belief distance (Eq. 4).
#[derive(Clone, Debug, PartialEq)]
pub struct Distance {
    /// The percept that it compares; it applies where both beliefs have it.
    pub percept: u16,
    /// How it compares.
    pub measure: Measure,
    /// w, not negative.
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
    /// A distance that the program supplies under this name.
    Own(String),
}

/// A culling function (Eq. 5).
#[derive(Clone, Debug, PartialEq)]
pub enum Cull {
    /// Nothing of it taken in for longer than this.
    UnseenLongerThan(Duration),
    /// The remembered confidence of a percept has fallen below a floor.
    ConfidenceBelow {
        /// The percept; a belief without it agrees.
        percept: u16,
        /// The floor.
        floor: f64,
    },
    /// Its place has been in view without a break for so long, of a source that saw it before, and it was not
    /// perceived there; a belief without a place disagrees.
    PlaceEmptyFor(Duration),
    /// A culling function that the program supplies under this name.
    Own(String),
}

impl Percepts {
    /// Reads and checks the file.
    ///
    /// # Errors
    ///
    /// As [`crate::load`]; also a name that is given twice or meant and not given, a history or
    /// measure that does not fit the percept's feature, and a range of a number that its parent does not
    /// derive.
    pub fn load(file: &Path) -> Result<Self, ConfigError> {
        let text = load::text(file)?;
        Self::parse(&text, file)
    }

    /// Checks the text of the file; `file` is what errors call it.
    ///
    /// # Errors
    ///
    /// As [`Self::load`].
    pub fn parse(text: &str, file: &Path) -> Result<Self, ConfigError> {
        crate::parse::<file::File>(text, file)?
            .resolve()
            .map_err(|(span, reason)| load::invalid(text, file, span, reason))
    }

    /// The percepts that Leo comes with: `config/percepts.toml` as it was compiled in.
    #[must_use]
    #[expect(clippy::expect_used, reason = "the text is compiled in, and a test parses it")]
    pub fn builtin() -> Self {
        Self::parse(BUILTIN, Path::new("config/percepts.toml")).expect("the built-in percepts are sound")
    }

    /// The number of the percept of that name.
    #[must_use]
    pub fn index(&self, name: &str) -> Option<u16> {
        let index = self.percepts.iter().position(|percept| percept.name == name)?;
        u16::try_from(index).ok()
    }

    /// The number of the percept that says where a thing is, if there is one.
    #[must_use]
    pub fn place(&self) -> Option<u16> {
        let index = self.percepts.iter().position(|percept| percept.kernel == Kernel::Position)?;
        u16::try_from(index).ok()
    }

    /// How far apart two sightings may be that are alike in everything else, and yet of one thing,
    /// in metres (Eq. 4); infinite where the distance of two beliefs asks for no place.
    #[must_use]
    pub fn same_place_m(&self) -> f64 {
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

    /// The percept of that number.
    #[must_use]
    pub fn get(&self, index: u16) -> Option<&Percept> {
        self.percepts.get(usize::from(index))
    }
}

impl Belief {
    /// Sets every switch to what the paper literally says, where the built-in setting departs from
    /// it; tells of each what it is now and what it was, for people.
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
    /// The names of its symbols, in the order of their numbers; none where it derives no symbol, or one that
    /// has no name.
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
            | Kernel::Own(_) => &[],
        };
        prototypes.iter().map(|prototype| prototype.name.as_str())
    }
}
