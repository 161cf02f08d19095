//! Clustering: the loop of "Belief Modeling", while some pair has D < threshold, merge the pair of
//! globally minimal D. Of equally near pairs that of the lowest identities comes first; D is
//! computed anew on every merged belief.

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

/// What is known of a belief is fetched while those before it take something in: so many, that it has come by then.
pub(crate) const AHEAD: usize = 4;

/// Finds the pairs to merge without looking at all pairs: with bit for bit the outcome of
/// [the naive loop](cluster_naively).
///
/// Each belief chooses the nearest of the younger beliefs within its reach, and a queue holds one
/// choice of each. A merge changes one belief and ends another. What the changed one is now
/// nearest to is found at once, so no choice is ever too late in the queue; a choice that fell on
/// what has changed or ended is found out when it comes first, and made anew. So the cost grows
/// with the number of beliefs times that of the neighbours each has within reach, and the
/// logarithm of the queue.
///
/// What comes nearly every time costs less: where the fresh members are apart, and the old ones
/// stay so ([`Population::is_companion`]), each fresh member looks no further than it must to find the
/// nearest old one, and there is no queue. Nor is there where several frames come at once of which each
/// shows things further apart than each has moved: what all of them show of one thing is merged by itself.
///
/// Allocates in [`Clustering::new`] alone.
#[derive(Clone, Debug)]
pub struct Clustering {
    neighbourhood: Neighbourhood,
    queue: Queue,
    matching: Matching,
    grouping: Grouping,
    /// Whether the fresh members are in the neighbourhood.
    fresh_inserted: bool,
}

impl Clustering {
    /// For a population of at most `slots` members, whose [places](Population::place) are no
    /// further apart than `reach_m` metres where their distance is below the threshold; without a
    /// reach, everybody is near everybody.
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

    /// The member in the slot stays, and is where its place says.
    pub fn place(&mut self, population: &impl Population, slot: u32) {
        self.neighbourhood.insert(population, slot);
    }

    /// The member in the slot is no more.
    pub fn forget(&mut self, slot: u32) {
        self.neighbourhood.remove(slot);
    }

    /// Merges until no pair is closer than the threshold; how many were merged. The old members
    /// are all [placed](Self::place), the fresh ones none.
    ///
    /// `settled` says that no two of the old members are closer than the threshold. `fresh_apart`
    /// says that no two of the fresh members are ever merged, nor any with what took another in.
    pub fn run(&mut self, population: &mut impl Population, settled: bool, fresh_apart: bool) -> u64 {
        if settled
            && fresh_apart
            && let Some(merged) = self.run_matched(population)
        {
            return merged;
        }
        self.run_unmatched(population, settled, fresh_apart)
    }

    /// [`Self::run`] where the old members are settled and the fresh ones apart; `None`, and nothing done, where it
    /// takes the loop.
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

    /// [`Self::run`] for all that are not matched.
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
        // Then the fresh members need not find one another.
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

/// The pair of two members, if they are near enough, in the order of their identities.
fn pair(population: &impl Population, a: u32, b: u32) -> Option<Pair> {
    let distance = population.distance(a, b)?;
    let (id_a, id_b) = (population.id(a), population.id(b));
    let (older, younger, older_slot, younger_slot) =
        if id_a < id_b { (id_a, id_b, a, b) } else { (id_b, id_a, b, a) };
    let younger_version = population.version(younger_slot);
    Some(Pair { distance, older, younger, older_slot, younger_slot, younger_version })
}
