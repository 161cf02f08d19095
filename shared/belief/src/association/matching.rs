use invariant::require;
use std::cmp::Ordering;

use super::problem::{AssociationProblem, MemberSummary};
use super::spatial_hash::SpatialHash;

/// One-to-one assignment of detections (new members) to tracks (old members), valid if no two tracks come within each
/// other's gate.
///
/// The reference is greedy agglomerative clustering, which always merges the nearest pair. Here both sides rank their
/// partners by the same distance, so its result is a stable matching. That matching is unique, and does not depend on
/// the order of proposals (Gale and Shapley 1962, "College Admissions and the Stability of Marriage"). So no priority
/// queue is needed: each detection proposes to the nearest track, and a track keeps the nearest proposal.
#[derive(Debug)]
pub(super) struct Matching {
    /// Indexed by the slot of the track: its nearest proposal. Those of earlier generations are stale.
    matched: Box<[Proposal]>,
    /// Number of the current matching.
    generation: u32,
    /// The tracks that have a match.
    matched_tracks: Vec<u32>,
    /// Unmatched detections that still have to propose to the nearest track that accepts them.
    unmatched: Vec<u32>,
    /// Tracks that were not detected in the previous frame, so no cannot-link between them is known in advance.
    unconstrained: Vec<u32>,
}

/// A detection that proposed in a round.
#[derive(Clone, Copy, Debug)]
struct Proposal {
    distance: f64,
    slot: u32,
    generation: u32,
}

/// No proposal: no round has this number.
const NO_PROPOSAL: Proposal = Proposal { distance: 0.0, slot: u32::MAX, generation: 0 };

impl Proposal {
    fn is_before(&self, other: &Self, problem: &impl AssociationProblem) -> bool {
        is_nearer((self.distance, self.slot), (other.distance, other.slot), problem)
    }
}

/// Whether `a` precedes `b`: smaller distance first, then lower identity.
#[inline]
fn is_nearer(a: (f64, u32), b: (f64, u32), problem: &impl AssociationProblem) -> bool {
    match a.0.total_cmp(&b.0) {
        Ordering::Less => true,
        Ordering::Greater => false,
        Ordering::Equal => problem.id(a.1) < problem.id(b.1),
    }
}

/// A candidate track of a detection, with its distance.
#[derive(Clone, Copy)]
pub(super) struct Candidate {
    pub(super) slot: u32,
    pub(super) distance: f64,
}

impl Candidate {
    /// Smaller distance first, then the older track.
    fn is_before(&self, other: &Self, problem: &impl AssociationProblem) -> bool {
        is_nearer((self.distance, self.slot), (other.distance, other.slot), problem)
    }
}

impl Matching {
    pub(super) fn new(slots: usize) -> Self {
        Self {
            matched: vec![NO_PROPOSAL; slots].into_boxed_slice(),
            generation: 0,
            matched_tracks: Vec::with_capacity(slots),
            unmatched: Vec::with_capacity(slots),
            unconstrained: Vec::with_capacity(slots),
        }
    }

    /// Matches the detections with the tracks; only the tracks are in the spatial hash. Returns `false` if the result
    /// could differ from that of greedy clustering.
    pub(super) fn find(&mut self, spatial_hash: &SpatialHash, problem: &impl AssociationProblem) -> bool {
        self.begin();
        if !spatial_hash.is_spatial() {
            return false;
        }
        for &slot in problem.fresh() {
            let Some(place) = problem.place(slot) else { return false };
            let left = match nearest(spatial_hash, problem, slot, place) {
                Some(candidate) => self.propose(problem, slot, candidate),
                None => Some(slot),
            };
            self.unmatched.extend(left);
        }
        while let Some(slot) = self.unmatched.pop() {
            if let Some(candidate) = self.nearest_accepting(spatial_hash, problem, slot) {
                let left = self.propose(problem, slot, candidate);
                self.unmatched.extend(left);
            }
        }
        self.matches_greedy_clustering(spatial_hash, problem)
    }

    /// Starts a round without matches.
    fn begin(&mut self) {
        self.matched_tracks.clear();
        self.unmatched.clear();
        self.generation = self.generation.wrapping_add(1);
        if self.generation == NO_PROPOSAL.generation {
            // The round counter wrapped around, and entries of old rounds are still in the table.
            self.matched.fill(NO_PROPOSAL);
            self.generation += 1;
        }
    }

    /// The match of a track in this round.
    fn match_of(&self, slot: u32) -> Option<&Proposal> {
        self.matched.get(slot as usize).filter(|matched| matched.generation == self.generation)
    }

    /// Pair `index` of the matching, if there are so many: the track and the detection.
    #[inline]
    pub(super) fn pair(&self, index: usize) -> Option<(u32, u32)> {
        let &slot = self.matched_tracks.get(index)?;
        Some((slot, require!(self.matched.get(slot as usize), "slot {slot} exists")?.slot))
    }

    /// A detection proposes to a track. Returns the detection that is rejected, if any.
    fn propose(&mut self, problem: &impl AssociationProblem, slot: u32, candidate: Candidate) -> Option<u32> {
        let matched = self.matched.get_mut(candidate.slot as usize);
        let matched = require!(matched, "slot {} exists", candidate.slot)?;
        let proposal = Proposal { slot, distance: candidate.distance, generation: self.generation };
        if matched.generation != self.generation {
            *matched = proposal;
            self.matched_tracks.push(candidate.slot);
            None
        } else if proposal.is_before(matched, problem) {
            Some(std::mem::replace(matched, proposal).slot)
        } else {
            Some(slot)
        }
    }

    /// The nearest track that would accept a proposal of the detection.
    fn nearest_accepting(
        &self,
        spatial_hash: &SpatialHash,
        problem: &impl AssociationProblem,
        slot: u32,
    ) -> Option<Candidate> {
        let mut nearest: Option<Candidate> = None;
        spatial_hash.for_each_neighbour(problem, slot, |other| {
            let Some(distance) = problem.distance(other, slot) else { return };
            let (candidate, proposal) = (
                Candidate { slot: other, distance },
                Proposal { slot, distance, generation: self.generation },
            );
            if self.match_of(other).is_none_or(|matched| proposal.is_before(matched, problem))
                && nearest.is_none_or(|nearest| candidate.is_before(&nearest, problem))
            {
                nearest = Some(candidate);
            }
        });
        nearest
    }

    /// Whether greedy clustering would merge exactly these pairs: no changed track comes within the gate of another.
    ///
    /// Before it first merges two tracks, each has merged with at most one detection, its match. So each has moved by
    /// no more than the distance of that match.
    fn matches_greedy_clustering(
        &mut self,
        spatial_hash: &SpatialHash,
        problem: &impl AssociationProblem,
    ) -> bool {
        let mut farthest = 0.0_f64;
        for (old, fresh) in (0..self.matched_tracks.len()).filter_map(|index| self.pair(index)) {
            if !problem.is_convex_merge(old, fresh) {
                return false;
            }
            farthest = farthest.max(self.match_of(old).map_or(0.0, |proposal| proposal.distance));
        }
        if self.matched_tracks.is_empty() {
            return true;
        }
        // Only which of the two sets is smaller matters below, so the count stops there.
        let unconstrained = problem.old().iter().copied().filter(|&slot| !problem.co_detected(slot));
        self.unconstrained.clear();
        self.unconstrained.extend(unconstrained.take(self.matched_tracks.len() + 1));
        let moved_m = problem.gate_radius_m(farthest);
        let is_matched = |slot: u32| self.match_of(slot).is_some();
        let has_conflict = |slot: u32, co_detected: bool| {
            spatial_hash.any_within(slot, spatial_hash.gate_radius_m() + 2.0 * moved_m, |other| {
                (is_matched(slot) || is_matched(other))
                    && !(co_detected && problem.co_detected(other))
                    && !problem.remains_cannot_link(slot, other)
            })
        };
        // Tracks that one frame detected cannot be linked. So a pair that could merge contains an unconstrained track,
        // and a matched one. The scan starts from the smaller of the two sets.
        if self.unconstrained.len() <= self.matched_tracks.len() {
            !self.unconstrained.iter().any(|&slot| has_conflict(slot, false))
        } else {
            !self.matched_tracks.iter().any(|&slot| has_conflict(slot, problem.co_detected(slot)))
        }
    }
}

/// The nearest track; `None` if a nearer one could lie outside the cells that were searched.
pub(super) fn nearest(
    spatial_hash: &SpatialHash,
    problem: &impl AssociationProblem,
    slot: u32,
    place: [f32; 3],
) -> Option<Candidate> {
    let mut nearest: Option<Candidate> = None;
    let from = MemberSummary { place_m: place, gate_keys: problem.gate_keys(slot) };
    let searched_m = spatial_hash.for_each_in_nearest_cells(&from, |other, seen| {
        let candidate =
            Candidate { slot: other, distance: problem.gated_distance((other, seen), (slot, &from))? };
        if nearest.is_some_and(|nearest| !candidate.is_before(&nearest, problem)) {
            return None;
        }
        nearest = Some(candidate);
        Some(problem.gate_radius_m(candidate.distance))
    });
    nearest.filter(|nearest| problem.gate_radius_m(nearest.distance) < searched_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_of_an_association_round_are_cleared_in_the_next() {
        let mut matching = Matching::new(2);
        let keep = |matching: &mut Matching| {
            matching.matched[1] = Proposal { distance: 0.0, slot: 0, generation: matching.generation };
            assert!(matching.match_of(1).is_some() && matching.match_of(0).is_none());
        };
        matching.begin();
        keep(&mut matching);
        let first = matching.generation;
        matching.begin();
        assert!(matching.match_of(1).is_none());
        matching.generation = first;
        assert!(matching.match_of(1).is_some(), "it lies there still");
        // The counter wraps around.
        matching.generation = u32::MAX;
        matching.begin();
        assert_eq!(matching.generation, first);
        assert!(matching.match_of(1).is_none());
        keep(&mut matching);
    }
}
