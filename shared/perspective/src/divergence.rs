//! What one perspective believes and another does not.

mod pairing;
#[cfg(test)]
mod tests;
mod thing;

use config::percepts::{Kernel, Percept, Percepts, origin};
use message::{Belief, BeliefHead, Difference};

use pairing::{Measure, Pairing};
use thing::{Aspects, Thing};

/// The beliefs of a perspective at one instant, as its belief buffer holds them.
#[derive(Clone, Copy, Debug)]
pub struct Side<'a> {
    /// The head: whose beliefs, and in which frame.
    pub head: &'a BeliefHead,
    /// The beliefs, in the order of their identities.
    pub beliefs: &'a [Belief],
}

/// Compares two perspectives, belief by belief and percept by percept, instant after instant.
///
/// # Which beliefs are of one thing
///
/// Identities are each belief system's own, so two beliefs are paired by what they have in common:
///
/// 1. *The same observation.* Whatever a partner perceives, the perspective that contains his
///    perceives too, at the same instant. Two beliefs that were last perceived at one instant and
///    are closer than the configured threshold in D (Eq. 4), in the base frame, are of one thing.
///    The pair is remembered: when he looks away and the thing is moved, it is a pair still, and
///    the two differ about its place.
/// 2. *Likeness.* Where a belief has no pair by observation, it is paired with one that is closer
///    than the threshold in D without places, unless both could have been observed at once and
///    were not: one of the two must have begun after the other was last perceived, or both before
///    anything was compared. Where both were perceived within half a second, D with places decides: the robot
///    perceives what it also feels a little later than who only sees it.
///
/// Of several possible pairs the closest is taken first, one to one: by D, or of those that look
/// alike the nearest; among equal ones that of the lowest identities. A newer common observation
/// overrules an older pair.
///
/// # Limits
///
/// Among equal things the second rule may err: if a red block is taken away behind his back and
/// another put down elsewhere, his belief in the first is paired with the second. A belief that has a
/// place is never paired by observation with one that has none. Indexical percepts (regions, ranges of a
/// place, a program's own) are not compared: "left" is another question for each. Who holds a thing is not
/// compared.
///
/// Of a pile, more things than 64 to each side of it along one line, a belief may fail to be paired,
/// or be paired an instant later.
///
/// Allocates in `new` alone. A pair that goes on costs a search by identity. For a new one, things
/// are looked at in the order of their distance along one line, no more than 128 of the other
/// side, until none can be closer: what an instant costs grows as the number of things, whatever
/// they are and wherever they lie.
#[derive(Clone, Debug)]
pub struct Divergence {
    aspects: Aspects,
    measure: Measure,
    pairing: Pairing,
    one: Vec<Thing>,
    other: Vec<Thing>,
    /// The pairs that are remembered, by identity.
    pairs: Vec<(u64, u64)>,
    /// The first instant that was compared.
    began_at_ns: Option<u64>,
    agreed: usize,
    differences: Vec<Difference>,
    capacity: usize,
}

impl Divergence {
    /// Nothing compared yet. `capacity` is that of the two belief systems; beliefs beyond it are
    /// left out.
    #[must_use]
    pub fn new(percepts: &Percepts, capacity: usize) -> Self {
        let aspects = Aspects::of(percepts);
        Self {
            measure: Measure::new(&percepts.belief, &aspects),
            aspects,
            pairing: Pairing::new(capacity),
            one: Vec::with_capacity(capacity),
            other: Vec::with_capacity(capacity),
            pairs: Vec::with_capacity(capacity),
            began_at_ns: None,
            agreed: 0,
            differences: Vec::with_capacity(2 * capacity),
            capacity,
        }
    }

    /// Compares the two at an instant; gives the things about which they differ: first those that
    /// the one believes in, in the order of its identities, then those that only the other does.
    pub fn compare(&mut self, one: Side<'_>, other: Side<'_>) -> &[Difference] {
        let at_ns = one.head.header.valid_at_ns.min(other.head.header.valid_at_ns);
        let began_at_ns = *self.began_at_ns.get_or_insert(at_ns);
        for (things, side) in [(&mut self.one, one), (&mut self.other, other)] {
            let frame = side.head.frame();
            things.clear();
            things.extend(
                side.beliefs
                    .iter()
                    .take(self.capacity)
                    .map(|belief| Thing::new(belief, frame.as_ref(), &self.aspects)),
            );
        }
        self.recall();
        self.pairing.by_observation(&self.measure, &mut self.one, &mut self.other);
        self.pairing.by_likeness(&self.measure, began_at_ns, &mut self.one, &mut self.other);
        self.list();
        &self.differences
    }

    /// Things about which the two agreed at the last instant compared.
    #[must_use]
    pub fn agreed(&self) -> usize {
        self.agreed
    }

    /// The pairs of beliefs in one thing at the last instant compared, by identity.
    #[must_use]
    pub fn pairs(&self) -> &[(u64, u64)] {
        &self.pairs
    }

    /// The things about which the two differed at the last instant compared.
    #[must_use]
    pub fn differences(&self) -> &[Difference] {
        &self.differences
    }

    /// Takes over the pairs of the instant before, as far as nothing speaks against them.
    fn recall(&mut self) {
        for (one, other) in self.pairs.drain(..) {
            let find = |things: &[Thing], id: u64| things.binary_search_by_key(&id, |thing| thing.id).ok();
            let (Some(i), Some(j)) = (find(&self.one, one), find(&self.other, other)) else { continue };
            let (Some(one), Some(other)) = (self.one.get_mut(i), self.other.get_mut(j)) else { continue };
            let observed_at_once = one.perceived_at_ns == other.perceived_at_ns;
            if observed_at_once && self.measure.distance(one, other).is_none() {
                continue;
            }
            (one.pair, other.pair) = (Some(j), Some(i));
            (one.is_sure, other.is_sure) = (observed_at_once, observed_at_once);
        }
    }

    /// Lists what differs and remembers the pairs.
    fn list(&mut self) {
        self.agreed = 0;
        self.differences.clear();
        for one in &self.one {
            let Some(other) = one.pair.and_then(|index| self.other.get(index)) else {
                self.differences.push(Difference::new(Some(one.id), None));
                continue;
            };
            self.pairs.push((one.id, other.id));
            let mut difference = None;
            self.aspects.compare(one, other, |aspect| {
                let new = || Difference::new(Some(one.id), Some(other.id));
                // There is room for each percept once.
                let _fits = difference.get_or_insert_with(new).push(aspect);
            });
            match difference {
                None => self.agreed += 1,
                Some(difference) => self.differences.push(difference),
            }
        }
        let alone = self.other.iter().filter(|other| other.pair.is_none());
        self.differences.extend(alone.map(|other| Difference::new(None, Some(other.id))));
    }
}

/// A percept that means the same to everybody, once it is in the base frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Meaning {
    Place,
    Orientation,
    Extents,
    Degree,
    Symbol,
}

impl Meaning {
    fn of(percepts: &Percepts, percept: &Percept) -> Option<Self> {
        match &percept.kernel {
            Kernel::Position => Some(Self::Place),
            Kernel::Orientation => Some(Self::Orientation),
            Kernel::Extents => Some(Self::Extents),
            Kernel::State(_) => Some(Self::Degree),
            Kernel::Nearest(_) => Some(Self::Symbol),
            Kernel::Range(_) => match origin(&percepts.percepts, percept).kernel {
                // How long a thing is, is as long for everybody.
                Kernel::Extents | Kernel::State(_) => Some(Self::Degree),
                Kernel::Position
                | Kernel::Orientation
                | Kernel::Source
                | Kernel::Nearest(_)
                | Kernel::Region(_)
                | Kernel::Range(_)
                | Kernel::Own(_) => None,
            },
            // Who saw it last is no belief about the thing.
            Kernel::Source | Kernel::Region(_) | Kernel::Own(_) => None,
        }
    }

    /// Two features that are no further apart than this are the same belief.
    const fn tolerance(self) -> f64 {
        match self {
            // What is nearer was not moved: the learner takes the same distance.
            Self::Place => 0.03,
            // 15 degrees.
            Self::Orientation => 0.262,
            Self::Extents => 0.01,
            Self::Degree => 0.25,
            Self::Symbol => 0.5,
        }
    }
}
