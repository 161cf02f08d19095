use clock::Instant;
use config::percepts::Percepts;
use message::{Observation, Snapshot};

use crate::apart::Apart;
use crate::memory::Memory;
use crate::metric::Metric;
use crate::room::Room;
use crate::sample::Sample;

/// B, the current set of beliefs, in slots that exist from the start.
#[derive(Clone, Debug)]
pub(crate) struct Arena {
    memories: Box<[Memory]>,
    lives: Box<[bool]>,
    /// Slots in use, in the order of the identities; those merged away since the last
    /// [`Self::bury`] are still among them.
    live: Room<usize>,
    free: Room<usize>,
    metric: Metric,
    apart: Apart,
    scratch: Room<Sample>,
}

impl Arena {
    pub(crate) fn new(percepts: &Percepts, slots: usize) -> Self {
        let memory = Memory::new(&percepts.percepts);
        let most_samples = memory.most_samples();
        let mut free = Room::for_most(slots);
        free.extend((0..slots).rev());
        Self {
            memories: vec![memory; slots].into_boxed_slice(),
            lives: vec![false; slots].into_boxed_slice(),
            live: Room::for_most(slots),
            free,
            metric: Metric::new(&percepts.belief),
            apart: Apart::new(slots),
            scratch: Room::for_most(2 * most_samples),
        }
    }

    pub(crate) fn slots(&self) -> usize {
        self.memories.len()
    }

    pub(crate) fn metric(&self) -> &Metric {
        &self.metric
    }

    /// Slots of the beliefs in the order of their identities. After merging, call
    /// [`Self::bury`] first.
    pub(crate) fn live(&self) -> &[usize] {
        &self.live
    }

    pub(crate) fn memory(&self, slot: usize) -> Option<&Memory> {
        self.memories.get(slot)
    }

    pub(crate) fn memory_mut(&mut self, slot: usize) -> Option<&mut Memory> {
        self.memories.get_mut(slot)
    }

    pub(crate) fn lives(&self, slot: usize) -> bool {
        self.lives.get(slot).copied().unwrap_or(false)
    }

    /// Creates a belief (N, Eq. 6), whose `id` is higher than that of every other; `None` when
    /// no slot is free.
    pub(crate) fn create(
        &mut self,
        id: u64,
        at: Instant,
        observation: &Observation,
        snapshot: &Snapshot,
    ) -> Option<usize> {
        let slot = self.free.pop()?;
        self.memories.get_mut(slot)?.begin(id, at, observation, snapshot);
        *self.lives.get_mut(slot)? = true;
        self.live.push(slot);
        Some(slot)
    }

    /// The belief is of a group of the step: of a source and an instant.
    pub(crate) fn join(&mut self, slot: usize, group: usize) {
        self.apart.join(slot, group);
    }

    /// The step ends: see [`Apart::settle`].
    pub(crate) fn settle(&mut self, groups: usize) {
        self.apart.settle(&self.live, groups);
    }

    /// Whether two beliefs cannot be of one thing.
    pub(crate) fn are_apart(&self, a: usize, b: usize) -> bool {
        self.apart.are(a, b)
    }

    /// D of two beliefs, where it is below the threshold.
    pub(crate) fn distance(&self, a: usize, b: usize) -> Option<f64> {
        self.metric.below_threshold(self.memories.get(a)?, self.memories.get(b)?)
    }

    /// Merges the belief in `gone` into the one in `kept` (M).
    pub(crate) fn merge(&mut self, kept: usize, gone: usize) {
        if let Ok([kept, gone]) = self.memories.get_disjoint_mut([kept, gone]) {
            kept.merge(gone, &mut self.scratch);
        }
        self.apart.merge(kept, gone);
        self.release(gone);
    }

    /// The belief in the slot is no more.
    pub(crate) fn release(&mut self, slot: usize) {
        if let Some(lives) = self.lives.get_mut(slot)
            && std::mem::take(lives)
        {
            self.apart.forget(slot);
            self.free.push(slot);
        }
    }

    /// Takes the released slots out of the order.
    pub(crate) fn bury(&mut self) {
        let lives = &self.lives;
        self.live.retain(|&slot| lives.get(slot).copied().unwrap_or(false));
    }
}
