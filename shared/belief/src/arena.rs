mod detections;
mod step;
#[cfg(test)]
mod tests;

use clock::Instant;
use invariant::{invariant, require};
use message::{Feature, Perceived, PerceptValue, Snapshot, SourceSet};
use quantity::number::saturating_u32;

use crate::percepts::Percepts;

pub(crate) use detections::{Detections, FrameAssociation};
pub(crate) use step::Step;

use crate::BeliefSystemError;
use crate::cluster::{GateKeys, MemberSummary, PREFETCH_DISTANCE};
use crate::detection_history::{DetectionHistory, Interval};
use crate::free_list::FreeList;
use crate::history::Histories;
use crate::memory::Memory;
use crate::metric::{Gate, Metric};
use crate::plugin::BeliefPlugins;
use crate::room::BoundedVec;

/// B, the current set of beliefs, in preallocated slots.
///
/// Within a step a new belief is only a snapshot, because nearly all new beliefs merge into an older one at once. The
/// remaining ones get histories in [`Self::commit`], which commits the step. There the older beliefs also append the
/// snapshots to their histories, belief by belief in memory order. Association depends on the features alone, and its
/// merge order would access memory at random.
#[derive(Clone, Debug)]
pub(crate) struct Arena {
    memories: Box<[Memory]>,
    /// Where the percepts of each slot are. This array and the chains are separate from the rest: there may be many
    /// slots, and each pass over them should fetch little else than it reads.
    storage: Box<[Storage]>,
    chains: Box<[Chain]>,
    /// Per slot, a counter that changes with every change or removal of its belief.
    versions: Box<[u32]>,
    /// Per slot, the newest features that the metric compares, in the order of its terms.
    features: Box<[Option<Feature>]>,
    terms: Box<[u16]>,
    /// Per slot, those of its symbols that are gate keys.
    gate_keys: Box<[GateKeys]>,
    /// Whether the new value of each compared feature can be predicted from the old value and the new snapshot. False
    /// if a plug-in history keeps one of them.
    predictable: bool,
    /// Slots of beliefs of earlier steps, in order of their identities.
    live: BoundedVec<u32>,
    /// Slots of beliefs of this step, likewise. Their identities are higher than all in `live`.
    fresh: BoundedVec<u32>,
    free_list: FreeList,
    histories: Histories,
    metric: Metric,
    gate: Option<Gate>,
    /// The cannot-link constraints; `None` if beliefs observed in the same frame may merge.
    detection_history: Option<DetectionHistory>,
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
    seen_by: SourceSet::EMPTY,
};

const NO_CHAIN: Chain = Chain { pending: None, next: 0, entry: 0, at: Instant::EPOCH };

impl Arena {
    pub(crate) fn new(
        percepts: &Percepts,
        plugin: &BeliefPlugins,
        slots: u32,
    ) -> Result<Self, BeliefSystemError> {
        let count = slots as usize;
        let metric = Metric::new(&percepts.belief, plugin)?;
        let histories = Histories::new(&percepts.percepts, plugin, count)?;
        let terms: Box<[u16]> = metric.percepts().collect();
        let cannot_link = percepts.belief.cannot_link_same_source_instant;
        Ok(Self {
            predictable: !terms.iter().any(|percept| histories.is_plugin(*percept)),
            memories: vec![NO_MEMORY; count].into_boxed_slice(),
            storage: vec![Storage::Nothing; count].into_boxed_slice(),
            chains: vec![NO_CHAIN; count].into_boxed_slice(),
            versions: vec![0; count].into_boxed_slice(),
            features: vec![None; count * terms.len()].into_boxed_slice(),
            gate_keys: vec![GateKeys::NONE; count].into_boxed_slice(),
            terms,
            live: BoundedVec::with_bound(count),
            fresh: BoundedVec::with_bound(count),
            free_list: FreeList::all(count),
            histories,
            gate: metric.gate(percepts.place()),
            metric,
            detection_history: cannot_link.then(|| DetectionHistory::new(count)),
            latest: Instant::EPOCH,
            unsound: 0,
            prevalidated: false,
        })
    }

    pub(crate) fn slots(&self) -> usize {
        self.memories.len()
    }

    /// The gate radius: the largest distance in metres between two beliefs that are closer than the threshold.
    pub(crate) fn gate_radius_m(&self) -> Option<f64> {
        self.gate.map(|gate| gate.metres)
    }

    /// Slots of the beliefs of earlier steps in order of their identities. Those merged or freed since the last commit
    /// are still in the list.
    pub(crate) fn live(&self) -> &[u32] {
        &self.live
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

    /// Whether beliefs observed in the same frame cannot be linked.
    pub(crate) fn has_cannot_link(&self) -> bool {
        self.detection_history.is_some()
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
    fn is_live(&self, slot: u32) -> bool {
        self.storage(slot) != Storage::Nothing
    }

    /// Whether the belief in `newer` is a snapshot newer than every sample of the one in `older`.
    #[inline]
    fn appends(&self, older: u32, newer: u32) -> bool {
        let histories =
            matches!(self.storage(older), Storage::Histories(_)) && self.storage(newer) == Storage::Snapshot;
        let at = |slot: u32| self.memory(slot).map(|memory| memory.perceived_at);
        histories && at(newer) > at(older)
    }

    /// The newest features that the metric compares, in the order of its terms.
    #[inline]
    fn features(&self, slot: u32) -> &[Option<Feature>] {
        let start = slot as usize * self.terms.len();
        require!(self.features.get(start..start + self.terms.len()), "slot {slot} exists").unwrap_or(&[])
    }

    /// Whether the gate keys of the belief in `older` remain valid when it merges with another one. `newer` are the
    /// other's gate keys; `features` returns its features and is called only if needed.
    #[inline]
    fn keeps_gate_keys<F: AsRef<[Option<Feature>]>>(
        &self,
        older: u32,
        newer: GateKeys,
        features: impl FnOnce() -> Option<F>,
    ) -> bool {
        // If the position is the only other term, no other feature is a symbol: both members were found by position.
        if self.metric.weight_of_place().is_some()
            && self.gate_keys.get(older as usize).is_some_and(|older| older.is_subset_of(newer))
        {
            return true;
        }
        let is_symbol = |feature: &Feature| matches!(feature, Feature::Symbol(_));
        features().is_some_and(|newer| {
            self.features(older).iter().zip(newer.as_ref()).all(|(older, newer)| {
                let was_symbol = older.as_ref().is_some_and(is_symbol);
                !was_symbol || newer.as_ref().is_none_or(is_symbol)
            })
        })
    }

    /// `Some(d)` if the distance can be computed from position and symbols alone (`d` is `None` when above the
    /// threshold); `None` if the full feature rows are needed.
    #[inline]
    fn distance_from_summaries(&self, a: &MemberSummary, b: &MemberSummary) -> Option<Option<f64>> {
        let weight = self.metric.weight_of_place()?;
        let are_complete = a.gate_keys.are_complete() && b.gate_keys.are_complete();
        are_complete.then(|| self.metric.below_threshold_of(weight, a.place_m, b.place_m))
    }

    /// The feature of a percept in a snapshot.
    #[inline(always)]
    fn feature_in(&self, snapshot: &Snapshot, percept: u16) -> Option<Feature> {
        let value = evaluation(snapshot, percept, self.prevalidated)?;
        Some(self.histories.representable(percept, value.sound_feature()))
    }

    /// Creates a belief (N, Eq. 6) from entry `entry` of the perceived things. `at` is the sample's time, `now` the
    /// step's. `id` must be higher than every other. `None` if no slot is free.
    pub(crate) fn create(
        &mut self,
        id: u64,
        [at, now]: [Instant; 2],
        entry: u32,
        perceived: &Perceived,
    ) -> Option<u32> {
        let number = self.free_list.take()?;
        let (start, terms) = (number as usize * self.terms.len(), self.terms.len());
        let (Some(memory), Some(storage), Some(chain), Some(features), Some(gate_keys)) = (
            self.memories.get_mut(number as usize),
            self.storage.get_mut(number as usize),
            self.chains.get_mut(number as usize),
            self.features.get_mut(start..start + terms),
            self.gate_keys.get_mut(number as usize),
        ) else {
            invariant!(false, "slot {number} exists");
            return None;
        };
        self.latest = self.latest.max(at);
        *memory = Memory::new(id, at, now, &perceived.observation);
        *storage = Storage::Snapshot;
        *chain = Chain { entry, at, ..NO_CHAIN };
        for (feature, percept) in features.iter_mut().zip(&self.terms) {
            let value = evaluation(&perceived.snapshot, *percept, self.prevalidated);
            *feature = value.map(|value| self.histories.representable(*percept, value.sound_feature()));
        }
        *gate_keys = self.metric.gate_keys_of(features);
        if let Some(detection_history) = &mut self.detection_history {
            let Perceived { observation, .. } = perceived;
            let observed_at = Instant::from_nanos(observation.observed_at_ns);
            detection_history.begin(number as usize, Interval::of(observation.source, observed_at));
        }
        self.fresh.push(number);
        Some(number)
    }

    /// Removes the beliefs of a step that was not finished; returns their number.
    pub(crate) fn rollback(&mut self) -> u64 {
        let mut dropped_things = 0;
        while let Some(slot) = self.fresh.pop() {
            self.free_slot(slot);
            dropped_things += 1;
        }
        dropped_things
    }

    /// Removes the beliefs of this step whose entry is not below `entries`; returns their number.
    pub(crate) fn truncate_entries(&mut self, entries: usize) -> u64 {
        let (before, chains) = (self.fresh.len(), &self.chains);
        let is_beyond =
            |slot: &u32| chains.get(*slot as usize).is_some_and(|it| it.entry as usize >= entries);
        // They are in the order of their entries.
        let kept = self.fresh.partition_point(|slot| !is_beyond(slot));
        while self.fresh.len() > kept
            && let Some(slot) = self.fresh.pop()
        {
            self.free_slot(slot);
        }
        u64::from(saturating_u32(before - kept))
    }

    /// Called once all beliefs of the step are created. `before` returns the instant of a source's frame that precedes
    /// the given one.
    pub(crate) fn set_previous_frame(&mut self, before: impl Fn(u16, Instant) -> Option<Instant>) {
        if let Some(detection_history) = &mut self.detection_history {
            detection_history.set_previous_frame(&self.fresh, before);
        }
    }

    /// Merges the belief in `gone` into the one in `kept` (M). `perceived` is the input of this step.
    fn merge(&mut self, kept: u32, gone: u32, perceived: &[Perceived]) {
        let are_two = kept != gone && self.is_live(kept) && self.is_live(gone);
        if !invariant!(are_two, "slots {kept} and {gone} have a belief each") {
            return;
        }
        if !self.append(kept, gone) {
            self.unite(kept, gone, perceived);
        }
        self.change(kept);
        if let Some(detection_history) = &mut self.detection_history {
            detection_history.merge(kept as usize, gone as usize);
        }
        self.free_slot(gone);
    }

    /// Fast path of the merge: the other belief is a snapshot newer than everything in `kept`. The new features are
    /// predicted; the histories are updated on commit. Returns `false`, with nothing changed, in any other case.
    fn append(&mut self, kept: u32, gone: u32) -> bool {
        if !self.predictable || !self.appends(kept, gone) {
            return false;
        }
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
        let terms = self.terms.len();
        let row = |slot: u32| slot as usize * terms..(slot as usize + 1) * terms;
        if let Ok([features, newer]) = self.features.get_disjoint_mut([row(kept), row(gone)]) {
            for ((feature, newer), percept) in features.iter_mut().zip(newer).zip(&self.terms) {
                if let Some(newer) = newer {
                    let newer = PerceptValue::new(*percept, 1.0, 1.0, *newer);
                    self.histories.predict_feature(*percept, feature, &newer);
                }
            }
            // The symbols are usually equal.
            if let Ok([gate_keys, newer]) = self.gate_keys.get_disjoint_mut([kept as usize, gone as usize])
                && (gate_keys != newer || !newer.are_complete())
            {
                *gate_keys = self.metric.gate_keys_of(features);
            }
        }
        true
    }

    fn unite(&mut self, kept: u32, gone: u32, perceived: &[Perceived]) {
        let (Some(row), Some(others)) = (self.remember(kept, perceived), self.remember(gone, perceived))
        else {
            return;
        };
        if let Ok([kept, gone]) = self.memories.get_disjoint_mut([kept as usize, gone as usize]) {
            kept.merge(gone);
            self.histories.merge(row, others, kept.id);
        }
        self.refresh(kept);
    }

    fn change(&mut self, slot: u32) {
        if let Some(version) = self.versions.get_mut(slot as usize) {
            *version = version.wrapping_add(1);
        }
    }

    /// Frees the slot and its row of histories.
    pub(crate) fn free_slot(&mut self, number: u32) {
        let Some(storage) = require!(self.storage.get_mut(number as usize), "slot {number} exists") else {
            return;
        };
        match std::mem::replace(storage, Storage::Nothing) {
            Storage::Nothing => {
                invariant!(false, "slot {number} is freed once");
                return;
            }
            Storage::Snapshot => {}
            Storage::Histories(row) => self.histories.free_row(row),
        }
        self.change(number);
        if let Some(detection_history) = &mut self.detection_history {
            detection_history.clear(number as usize);
        }
        self.free_list.put(number);
    }

    /// Commits the step after merging: updates the histories of the older beliefs, gives histories to the remaining new
    /// ones and appends them to the list. Returns the number of those.
    pub(crate) fn commit(&mut self, perceived: &[Perceived]) -> usize {
        self.compact();
        let old = self.live.len();
        for index in 0..old {
            let Some(&slot) = self.live.get(index) else { break };
            if let Some(&slot) = self.live.get(index + 2 * PREFETCH_DISTANCE) {
                self.prefetch(slot, false);
            }
            if let Some(&slot) = self.live.get(index + PREFETCH_DISTANCE) {
                self.prefetch(slot, true);
            }
            self.remember(slot, perceived);
        }
        self.commit_new(perceived)
    }

    /// Like [`Self::commit`], when all detections that merged are already in the histories of the older beliefs.
    pub(crate) fn commit_new(&mut self, perceived: &[Perceived]) -> usize {
        let old = self.live.len();
        for index in 0..self.fresh.len() {
            let Some(&slot) = self.fresh.get(index) else { break };
            if !self.is_live(slot) {
                continue;
            }
            if self.remember(slot, perceived).is_some() {
                self.live.push(slot);
            } else {
                // Neither in the list nor free, the slot would be lost.
                self.free_slot(slot);
            }
        }
        self.fresh.clear();
        self.live.len() - old
    }

    /// Whether there are too many beliefs for their data to stay in the cache.
    #[inline]
    fn exceeds_cache(&self) -> bool {
        self.live.len() > CACHE_RESIDENT_BELIEFS
    }

    /// If there are many beliefs, prefetches the headers of a belief's histories, or, if `soon`, the cells that it will
    /// write.
    #[inline(always)]
    fn prefetch(&self, slot: u32, soon: bool) {
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

    /// The histories of a committed belief.
    pub(crate) fn histories(&self, slot: u32) -> Option<(&Histories, u32)> {
        Some((&self.histories, require!(self.row(slot), "slot {slot} has histories")?))
    }

    /// The newest feature of a percept of a committed belief.
    #[inline]
    pub(crate) fn newest(&self, slot: u32, percept: u16) -> Option<Feature> {
        // Features that the metric compares are cached in a contiguous array.
        match self.terms.iter().position(|term| *term == percept) {
            Some(term) => self.features(slot).get(term).copied().flatten(),
            None => Some(self.histories.newest(self.row(slot)?, percept)?.feature),
        }
    }

    /// Mutable histories of a committed belief; the caller must [refresh](Self::refresh) the belief afterwards.
    pub(crate) fn histories_mut(&mut self, slot: u32) -> Option<(&mut Histories, u32)> {
        let row = require!(self.row(slot), "slot {slot} has histories")?;
        Some((&mut self.histories, row))
    }

    /// Recomputes the cached features and symbols of a belief from its histories.
    pub(crate) fn refresh(&mut self, slot: u32) {
        let Some(row) = require!(self.row(slot), "slot {slot} has histories") else { return };
        let features = self.features.iter_mut().skip(slot as usize * self.terms.len());
        for (feature, percept) in features.zip(&self.terms) {
            *feature = self.histories.newest(row, *percept).map(|sample| sample.feature);
        }
        let gate_keys = self.metric.gate_keys_of(self.features(slot));
        if let Some(held) = self.gate_keys.get_mut(slot as usize) {
            *held = gate_keys;
        }
    }

    fn row(&self, slot: u32) -> Option<u32> {
        match self.storage(slot) {
            Storage::Histories(row) => Some(row),
            Storage::Nothing | Storage::Snapshot => None,
        }
    }

    /// The row of histories of a belief, with all pending snapshots appended. A belief that was only a snapshot gets
    /// its row here.
    fn remember(&mut self, number: u32, perceived: &[Perceived]) -> Option<u32> {
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

    /// The complete contents of a belief, bit for bit, and its detection intervals.
    #[cfg(test)]
    pub(crate) fn contents(&self, slot: u32) -> String {
        let (histories, row) = self.histories(slot).unwrap();
        for (feature, percept) in self.features(slot).iter().zip(&self.terms) {
            let newest = histories.newest(row, *percept).map(|sample| sample.feature);
            assert_eq!(*feature, newest, "what was clustered by is what is remembered");
        }
        assert_eq!(self.gate_keys[slot as usize], self.metric.gate_keys_of(self.features(slot)));
        let detection_history = self
            .detection_history
            .as_ref()
            .map(|detection_history| detection_history.intervals(slot as usize));
        format!("{:?}\n{detection_history:?}\n{}", self.memory(slot).unwrap(), histories.contents(row))
    }
}

/// The evaluation of a percept in a snapshot, if it is valid. `prevalidated`: the caller has validated the snapshot.
#[inline(always)]
fn evaluation(snapshot: &Snapshot, percept: u16, prevalidated: bool) -> Option<&PerceptValue> {
    snapshot.value(percept).filter(|value| prevalidated || value.is_sound())
}
