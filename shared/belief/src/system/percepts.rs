//! `percepts.toml`: the percepts, and how observations become beliefs.
//!
//! [`Percepts`] is the file with every name resolved and every reference checked, so its users need no further checks.
//! Equations are those of Berlin et al. 2006, "Belief Modeling".

mod file;
#[cfg(test)]
mod tests;

use std::time::Duration;

use perception::PerceptSet;
use perception::percepts::Definition;
use serde::Deserialize;

use crate::association::settings::MetricSettings;

pub use crate::association::settings::{Distance, Measure, NoTermApplies, Tracking};
pub use crate::storage::settings::{History, WhenFull};
pub use perception::percepts::{
    Component, Kernel, Nearest, Prototype, Range, Region, Space, StateName, is_inside,
};

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
    /// How positions are predicted for D; `None` compares the remembered positions, as in the paper.
    pub tracking: Option<Tracking>,
    /// What an unobserved thing moves with; `None` leaves it where it was, as in the paper.
    pub carrying: Option<Carrying>,
    /// The culling functions, all of which must agree (Eq. 5).
    pub cull: Vec<Cull>,
}

/// How a thing that is not observed moves with the hand that holds it, or with the thing that it is in or on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carrying {
    /// Largest distance between a thing and the hand of the agent that holds it, in metres.
    pub hand_reach_m: f64,
    /// Largest height between a thing and what it stands on, in metres.
    pub contact_m: f64,
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
    /// The number of the percept with that name.
    #[must_use]
    pub fn index(&self, name: &str) -> Option<u16> {
        let index = self.percepts.iter().position(|percept| percept.name == name)?;
        u16::try_from(index).ok()
    }

    /// The number of the position percept, if there is one.
    #[must_use]
    pub fn place(&self) -> Option<u16> {
        self.with_kernel(|kernel| *kernel == Kernel::Position).next()
    }

    /// The numbers of the percepts with such a kernel, in ascending order.
    pub fn with_kernel(&self, is_such: impl Fn(&Kernel) -> bool) -> impl Iterator<Item = u16> {
        let such = (0..).zip(&self.percepts).filter(move |(_, percept)| is_such(&percept.kernel));
        such.map(|(number, _)| number)
    }

    /// The numbers of the percepts that find the nearest prototype in a space, in ascending order.
    pub fn nearest_in(&self, space: Space) -> impl Iterator<Item = u16> {
        self.with_kernel(move |kernel| matches!(kernel, Kernel::Nearest(nearest) if nearest.space == space))
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
    /// The settings of the distance D.
    pub(crate) fn metric(&self) -> MetricSettings<'_> {
        let Self { threshold, normalised, no_term_applies, distance, .. } = self;
        MetricSettings {
            threshold: *threshold,
            normalised: *normalised,
            no_term_applies: *no_term_applies,
            distance,
        }
    }

    /// Sets every switch to the paper's literal form. Returns one line per switch with its new and its old value, for
    /// people.
    pub fn make_literal(&mut self) -> Vec<String> {
        let was = self.clone();
        self.cannot_link_same_source_instant = false;
        self.no_term_applies = NoTermApplies::Zero;
        self.normalised = false;
        self.tracking = None;
        self.carrying = None;
        let no_term = |setting| match setting {
            NoTermApplies::Infinite => "\"infinite\"",
            NoTermApplies::Zero => "\"zero\"",
        };
        let there = |is_there: bool| if is_there { "there" } else { "missing" };
        vec![
            format!("cannot_link_same_source_instant = false (was {})", was.cannot_link_same_source_instant),
            format!("no_term_applies = \"zero\" (was {})", no_term(was.no_term_applies)),
            format!("normalised = false (was {})", was.normalised),
            format!("no [belief.tracking] (was {})", there(was.tracking.is_some())),
            format!("no [belief.carrying] (was {})", there(was.carrying.is_some())),
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

impl<'a> From<&'a Percepts> for PerceptSet<'a> {
    fn from(percepts: &'a Percepts) -> Self {
        let define = |percept: &'a Percept| Definition {
            name: &percept.name,
            parent: percept.parent,
            kernel: &percept.kernel,
        };
        Self { threshold: percepts.threshold, percepts: percepts.percepts.iter().map(define).collect() }
    }
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
