//! Clustering, the loop of "Belief Modeling": while some pair has D < threshold, merge the pair of globally minimal D.
//! Ties are broken by the lowest identities. D is recomputed for every merged belief.

mod grouping;
mod matching;
mod naive;
mod neighbourhood;
mod population;
mod queue;
#[cfg(test)]
mod tests;

use grouping::Grouping;
use matching::Matching;
pub use naive::cluster as cluster_naively;
use neighbourhood::Neighbourhood;
pub(crate) use population::Places;
pub use population::{Population, Seen, Symbols};
use quantity::number::saturating_u32;
use queue::{Pair, Queue};

/// Prefetch distance, in members: the time to process this many covers the memory latency.
pub(crate) const AHEAD: usize = 4;

/// Agglomerative clustering that does not compare all pairs, with bit for bit the result of [the naive
/// loop](cluster_naively).
///
/// Each member chooses the nearest of the younger members within its gate, and a priority queue holds one choice of
/// each. A merge changes one member and removes another. The nearest neighbour of the changed member is searched at
/// once, so no choice is too late in the queue. A stale choice, of a changed or removed member, is detected at the head
/// of the queue and replaced. The cost is the number of members times that of the neighbours within the gate, times the
/// logarithm of the queue's length.
///
/// Two common cases need no queue. The first: no two new members can be linked, and neither can the old ones
/// ([`Population::is_companion`]). Then each new member searches only as far as needed to find the nearest old one. The
/// second: several frames come at once, and the things in each are farther apart than they moved. Then the detections
/// of each thing are merged as a separate group.
///
/// Only [`Clustering::new`] allocates.
#[derive(Clone, Debug)]
pub struct Clustering {
    neighbourhood: Neighbourhood,
    queue: Queue,
    matching: Matching,
    grouping: Grouping,
    /// Whether the new members are in the spatial hash.
    fresh_inserted: bool,
}

impl Clustering {
    /// For at most `slots` members. The positions ([`Population::place`]) of two members closer than the threshold are
    /// at most `reach_m` metres apart, the gate radius. With `None` there is no gate: every member is a neighbour of
    /// every other.
    #[must_use]
    pub fn new(slots: usize, reach_m: Option<f64>) -> Self {
        Self {
            neighbourhood: Neighbourhood::new(slots, reach_m),
            queue: Queue::new(slots),
            matching: Matching::new(slots),
            grouping: Grouping::new(slots),
            fresh_inserted: false,
        }
    }

    /// Adds a member that remains to the spatial hash, or updates its position there.
    pub fn place(&mut self, population: &impl Population, slot: u32) {
        self.neighbourhood.insert(population, slot);
    }

    /// Removes a member from the spatial hash.
    pub fn forget(&mut self, slot: u32) {
        self.neighbourhood.remove(slot);
    }

    /// Merges until no pair is closer than the threshold; returns the number of merges. All old members must be
    /// [placed](Self::place), and no new one.
    ///
    /// - `settled`: no two old members are closer than the threshold.
    /// - `fresh_apart`: no two new members can be linked, nor a new member with any that merged with another new one.
    pub fn run(&mut self, population: &mut impl Population, settled: bool, fresh_apart: bool) -> u64 {
        if settled
            && fresh_apart
            && let Some(merged) = self.run_matched(population)
        {
            return merged;
        }
        self.run_unmatched(population, settled, fresh_apart)
    }

    /// Like [`Self::run`], where no two old members are closer than the threshold and no two new ones can be linked.
    /// `None`, with nothing changed, if the result could differ from the loop's.
    pub(crate) fn run_matched(&mut self, population: &mut impl Population) -> Option<u64> {
        if !self.matching.find(&self.neighbourhood, population) {
            return None;
        }
        let mut merged = 0;
        let are_expected = population.are_expected();
        while let Some((old, fresh)) = self.matching.pair(merged) {
            for (ahead, soon) in [(2 * AHEAD, false), (AHEAD, true)] {
                if are_expected && let Some((old, fresh)) = self.matching.pair(merged + ahead) {
                    population.expect(old, fresh, soon);
                }
            }
            population.merge(old, fresh);
            self.neighbourhood.insert(population, old);
            merged += 1;
        }
        Some(u64::from(saturating_u32(merged)))
    }

    /// Like [`Self::run`], without the matching.
    pub(crate) fn run_unmatched(
        &mut self,
        population: &mut impl Population,
        settled: bool,
        fresh_apart: bool,
    ) -> u64 {
        if settled && !fresh_apart && self.grouping.find(&mut self.neighbourhood, population) {
            return self.grouping.merge(&mut self.neighbourhood, population);
        }
        self.fresh_inserted = false;
        // In that case the new members need no search among each other.
        if !(settled && fresh_apart) {
            self.insert_fresh(population);
        }
        let Self { neighbourhood, queue, .. } = self;
        let old = if settled { &[] } else { population.old() };
        for &slot in old.iter().chain(population.fresh()) {
            neighbourhood.each_near(population, slot, |other| {
                if let Some(pair) = pair(population, slot, other) {
                    queue.propose(pair);
                }
            });
        }
        queue.order();
        let mut merged = 0;
        while let Some(pair) = self.queue.first() {
            if population.version(pair.younger_slot) == pair.younger_version {
                self.merge(population, pair.older_slot, pair.younger_slot);
                merged += 1;
            } else {
                self.insert_fresh(population);
                self.choose(population, pair.older_slot);
            }
        }
        merged
    }

    fn merge(&mut self, population: &mut impl Population, kept: u32, gone: u32) {
        self.queue.set(gone, None);
        self.neighbourhood.remove(gone);
        population.merge(kept, gone);
        self.neighbourhood.insert(population, kept);
        let Self { neighbourhood, queue, .. } = self;
        let mut nearest: Option<Pair> = None;
        neighbourhood.each_near(population, kept, |other| {
            let Some(pair) = pair(population, kept, other) else { return };
            if pair.older_slot == kept {
                if nearest.is_none_or(|nearest| pair.is_before(&nearest)) {
                    nearest = Some(pair);
                }
            } else if queue.get(pair.older_slot).is_none_or(|chosen| pair.is_before(chosen)) {
                queue.set(pair.older_slot, Some(pair));
            }
        });
        queue.set(kept, nearest);
    }

    /// The member in the slot chooses the nearest younger one.
    fn choose(&mut self, population: &impl Population, slot: u32) {
        let mut nearest: Option<Pair> = None;
        self.neighbourhood.each_near(population, slot, |other| {
            if let Some(pair) = pair(population, slot, other)
                && pair.older_slot == slot
                && nearest.is_none_or(|nearest| pair.is_before(&nearest))
            {
                nearest = Some(pair);
            }
        });
        self.queue.set(slot, nearest);
    }

    fn insert_fresh(&mut self, population: &impl Population) {
        if !std::mem::replace(&mut self.fresh_inserted, true) {
            for &slot in population.fresh().iter().filter(|&&slot| population.lives(slot)) {
                self.neighbourhood.insert(population, slot);
            }
        }
    }
}

/// The pair of two members, ordered by identity; `None` if they are not below the threshold.
fn pair(population: &impl Population, a: u32, b: u32) -> Option<Pair> {
    let distance = population.distance(a, b)?;
    let (id_a, id_b) = (population.id(a), population.id(b));
    let (older, younger, older_slot, younger_slot) =
        if id_a < id_b { (id_a, id_b, a, b) } else { (id_b, id_a, b, a) };
    let younger_version = population.version(younger_slot);
    Some(Pair { distance, older, younger, older_slot, younger_slot, younger_version })
}
