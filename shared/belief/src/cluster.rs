//! Clustering: the loop of "Belief Modeling", while some pair has D < threshold, merge the pair of
//! globally minimal D. Of equally near pairs that of the lowest identities comes first; D is
//! computed anew on every merged belief.

mod lists;
#[cfg(test)]
mod naive;
mod neighbourhood;
#[cfg(test)]
mod tests;
mod tournament;

use lists::Lists;
use neighbourhood::Neighbourhood;
use tournament::{Pair, Tournament};

use crate::arena::Arena;
use crate::room::Room;

/// Finds the pairs to merge without looking at all pairs: with bit for bit the outcome of the
/// naive loop.
///
/// Each belief chooses the nearest of the younger beliefs within its reach, in the sense of the
/// position term alone, and a tournament over the beliefs keeps the nearest pair of all. A merge
/// changes one belief and ends another, so only those that had chosen one of the two, and the
/// merged one's new neighbours, choose anew.
#[derive(Clone, Debug)]
pub(crate) struct Clustering {
    neighbourhood: Neighbourhood,
    tournament: Tournament,
    /// By the slot chosen, the slots that chose it.
    choosers: Lists,
    widowed: Room<usize>,
}

impl Clustering {
    pub(crate) fn new(arena: &Arena) -> Self {
        let slots = arena.slots();
        Self {
            neighbourhood: Neighbourhood::new(slots, arena.metric().reach()),
            tournament: Tournament::new(slots),
            choosers: Lists::new(slots, slots),
            widowed: Room::for_most(slots),
        }
    }

    /// Merges until no pair is closer than the threshold; how many were merged. The arena has
    /// nothing to bury before, and may have after.
    ///
    /// No two of the first `settled` beliefs are closer than the threshold: neither has changed
    /// since this was last run, which ended with no such pair.
    pub(crate) fn run(&mut self, arena: &mut Arena, settled: usize) -> u64 {
        self.neighbourhood.clear();
        self.tournament.clear();
        self.choosers.clear();
        for (index, &slot) in arena.live().iter().enumerate() {
            self.neighbourhood.insert(arena, slot);
            // Whoever comes here is younger than all that are here.
            if index >= settled {
                self.meet(arena, slot);
            }
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
        self.set(gone, None);
        self.set(kept, None);
        for ended in [kept, gone] {
            while let Some(slot) = self.choosers.first_of(ended) {
                self.set(slot, None);
                self.widowed.push(slot);
            }
        }
        self.neighbourhood.remove(gone);
        self.neighbourhood.remove(kept);
        arena.merge(kept, gone);
        self.neighbourhood.insert(arena, kept);
        for index in 0..self.widowed.len() {
            if let Some(&slot) = self.widowed.get(index) {
                self.choose(arena, slot);
            }
        }
        self.choose(arena, kept);
        self.meet(arena, kept);
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
        self.set(slot, nearest);
    }

    /// Older beliefs that are nearer to the one in the slot than to their choice choose it.
    fn meet(&mut self, arena: &Arena, slot: usize) {
        let Self { neighbourhood, tournament, choosers, .. } = self;
        neighbourhood.each_near(arena, slot, |other| {
            if let Some(pair) = pair(arena, other, slot)
                && tournament.get(other).is_none_or(|chosen| pair.is_before(&chosen))
            {
                set(tournament, choosers, other, Some(pair));
            }
        });
    }

    fn set(&mut self, slot: usize, choice: Option<Pair>) {
        set(&mut self.tournament, &mut self.choosers, slot, choice);
    }
}

fn set(tournament: &mut Tournament, choosers: &mut Lists, slot: usize, choice: Option<Pair>) {
    choosers.remove(slot);
    if let Some(pair) = choice {
        choosers.insert(pair.younger_slot, slot);
    }
    tournament.set(slot, choice);
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
