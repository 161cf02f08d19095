//! Differences between the beliefs of two perspectives.

mod pairing;
#[cfg(test)]
mod tests;
mod thing;

use belief::percepts::{Kernel, Percept, Percepts, origin};
use invariant::invariant;
use message::{Belief, BeliefHead, Difference};

use pairing::{BeliefDistance, Pairing};
use thing::{ComparedPercepts, Thing};

/// The beliefs of a perspective at one instant, as its belief topic carries them.
#[derive(Clone, Copy, Debug)]
pub struct PerspectiveBeliefs<'a> {
    /// The head: agent and frame of the beliefs.
    pub head: &'a BeliefHead,
    /// The beliefs, in the order of their identities.
    pub beliefs: &'a [Belief],
}

/// Compares two perspectives belief by belief and percept by percept, at successive instants.
///
/// # Pairing
///
/// Identities are local to a belief system. So two beliefs are paired by one of two rules:
///
/// 1. *The same observation.* All that a partner perceives, the containing perspective perceives at the same
///    instant. Two beliefs form a pair if they were last perceived at one instant and D (Eq. 4), in the base
///    frame, is below the threshold. The pair is kept: if a thing is moved while the partner looks away, the
///    two beliefs differ in position.
/// 2. *Likeness.* A belief without such a pair is paired if D without positions is below the threshold. The
///    two must not have been observable together: one began after the other was last perceived, or both began
///    before the first comparison. Or both were perceived within 500 ms, and D with positions is below the
///    threshold too. The robot perceives a thing that it also touches later.
///
/// Pairs are one to one, the closest first: by D under the first rule, by distance and then D under the
/// second. Ties go to the lowest identities. A newer common observation replaces an older pair.
///
/// # Limits
///
/// Likeness can fail among equal things. If a red block is removed unseen and another is put down elsewhere,
/// the partner's belief in the first is paired with the second. A belief with a position is never paired by
/// observation with one without. Indexical percepts (regions, ranges of a position, plug-in percepts) are not
/// compared, because "left" depends on the frame. The holder of a thing is not compared.
///
/// Only 64 candidates to each side along one line are examined. In a denser pile a belief may stay unpaired
/// or be paired at a later instant.
///
/// # Cost
///
/// Allocates only in `new`. A kept pair costs one search by identity. A new pair costs a scan of at most 128
/// candidates, ordered by distance along one line, which ends when no closer one is possible. The cost of an
/// instant is linear in the number of things, whatever their arrangement.
#[derive(Clone, Debug)]
pub struct Divergence {
    aspects: ComparedPercepts,
    measure: BeliefDistance,
    pairing: Pairing,
    one: Vec<Thing>,
    other: Vec<Thing>,
    /// The pairs of the last instant, by identity.
    pairs: Vec<(u64, u64)>,
    /// The first compared instant.
    began_at_ns: Option<u64>,
    agreed: usize,
    differences: Vec<Difference>,
    capacity: usize,
}

impl Divergence {
    /// Returns a comparison without history. `capacity` is that of the two belief systems; beliefs beyond it
    /// are ignored.
    #[must_use]
    pub fn new(percepts: &Percepts, capacity: usize) -> Self {
        let aspects = ComparedPercepts::of(percepts);
        Self {
            measure: BeliefDistance::new(&percepts.belief, &aspects),
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

    /// Compares both sides at one instant and returns the differences. Those of the beliefs in `one` come
    /// first, in the order of identities; then the beliefs that only `other` has.
    pub fn compare(&mut self, one: PerspectiveBeliefs<'_>, other: PerspectiveBeliefs<'_>) -> &[Difference] {
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

    /// Number of things on which both sides agreed at the last compared instant.
    #[must_use]
    pub fn agreed(&self) -> usize {
        self.agreed
    }

    /// The pairs of beliefs in one thing at the last compared instant, by identity.
    #[must_use]
    pub fn pairs(&self) -> &[(u64, u64)] {
        &self.pairs
    }

    /// The differences at the last compared instant.
    #[must_use]
    pub fn differences(&self) -> &[Difference] {
        &self.differences
    }

    /// Keeps the pairs of the previous instant unless the beliefs contradict them.
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

    /// Lists the differences and stores the pairs.
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
                let fits = difference.get_or_insert_with(new).push(aspect);
                invariant!(fits, "a difference has a slot for each percept");
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

/// The kind of a percept that is frame-independent once it is in the base frame.
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
                // Lengths and states are the same in every frame.
                Kernel::Extents | Kernel::State(_) => Some(Self::Degree),
                Kernel::Position
                | Kernel::Orientation
                | Kernel::Source
                | Kernel::Nearest(_)
                | Kernel::Region(_)
                | Kernel::Range(_)
                | Kernel::Plugin(_) => None,
            },
            // The source of the last observation is no property of the thing.
            Kernel::Source | Kernel::Region(_) | Kernel::Plugin(_) => None,
        }
    }

    /// Two features within this tolerance count as equal.
    const fn tolerance(self) -> f64 {
        match self {
            // The learner uses the same distance to decide that a thing was moved.
            Self::Place => 0.03,
            // 15 degrees.
            Self::Orientation => 0.262,
            Self::Extents => 0.01,
            Self::Degree => 0.25,
            Self::Symbol => 0.5,
        }
    }
}
