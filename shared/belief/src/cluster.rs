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
                self.settle(arena, slot);
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
        self.settle(arena, kept);
    }

    /// The belief in the slot chooses the nearest younger one.
    fn choose(&mut self, arena: &Arena, slot: usize) {
        let mut nearest: Option<Pair> = None;
        self.neighbourhood.each_near(arena, slot, |other| {
            if let Some(pair) = pair(arena, slot, other)
                && pair.older_slot == slot
                && nearest.is_none_or(|nearest| pair.is_before(&nearest))
            {
                nearest = Some(pair);
            }
        });
        self.set(slot, nearest);
    }

    /// The belief in the slot is new or has changed: the nearest younger one is chosen for it, and
    /// it for the older ones that it is nearest to.
    fn settle(&mut self, arena: &Arena, slot: usize) {
        let Self { neighbourhood, tournament, choosers, .. } = self;
        neighbourhood.each_near(arena, slot, |other| {
            if let Some(pair) = pair(arena, slot, other)
                && tournament.get(pair.older_slot).is_none_or(|chosen| pair.is_before(&chosen))
            {
                set(tournament, choosers, pair.older_slot, Some(pair));
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

/// The pair of two beliefs that are not apart, if they are near enough, in the order of their
/// identities.
fn pair(arena: &Arena, a: usize, b: usize) -> Option<Pair> {
    let distance = arena.distance(a, b)?;
    let (id_a, id_b) = (arena.memory(a)?.id, arena.memory(b)?.id);
    Some(if id_a < id_b {
        Pair { distance, older: id_a, younger: id_b, older_slot: a, younger_slot: b }
    } else {
        Pair { distance, older: id_b, younger: id_a, older_slot: b, younger_slot: a }
    })
}
