use clock::Instant;
use invariant::{invariant, require};
use message::{Feature, Observation, Perceived, SourceSet};

use super::bounded_vec::BoundedVec;
use super::free_list::FreeList;
use super::histories::Histories;
use super::memory::Memory;

/// The slots of the beliefs: what is remembered of each, in preallocated memory.
///
/// Within a step a new belief is only a snapshot, because nearly all new beliefs merge into an older one at once. The
/// remaining ones get histories when the step is committed ([`Self::commit_new`]). There the older beliefs also append
/// the snapshots to their histories, belief by belief in memory order. Association depends on the features alone, and
/// its merge order would access memory at random.
#[derive(Clone, Debug)]
pub(crate) struct Arena {
    memories: Box<[Memory]>,
    /// Where the percepts of each slot are. This array and the chains are separate from the rest: there may be many
    /// slots, and each pass over them should fetch little else than it reads.
    storage: Box<[Storage]>,
    chains: Box<[Chain]>,
    /// Per slot, a counter that changes with every change or removal of its belief.
    versions: Box<[u32]>,
    /// Slots of beliefs of earlier steps, in order of their identities.
    live: BoundedVec<u32>,
    /// Slots of beliefs of this step, likewise. Their identities are higher than all in `live`.
    fresh: BoundedVec<u32>,
    free_list: FreeList,
    histories: Histories,
    /// No belief ever stored a sample later than this.
    latest: Instant,
    unsound: u64,
    /// Whether the caller has validated all input.
    prevalidated: bool,
}

/// The snapshots of this step that were merged into a belief and are not in its histories yet, as a linked list.
#[derive(Clone, Copy, Debug)]
struct Chain {
    /// The first and the last slot of the list.
    pending: Option<(u32, u32)>,
    /// If the belief itself is such a snapshot: the next slot, its entry and its time.
    next: u32,
    entry: u32,
    at: Instant,
}

/// The data of this many beliefs stays in the cache between steps. The samples are the exception; they are written
/// before they could be fetched.
const CACHE_RESIDENT_BELIEFS: usize = 256;

/// Where the percepts of a belief are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Storage {
    /// There is no belief.
    Nothing,
    /// In the snapshot of one of the step's perceived things.
    Snapshot,
    /// In this row of the histories.
    Histories(u32),
}

const NO_MEMORY: Memory = Memory {
    id: 0,
    born_at: Instant::EPOCH,
    perceived_at: Instant::EPOCH,
    updated_at: Instant::EPOCH,
    empty_since: None,
    observations: 0,
    held_by: message::NOBODY,
    confidence: 0.0,
    is_announced: false,
    seen_by: SourceSet::EMPTY,
};

const NO_CHAIN: Chain = Chain { pending: None, next: 0, entry: 0, at: Instant::EPOCH };

impl Arena {
    /// Without beliefs. `histories` has as many rows as there are `slots`.
    pub(crate) fn new(histories: Histories, slots: usize) -> Self {
        Self {
            memories: vec![NO_MEMORY; slots].into_boxed_slice(),
            storage: vec![Storage::Nothing; slots].into_boxed_slice(),
            chains: vec![NO_CHAIN; slots].into_boxed_slice(),
            versions: vec![0; slots].into_boxed_slice(),
            live: BoundedVec::with_bound(slots),
            fresh: BoundedVec::with_bound(slots),
            free_list: FreeList::all(slots),
            histories,
            latest: Instant::EPOCH,
            unsound: 0,
            prevalidated: false,
        }
    }

    pub(crate) fn slots(&self) -> usize {
        self.memories.len()
    }

    /// Slots of the beliefs of earlier steps in order of their identities. Those merged or freed since the last commit
    /// are still in the list.
    pub(crate) fn live(&self) -> &[u32] {
        &self.live
    }

    /// Slots of the beliefs of this step in order of their identities; some may be merged or freed.
    pub(crate) fn fresh(&self) -> &[u32] {
        &self.fresh
    }

    /// Evaluations that were omitted because they were invalid.
    pub(crate) fn unsound(&self) -> u64 {
        self.unsound
    }

    /// Disables the validation of input from now on.
    pub(crate) fn set_prevalidated(&mut self) {
        self.prevalidated = true;
    }

    pub(crate) fn prevalidated(&self) -> bool {
        self.prevalidated
    }

    #[inline]
    pub(crate) fn memory(&self, slot: u32) -> Option<&Memory> {
        self.memories.get(slot as usize)
    }

    pub(crate) fn memory_mut(&mut self, slot: u32) -> Option<&mut Memory> {
        self.memories.get_mut(slot as usize)
    }

    #[inline]
    fn storage(&self, slot: u32) -> Storage {
        self.storage.get(slot as usize).copied().unwrap_or(Storage::Nothing)
    }

    #[inline]
    pub(crate) fn is_live(&self, slot: u32) -> bool {
        self.storage(slot) != Storage::Nothing
    }

    /// Whether the belief is only a snapshot of this step.
    #[inline]
    pub(crate) fn is_snapshot(&self, slot: u32) -> bool {
        self.storage(slot) == Storage::Snapshot
    }

    /// A number that changes with every change or removal of the belief in the slot.
    pub(crate) fn version(&self, slot: u32) -> Option<u32> {
        require!(self.versions.get(slot as usize), "slot {slot} exists").copied()
    }

    /// Whether the belief in `newer` is a snapshot newer than every sample of the one in `older`.
    #[inline]
    pub(crate) fn appends(&self, older: u32, newer: u32) -> bool {
        let histories =
            matches!(self.storage(older), Storage::Histories(_)) && self.storage(newer) == Storage::Snapshot;
        let at = |slot: u32| self.memory(slot).map(|memory| memory.perceived_at);
        histories && at(newer) > at(older)
    }

    /// Whether a belief has histories, and all its samples are older than `at`.
    #[inline]
    pub(crate) fn is_older(&self, slot: u32, at: Instant) -> bool {
        let has_histories = matches!(self.storage(slot), Storage::Histories(_));
        let is_older = |memory: &Memory| memory.perceived_at < at;
        has_histories && (self.latest < at || self.memory(slot).is_some_and(is_older))
    }

    /// Creates a belief of entry `entry` of the perceived things. `at` is the sample's time, `now` the step's. `id` must
    /// be higher than every other. `None` if no slot is free.
    pub(crate) fn create(
        &mut self,
        id: u64,
        [at, now]: [Instant; 2],
        entry: u32,
        observation: &Observation,
    ) -> Option<u32> {
        let number = self.free_list.take()?;
        let (Some(memory), Some(storage), Some(chain)) = (
            self.memories.get_mut(number as usize),
            self.storage.get_mut(number as usize),
            self.chains.get_mut(number as usize),
        ) else {
            invariant!(false, "slot {number} exists");
            return None;
        };
        self.latest = self.latest.max(at);
        *memory = Memory::new(id, at, now, observation);
        *storage = Storage::Snapshot;
        *chain = Chain { entry, at, ..NO_CHAIN };
        self.fresh.push(number);
        Some(number)
    }

    /// Takes the youngest belief of this step off its list if its entry is not below `entries`. The caller frees it.
    pub(crate) fn pop_fresh(&mut self, entries: usize) -> Option<u32> {
        let chains = &self.chains;
        let is_beyond =
            |slot: &mut u32| chains.get(*slot as usize).is_some_and(|it| it.entry as usize >= entries);
        // They are in the order of their entries.
        self.fresh.pop_if(is_beyond)
    }

    /// Fast path of a merge: the belief in `gone` is a snapshot newer than everything in `kept`
    /// ([`Self::appends`]). The histories are updated on commit.
    pub(crate) fn append(&mut self, kept: u32, gone: u32) {
        if let Ok([older, newer]) = self.memories.get_disjoint_mut([kept as usize, gone as usize]) {
            older.merge(newer);
        }
        if let Some(chain) = self.chains.get_mut(kept as usize) {
            let pending = chain.pending;
            chain.pending = Some((pending.map_or(gone, |(first, _)| first), gone));
            if let Some(last) = pending.and_then(|(_, last)| self.chains.get_mut(last as usize)) {
                last.next = gone;
            }
        }
    }

    /// Merges the histories of the belief in `gone` into those of the one in `kept`. Returns `false` if one of them has
    /// none.
    pub(crate) fn unite(&mut self, kept: u32, gone: u32, perceived: &[Perceived]) -> bool {
        let (Some(row), Some(others)) = (self.remember(kept, perceived), self.remember(gone, perceived))
        else {
            return false;
        };
        if let Ok([kept, gone]) = self.memories.get_disjoint_mut([kept as usize, gone as usize]) {
            kept.merge(gone);
            self.histories.merge(row, others, kept.id);
        }
        true
    }

    /// Adds an observation to a belief with histories. `at` is its time, later than every sample of the belief; `now` is
    /// the step's. Returns `false` if the belief has no histories.
    pub(crate) fn add_observation(
        &mut self,
        slot: u32,
        [at, now]: [Instant; 2],
        perceived: &Perceived,
    ) -> bool {
        let Perceived { observation, snapshot } = perceived;
        let (Some(row), Some(memory)) = (self.row(slot), self.memories.get_mut(slot as usize)) else {
            invariant!(false, "slot {slot} has histories");
            return false;
        };
        memory.add_observation(at, now, observation);
        self.latest = self.latest.max(at);
        let phase = memory.id;
        self.change(slot);
        self.unsound += self.histories.add_snapshot(row, snapshot.values(), self.prevalidated, at, phase);
        true
    }

    /// Counts a change of the belief in the slot.
    pub(crate) fn change(&mut self, slot: u32) {
        if let Some(version) = self.versions.get_mut(slot as usize) {
            *version = version.wrapping_add(1);
        }
    }

    /// Frees the slot and its row of histories. Returns `false` if it has no belief.
    pub(crate) fn free(&mut self, number: u32) -> bool {
        let Some(storage) = require!(self.storage.get_mut(number as usize), "slot {number} exists") else {
            return false;
        };
        match std::mem::replace(storage, Storage::Nothing) {
            Storage::Nothing => {
                invariant!(false, "slot {number} is freed once");
                return false;
            }
            Storage::Snapshot => {}
            Storage::Histories(row) => self.histories.free_row(row),
        }
        self.change(number);
        self.free_list.put(number);
        true
    }

    /// Gives histories to a new belief that remains and appends it to the list. Returns `false` if it got none.
    pub(crate) fn commit_new(&mut self, slot: u32, perceived: &[Perceived]) -> bool {
        let is_remembered = self.remember(slot, perceived).is_some();
        if is_remembered {
            self.live.push(slot);
        }
        is_remembered
    }

    /// Ends the step: no belief is new any more.
    pub(crate) fn clear_fresh(&mut self) {
        self.fresh.clear();
    }

    /// Whether there are too many beliefs for their data to stay in the cache.
    #[inline]
    pub(crate) fn exceeds_cache(&self) -> bool {
        self.live.len() > CACHE_RESIDENT_BELIEFS
    }

    /// If there are many beliefs, prefetches the headers of a belief's histories, or, if `soon`, the cells that it will
    /// write.
    #[inline(always)]
    pub(crate) fn prefetch(&self, slot: u32, soon: bool) {
        if self.exceeds_cache()
            && let Some(row) = self.row(slot)
        {
            if soon { self.histories.prefetch_cells(row) } else { self.histories.prefetch(row) }
        }
    }

    /// Removes the freed slots from the list.
    pub(crate) fn compact(&mut self) {
        let storage = &self.storage;
        self.live
            .retain(|&slot| storage.get(slot as usize).is_some_and(|storage| *storage != Storage::Nothing));
    }

    /// The histories of all beliefs.
    #[inline]
    pub(crate) fn all_histories(&self) -> &Histories {
        &self.histories
    }

    /// The histories of a committed belief.
    pub(crate) fn histories(&self, slot: u32) -> Option<(&Histories, u32)> {
        Some((&self.histories, require!(self.row(slot), "slot {slot} has histories")?))
    }

    /// Mutable histories of a committed belief; the caller must update what it caches of them.
    pub(crate) fn histories_mut(&mut self, slot: u32) -> Option<(&mut Histories, u32)> {
        let row = require!(self.row(slot), "slot {slot} has histories")?;
        Some((&mut self.histories, row))
    }

    /// The newest feature of a percept of a committed belief.
    #[inline]
    pub(crate) fn newest(&self, slot: u32, percept: u16) -> Option<Feature> {
        Some(self.histories.newest(self.row(slot)?, percept)?.feature)
    }

    fn row(&self, slot: u32) -> Option<u32> {
        match self.storage(slot) {
            Storage::Histories(row) => Some(row),
            Storage::Nothing | Storage::Snapshot => None,
        }
    }

    /// The row of histories of a belief, with all pending snapshots appended. A belief that was only a snapshot gets
    /// its row here.
    pub(crate) fn remember(&mut self, number: u32, perceived: &[Perceived]) -> Option<u32> {
        let (row, mut pending) = match self.storage(number) {
            Storage::Nothing => {
                invariant!(false, "slot {number} has a belief");
                return None;
            }
            Storage::Histories(row) => (row, self.chains.get_mut(number as usize)?.pending.take()),
            Storage::Snapshot => {
                let row = require!(self.histories.allocate_row(), "there are as many rows as slots")?;
                *self.storage.get_mut(number as usize)? = Storage::Histories(row);
                (row, Some((number, number)))
            }
        };
        while let Some((first, last)) = pending {
            let Chain { next, entry, at, .. } = *self.chains.get(first as usize)?;
            pending = (first != last).then_some((next, last));
            if let Some(perceived) = require!(perceived.get(entry as usize), "entry {entry} exists") {
                let id = self.memories.get(number as usize)?.id;
                self.unsound +=
                    self.histories.add_snapshot(row, perceived.snapshot.values(), self.prevalidated, at, id);
            }
        }
        Some(row)
    }
}
