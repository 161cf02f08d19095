//! Clustering, the loop of "Belief Modeling": while some pair has D < threshold, merge the pair of globally minimal D.
//! Ties are broken by the lowest identities. D is recomputed for every merged belief.

#[cfg(test)]
mod tests;

use super::grouping::Grouping;
use super::matching::Matching;
use super::pair::Pair;
use super::problem::AssociationProblem;
use super::queue::Queue;
use super::spatial_hash::SpatialHash;
use quantity::number::saturating_u32;

/// Prefetch distance, in members: the time to process this many covers the memory latency.
pub(crate) const PREFETCH_DISTANCE: usize = 4;

/// Agglomerative clustering that does not compare all pairs, with bit for bit the result of [the naive
/// loop](crate::cluster_naively).
///
/// Each member chooses the nearest of the younger members within its gate, and a priority queue holds one choice of
/// each. A merge changes one member and removes another. The nearest neighbour of the changed member is searched at
/// once, so no choice is too late in the queue. A stale choice, of a changed or removed member, is detected at the head
/// of the queue and replaced. The cost is the number of members times that of the neighbours within the gate, times the
/// logarithm of the queue's length.
///
/// Two common cases need no queue. The first: no two new members can be linked, and neither can the old ones
/// ([`AssociationProblem::co_detected`]). Then each new member searches only as far as needed to find the nearest old
/// one. The second: several frames come at once, and the things in each are farther apart than they moved. Then the
/// detections of each thing are merged as a separate group.
///
/// Only [`Clustering::new`] and a clone allocate.
#[derive(Debug)]
pub struct Clustering {
    spatial_hash: SpatialHash,
    queue: Queue,
    matching: Matching,
    grouping: Grouping,
    /// Whether the new members are in the spatial hash.
    fresh_inserted: bool,
}

/// A clone has the same members. The rest is the memory of one run; a clone gets its own, of the same capacity.
impl Clone for Clustering {
    fn clone(&self) -> Self {
        Self::with_members(self.spatial_hash.clone())
    }
}

impl Clustering {
    /// For at most `slots` members. The positions ([`AssociationProblem::place`]) of two members closer than the
    /// threshold are at most `gate_radius_m` metres apart, the gate radius. With `None` there is no gate: every member
    /// is a neighbour of every other.
    #[must_use]
    pub fn new(slots: usize, gate_radius_m: Option<f64>) -> Self {
        Self::with_members(SpatialHash::new(slots, gate_radius_m))
    }

    fn with_members(spatial_hash: SpatialHash) -> Self {
        let slots = spatial_hash.slots();
        Self {
            spatial_hash,
            queue: Queue::new(slots),
            matching: Matching::new(slots),
            grouping: Grouping::new(slots),
            fresh_inserted: false,
        }
    }

    /// Adds a member that remains to the spatial hash, or updates its position there.
    pub fn place(&mut self, problem: &impl AssociationProblem, slot: u32) {
        self.spatial_hash.insert(problem, slot);
    }

    /// Removes a member from the spatial hash.
    pub fn remove_member(&mut self, slot: u32) {
        self.spatial_hash.remove(slot);
    }

    /// Visits every other member that may be within the gate radius of the one in `slot`, which must be
    /// [placed](Self::place), and has no mismatching gate key.
    pub(crate) fn for_each_within_gate(&self, slot: u32, mut visit: impl FnMut(u32)) {
        self.spatial_hash.any_within(slot, self.spatial_hash.gate_radius_m(), |other| {
            visit(other);
            false
        });
    }

    /// Merges until no pair is closer than the threshold; returns the number of merges. All old members must be
    /// [placed](Self::place), and no new one.
    ///
    /// - `is_clustered`: no two old members are closer than the threshold.
    /// - `detections_cannot_link`: no two new members can be linked, nor a new member with any that merged with another
    ///   new one.
    pub fn run(
        &mut self,
        problem: &mut impl AssociationProblem,
        is_clustered: bool,
        detections_cannot_link: bool,
    ) -> u64 {
        if is_clustered
            && detections_cannot_link
            && let Some(merged) = self.run_matched(problem)
        {
            return merged;
        }
        self.run_unmatched(problem, is_clustered, detections_cannot_link)
    }

    /// Like [`Self::run`], where no two old members are closer than the threshold and no two new ones can be linked.
    /// `None`, with nothing changed, if the result could differ from the loop's.
    pub(crate) fn run_matched(&mut self, problem: &mut impl AssociationProblem) -> Option<u64> {
        if !self.matching.find(&self.spatial_hash, problem) {
            return None;
        }
        let mut merged = 0;
        let wants_prefetch = problem.wants_prefetch();
        while let Some((old, fresh)) = self.matching.pair(merged) {
            for (ahead, soon) in [(2 * PREFETCH_DISTANCE, false), (PREFETCH_DISTANCE, true)] {
                if wants_prefetch && let Some((old, fresh)) = self.matching.pair(merged + ahead) {
                    problem.expect(old, fresh, soon);
                }
            }
            problem.merge(old, fresh);
            self.spatial_hash.insert(problem, old);
            merged += 1;
        }
        Some(u64::from(saturating_u32(merged)))
    }

    /// Like [`Self::run`], without the matching.
    pub(crate) fn run_unmatched(
        &mut self,
        problem: &mut impl AssociationProblem,
        is_clustered: bool,
        detections_cannot_link: bool,
    ) -> u64 {
        if is_clustered && !detections_cannot_link && self.grouping.find(&mut self.spatial_hash, problem) {
            return self.grouping.merge(&mut self.spatial_hash, problem);
        }
        self.fresh_inserted = false;
        // In that case the new members need no search among each other.
        if !(is_clustered && detections_cannot_link) {
            self.insert_fresh(problem);
        }
        let Self { spatial_hash, queue, .. } = self;
        let old = if is_clustered { &[] } else { problem.old() };
        for &slot in old.iter().chain(problem.fresh()) {
            spatial_hash.for_each_neighbour(problem, slot, |other| {
                if let Some(pair) = Pair::of(problem, slot, other) {
                    queue.propose(pair);
                }
            });
        }
        queue.heapify();
        let mut merged = 0;
        while let Some(pair) = self.queue.first() {
            if problem.version(pair.younger_slot) == pair.younger_version {
                self.merge(problem, pair.older_slot, pair.younger_slot);
                merged += 1;
            } else {
                self.insert_fresh(problem);
                self.choose(problem, pair.older_slot);
            }
        }
        merged
    }

    fn merge(&mut self, problem: &mut impl AssociationProblem, kept: u32, gone: u32) {
        self.queue.set(gone, None);
        self.spatial_hash.remove(gone);
        problem.merge(kept, gone);
        self.spatial_hash.insert(problem, kept);
        let Self { spatial_hash, queue, .. } = self;
        let mut nearest: Option<Pair> = None;
        spatial_hash.for_each_neighbour(problem, kept, |other| {
            let Some(pair) = Pair::of(problem, kept, other) else { return };
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
    fn choose(&mut self, problem: &impl AssociationProblem, slot: u32) {
        let mut nearest: Option<Pair> = None;
        self.spatial_hash.for_each_neighbour(problem, slot, |other| {
            if let Some(pair) = Pair::of(problem, slot, other)
                && pair.older_slot == slot
                && nearest.is_none_or(|nearest| pair.is_before(&nearest))
            {
                nearest = Some(pair);
            }
        });
        self.queue.set(slot, nearest);
    }

    fn insert_fresh(&mut self, problem: &impl AssociationProblem) {
        if !std::mem::replace(&mut self.fresh_inserted, true) {
            for &slot in problem.fresh().iter().filter(|&&slot| problem.is_live(slot)) {
                self.spatial_hash.insert(problem, slot);
            }
        }
    }
}
