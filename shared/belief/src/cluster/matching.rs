use std::cmp::Ordering;

use super::neighbourhood::Neighbourhood;
use super::{Population, Seen};
use crate::room::Room;

/// One-to-one assignment of detections (new members) to tracks (old members), valid if no two tracks come within each
/// other's gate.
///
/// In that case the loop that always merges the nearest pair is a stable matching of two sides whose preferences follow
/// one order of the pairs. The stable matching is unique and does not depend on the order of proposals (Gale and
/// Shapley 1962, "College Admissions and the Stability of Marriage"). So no priority queue is needed: each detection
/// proposes to the nearest track, and a track keeps the nearest proposal.
#[derive(Clone, Debug)]
pub(super) struct Matching {
    /// Indexed by the slot of the track: its matched detection, of this round or an earlier one.
    kept: Box<[Asker]>,
    /// Number of the current matching.
    round: u32,
    /// The tracks that have a match.
    askers: Room<u32>,
    /// Unmatched detections that still have to propose to the nearest track that accepts them.
    waiting: Room<u32>,
    /// Tracks that were not detected in the previous frame, so no cannot-link between them is known in advance.
    strangers: Room<u32>,
}

/// A detection that proposed in a round.
#[derive(Clone, Copy, Debug)]
struct Asker {
    distance: f64,
    slot: u32,
    round: u32,
}

/// No proposal: no round has this number.
const NOBODY: Asker = Asker { distance: 0.0, slot: u32::MAX, round: 0 };

impl Asker {
    fn is_before(&self, other: &Self, population: &impl Population) -> bool {
        is_nearer((self.distance, self.slot), (other.distance, other.slot), population)
    }
}

/// Whether `a` precedes `b`: smaller distance first, then lower identity.
#[inline]
fn is_nearer(a: (f64, u32), b: (f64, u32), population: &impl Population) -> bool {
    match a.0.total_cmp(&b.0) {
        Ordering::Less => true,
        Ordering::Greater => false,
        Ordering::Equal => population.id(a.1) < population.id(b.1),
    }
}

/// A candidate track of a detection, with its distance.
#[derive(Clone, Copy)]
pub(super) struct Asked {
    pub(super) slot: u32,
    pub(super) distance: f64,
}

impl Asked {
    /// Smaller distance first, then the older track.
    fn is_before(&self, other: &Self, population: &impl Population) -> bool {
        is_nearer((self.distance, self.slot), (other.distance, other.slot), population)
    }
}

impl Matching {
    pub(super) fn new(slots: usize) -> Self {
        Self {
            kept: vec![NOBODY; slots].into_boxed_slice(),
            round: 0,
            askers: Room::for_most(slots),
            waiting: Room::for_most(slots),
            strangers: Room::for_most(slots),
        }
    }

    /// Matches the detections with the tracks; only the tracks are in the spatial hash. Returns `false` if the result
    /// could differ from the loop's.
    pub(super) fn find(&mut self, neighbourhood: &Neighbourhood, population: &impl Population) -> bool {
        self.begin();
        if !neighbourhood.is_of_places() {
            return false;
        }
        for &slot in population.fresh() {
            let Some(place) = population.place(slot) else { return false };
            let left = match nearest(neighbourhood, population, slot, place) {
                Some(asked) => self.ask(population, slot, asked),
                None => Some(slot),
            };
            self.waiting.extend(left);
        }
        while let Some(slot) = self.waiting.pop() {
            if let Some(asked) = self.would_have(neighbourhood, population, slot) {
                let left = self.ask(population, slot, asked);
                self.waiting.extend(left);
            }
        }
        self.holds(neighbourhood, population)
    }

    /// Starts a round without matches.
    fn begin(&mut self) {
        self.askers.clear();
        self.waiting.clear();
        self.round = self.round.wrapping_add(1);
        if self.round == NOBODY.round {
            // The round counter wrapped around, and entries of old rounds are still in the table.
            self.kept.fill(NOBODY);
            self.round += 1;
        }
    }

    /// The match of a track in this round.
    fn kept_by(&self, slot: u32) -> Option<&Asker> {
        self.kept.get(slot as usize).filter(|kept| kept.round == self.round)
    }

    /// Pair `index` of the matching: the track and the detection.
    #[inline]
    pub(super) fn pair(&self, index: usize) -> Option<(u32, u32)> {
        let &slot = self.askers.get(index)?;
        Some((slot, self.kept.get(slot as usize)?.slot))
    }

    /// A detection proposes to a track. Returns the detection that is rejected, if any.
    fn ask(&mut self, population: &impl Population, slot: u32, asked: Asked) -> Option<u32> {
        let kept = self.kept.get_mut(asked.slot as usize)?;
        let asker = Asker { slot, distance: asked.distance, round: self.round };
        if kept.round != self.round {
            *kept = asker;
            self.askers.push(asked.slot);
            None
        } else if asker.is_before(kept, population) {
            Some(std::mem::replace(kept, asker).slot)
        } else {
            Some(slot)
        }
    }

    /// The nearest track that would accept a proposal of the detection.
    fn would_have(
        &self,
        neighbourhood: &Neighbourhood,
        population: &impl Population,
        slot: u32,
    ) -> Option<Asked> {
        let mut nearest: Option<Asked> = None;
        neighbourhood.each_near(population, slot, |other| {
            let Some(distance) = population.distance(other, slot) else { return };
            let (asked, asker) =
                (Asked { slot: other, distance }, Asker { slot, distance, round: self.round });
            if self.kept_by(other).is_none_or(|kept| asker.is_before(kept, population))
                && nearest.is_none_or(|nearest| asked.is_before(&nearest, population))
            {
                nearest = Some(asked);
            }
        });
        nearest
    }

    /// Whether these pairs are all that the loop would merge: no changed track comes within the gate of another one.
    ///
    /// Before the loop's first merge of two tracks, each has merged with at most one detection, its match. So each has
    /// moved by no more than the distance of that match.
    fn holds(&mut self, neighbourhood: &Neighbourhood, population: &impl Population) -> bool {
        let mut farthest = 0.0_f64;
        for (old, fresh) in (0..self.askers.len()).filter_map(|index| self.pair(index)) {
            if !population.takes_in(old, fresh) {
                return false;
            }
            farthest = farthest.max(self.kept_by(old).map_or(0.0, |asker| asker.distance));
        }
        if self.askers.is_empty() {
            return true;
        }
        // One more than the number of matched tracks suffices for the comparison below.
        let strangers = population.old().iter().copied().filter(|&slot| !population.is_companion(slot));
        self.strangers.clear();
        self.strangers.extend(strangers.take(self.askers.len() + 1));
        let moved_m = population.reach_m(farthest);
        let keeps = |slot: u32| self.kept_by(slot).is_some();
        let meets = |slot: u32, is_companion: bool| {
            neighbourhood.any_within(slot, neighbourhood.reach_m() + 2.0 * moved_m, |other| {
                (keeps(slot) || keeps(other))
                    && !(is_companion && population.is_companion(other))
                    && !population.stay_apart(slot, other)
            })
        };
        // A violating pair contains one unconstrained and one matched track; scan from the smaller of the two sets.
        if self.strangers.len() <= self.askers.len() {
            !self.strangers.iter().any(|&slot| meets(slot, false))
        } else {
            !self.askers.iter().any(|&slot| meets(slot, population.is_companion(slot)))
        }
    }
}

/// The nearest track, if it is closer than the radius that the local search covered completely.
pub(super) fn nearest(
    neighbourhood: &Neighbourhood,
    population: &impl Population,
    slot: u32,
    place: [f32; 3],
) -> Option<Asked> {
    let mut nearest: Option<Asked> = None;
    let from = Seen { place_m: place, symbols: population.symbols(slot) };
    let looked_m = neighbourhood.each_close(&from, |other, seen| {
        let asked = Asked { slot: other, distance: population.distance_seen((other, seen), (slot, &from))? };
        if nearest.is_some_and(|nearest| !asked.is_before(&nearest, population)) {
            return None;
        }
        nearest = Some(asked);
        Some(population.reach_m(asked.distance))
    });
    nearest.filter(|nearest| population.reach_m(nearest.distance) < looked_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_in_a_round_is_forgotten_in_the_next_and_when_its_number_comes_again() {
        let mut matching = Matching::new(2);
        let keep = |matching: &mut Matching| {
            matching.kept[1] = Asker { distance: 0.0, slot: 0, round: matching.round };
            assert!(matching.kept_by(1).is_some() && matching.kept_by(0).is_none());
        };
        matching.begin();
        keep(&mut matching);
        let first = matching.round;
        matching.begin();
        assert!(matching.kept_by(1).is_none());
        matching.round = first;
        assert!(matching.kept_by(1).is_some(), "it lies there still");
        // The counter wraps around.
        matching.round = u32::MAX;
        matching.begin();
        assert_eq!(matching.round, first);
        assert!(matching.kept_by(1).is_none());
        keep(&mut matching);
    }
}
