//! Clustering: the loop of "Belief Modeling", while some pair has D < threshold, merge the pair of
//! globally minimal D. Of equally near pairs that of the lowest identities comes first; D is
//! computed anew on every merged belief.

#[cfg(test)]
mod naive;
mod neighbourhood;
#[cfg(test)]
mod tests;
mod tournament;

use neighbourhood::Neighbourhood;
use tournament::{Pair, Tournament};

use crate::arena::Arena;

/// Finds the pairs to merge without looking at all pairs: with bit for bit the outcome of the
/// naive loop.
///
/// Each belief keeps the nearest of the younger beliefs within reach, in the sense of the
/// position term alone, and a tournament over the beliefs keeps the nearest pair of all. A merge
/// changes one belief and ends another, so only those that had chosen one of the two, and the
/// merged one's new neighbours, choose anew.
#[derive(Clone, Debug)]
pub(crate) struct Clustering {
    neighbourhood: Neighbourhood,
    tournament: Tournament,
    widowed: Vec<usize>,
}

impl Clustering {
    pub(crate) fn new(arena: &Arena) -> Self {
        let slots = arena.slots();
        Self {
            neighbourhood: Neighbourhood::new(slots, arena.metric().reach()),
            tournament: Tournament::new(slots),
            widowed: Vec::with_capacity(slots),
        }
    }

    /// Merges until no pair is closer than the threshold; how many were merged. The arena has
    /// nothing to bury before, and may have after.
    pub(crate) fn run(&mut self, arena: &mut Arena) -> u64 {
        self.neighbourhood.clear();
        self.tournament.clear();
        for &slot in arena.live() {
            self.neighbourhood.insert(arena, slot);
        }
        for &slot in arena.live() {
            self.choose(arena, slot);
        }
        let mut merged = 0;
        while let Some(pair) = self.tournament.winner() {
            self.merge(arena, pair.older_slot, pair.younger_slot);
            merged += 1;
        }
        merged
    }

    fn merge(&mut self, arena: &mut Arena, kept: usize, gone: usize) {
        self.widowed.clear();
        let Self { neighbourhood, tournament, widowed } = self;
        for ended in [kept, gone] {
            tournament.set(ended, None);
            neighbourhood.each_near(arena, ended, |slot| {
                let chose_ended = tournament
                    .get(slot)
                    .is_some_and(|pair| pair.younger_slot == kept || pair.younger_slot == gone);
                if chose_ended {
                    tournament.set(slot, None);
                    widowed.push(slot);
                }
            });
        }
        neighbourhood.remove(gone);
        neighbourhood.remove(kept);
        arena.merge(kept, gone);
        neighbourhood.insert(arena, kept);

        for index in 0..self.widowed.len() {
            if let Some(&slot) = self.widowed.get(index) {
                self.choose(arena, slot);
            }
        }
        self.choose(arena, kept);
        let Self { neighbourhood, tournament, .. } = self;
        neighbourhood.each_near(arena, kept, |slot| {
            if let Some(pair) = pair(arena, slot, kept)
                && tournament.get(slot).is_none_or(|chosen| pair.is_before(&chosen))
            {
                tournament.set(slot, Some(pair));
            }
        });
    }

    /// The belief in the slot chooses the nearest younger one.
    fn choose(&mut self, arena: &Arena, slot: usize) {
        let mut nearest: Option<Pair> = None;
        self.neighbourhood.each_near(arena, slot, |other| {
            if let Some(pair) = pair(arena, slot, other)
                && nearest.is_none_or(|nearest| pair.is_before(&nearest))
            {
                nearest = Some(pair);
            }
        });
        self.tournament.set(slot, nearest);
    }
}

/// The pair of an older and a younger belief, if they may be merged.
fn pair(arena: &Arena, older_slot: usize, younger_slot: usize) -> Option<Pair> {
    let (older, younger) = (arena.memory(older_slot)?.id, arena.memory(younger_slot)?.id);
    if older >= younger {
        return None;
    }
    let distance = arena.distance(older_slot, younger_slot)?;
    Some(Pair { distance, older, younger, older_slot, younger_slot })
}
