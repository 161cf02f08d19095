//! Clustering: the loop of "Belief Modeling", while some pair has D < threshold, merge the pair of
//! globally minimal D. Of equally near pairs that of the lowest identities comes first; D is
//! computed anew on every merged belief.

#[cfg(test)]
mod naive;
mod neighbourhood;
mod queue;
#[cfg(test)]
mod tests;

use message::Perceived;
use neighbourhood::Neighbourhood;
use queue::{Pair, Queue};

use crate::arena::Arena;

/// Finds the pairs to merge without looking at all pairs: with bit for bit the outcome of the
/// naive loop.
///
/// Each belief chooses the nearest of the younger beliefs within its reach, in the sense of the
/// position term alone, and a queue holds one choice of each. A merge changes one belief and ends
/// another. What the changed one is now nearest to is found at once, so no choice is ever too
/// late in the queue; a choice that fell on what has changed or ended is found out when it comes
/// first, and made anew.
#[derive(Clone, Debug)]
pub(crate) struct Clustering {
    neighbourhood: Neighbourhood,
    queue: Queue,
    /// Whether the beliefs of this step are in the neighbourhood.
    fresh_inserted: bool,
}

impl Clustering {
    pub(crate) fn new(arena: &Arena) -> Self {
        let slots = arena.slots();
        Self {
            neighbourhood: Neighbourhood::new(slots, arena.metric().reach()),
            queue: Queue::new(slots),
            fresh_inserted: false,
        }
    }

    /// The belief in the slot stays, and is where its features say.
    pub(crate) fn place(&mut self, arena: &Arena, slot: u32) {
        self.neighbourhood.insert(arena, slot);
    }

    /// The belief in the slot is no more.
    pub(crate) fn forget(&mut self, slot: u32) {
        self.neighbourhood.remove(slot);
    }

    /// Merges until no pair is closer than the threshold; how many were merged. The beliefs of
    /// earlier steps are all placed.
    ///
    /// `settled` says that no two of those are closer than the threshold. `one_frame` says that
    /// all beliefs of this step are of one source and instant.
    pub(crate) fn run(
        &mut self,
        arena: &mut Arena,
        perceived: &[Perceived],
        settled: bool,
        one_frame: bool,
    ) -> u64 {
        self.fresh_inserted = false;
        // What one source sees at one instant is apart, and so is whatever takes any of it in: the
        // beliefs of this step need not find one another.
        if !(settled && one_frame && arena.keeps_apart()) {
            self.insert_fresh(arena);
        }
        let Self { neighbourhood, queue, .. } = self;
        let slots = if settled { [&[], arena.fresh()] } else { [arena.live(), arena.fresh()] };
        for &slot in slots.into_iter().flatten() {
            neighbourhood.each_near(arena, slot, |other| {
                if let Some(pair) = pair(arena, slot, other) {
                    queue.propose(pair);
                }
            });
        }
        queue.order();
        let mut merged = 0;
        while let Some(pair) = self.queue.first() {
            if arena.version(pair.younger_slot) == pair.younger_version {
                self.merge(arena, perceived, pair.older_slot, pair.younger_slot);
                merged += 1;
            } else {
                self.insert_fresh(arena);
                self.choose(arena, pair.older_slot);
            }
        }
        merged
    }

    fn merge(&mut self, arena: &mut Arena, perceived: &[Perceived], kept: u32, gone: u32) {
        self.queue.set(gone, None);
        self.neighbourhood.remove(gone);
        arena.merge(kept, gone, perceived);
        self.neighbourhood.insert(arena, kept);
        let Self { neighbourhood, queue, .. } = self;
        let mut nearest: Option<Pair> = None;
        neighbourhood.each_near(arena, kept, |other| {
            let Some(pair) = pair(arena, kept, other) else { return };
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

    /// The belief in the slot chooses the nearest younger one.
    fn choose(&mut self, arena: &Arena, slot: u32) {
        let mut nearest: Option<Pair> = None;
        self.neighbourhood.each_near(arena, slot, |other| {
            if let Some(pair) = pair(arena, slot, other)
                && pair.older_slot == slot
                && nearest.is_none_or(|nearest| pair.is_before(&nearest))
            {
                nearest = Some(pair);
            }
        });
        self.queue.set(slot, nearest);
    }

    fn insert_fresh(&mut self, arena: &Arena) {
        if !std::mem::replace(&mut self.fresh_inserted, true) {
            for &slot in arena.fresh().iter().filter(|&&slot| arena.lives(slot)) {
                self.neighbourhood.insert(arena, slot);
            }
        }
    }
}

/// The pair of two beliefs that are not apart, if they are near enough, in the order of their
/// identities.
fn pair(arena: &Arena, a: u32, b: u32) -> Option<Pair> {
    let distance = arena.distance(a, b)?;
    if arena.are_apart(a, b) {
        return None;
    }
    let (id_a, id_b) = (arena.memory(a)?.id, arena.memory(b)?.id);
    let (older, younger, older_slot, younger_slot) =
        if id_a < id_b { (id_a, id_b, a, b) } else { (id_b, id_a, b, a) };
    let younger_version = arena.version(younger_slot);
    Some(Pair { distance, older, younger, older_slot, younger_slot, younger_version })
}
