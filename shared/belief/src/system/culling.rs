//! Culling: which beliefs are given up.

use invariant::require;
use message::SourceSet;

use super::belief_system::BeliefSystem;
use super::cull::CullContext;
use super::cull_fn::CullFn;
use crate::storage::Memory;

impl BeliefSystem {
    /// C: removes the beliefs on which all culling functions agree (Eq. 5).
    pub(super) fn cull(&mut self, active_sources: SourceSet, in_view: impl Fn([f32; 3]) -> bool) {
        let announces = self.announces_later();
        if self.cull.is_empty() && !announces {
            return;
        }
        let watches = self.cull.iter().any(|cull| matches!(cull, CullFn::PlaceEmptyFor(_)));
        let culled = self.counts.culled;
        for index in 0..self.live_len() {
            let Some(&slot) = self.beliefs.arena.live().get(index) else { break };
            if watches {
                self.update_empty_since(slot, active_sources, &in_view);
            }
            let agree = !self.cull.is_empty()
                && self.cull.iter().all(|cull| self.agrees(cull, slot, active_sources, &in_view));
            if agree || (announces && self.is_unconfirmed(slot, active_sources, &in_view)) {
                self.free_slot(slot);
                self.counts.culled += 1;
            }
        }
        if self.counts.culled > culled {
            self.beliefs.arena.compact();
        }
    }

    /// Updates since when the position of a belief is empty. If no source that ever saw the thing delivered a frame in
    /// this step, the state is unchanged, as between two images of a slow camera.
    fn update_empty_since(
        &mut self,
        slot: u32,
        active_sources: SourceSet,
        in_view: impl Fn([f32; 3]) -> bool,
    ) {
        let (now, observing_since) = (self.now, self.observing_since);
        let Some(memory) = require!(self.beliefs.arena.memory(slot), "slot {slot} is live") else { return };
        // Whatever is at that position now was not associated with this belief, so the position counts as empty.
        if memory.updated_at >= now || !active_sources.intersects(memory.seen_by) {
            return;
        }
        // A thing that moves is not missing where it was, but where it is expected.
        let is_empty = !self.is_hidden(slot) && self.expected_place_of(slot).is_some_and(in_view);
        if let Some(memory) = self.beliefs.arena.memory_mut(slot) {
            let since = memory.empty_since.filter(|since| *since >= observing_since).unwrap_or(now);
            memory.empty_since = is_empty.then_some(since);
        }
    }

    /// Evaluates a culling function c for a belief.
    fn agrees(
        &self,
        cull: &CullFn,
        slot: u32,
        active_sources: SourceSet,
        in_view: impl Fn([f32; 3]) -> bool,
    ) -> bool {
        let Some(memory) = require!(self.beliefs.arena.memory(slot), "slot {slot} is live") else {
            return false;
        };
        match cull {
            // In nanoseconds, because this is evaluated for every belief in every step.
            CullFn::UnseenLongerThan(limit_ns) => {
                self.now.as_nanos().saturating_sub(memory.updated_at.as_nanos()) > *limit_ns
            }
            CullFn::ConfidenceBelow { percept, floor } => {
                let decay =
                    self.percepts.get(usize::from(*percept)).map_or(0.0, |percept| percept.decay_per_s);
                let histories = self.beliefs.arena.histories(slot);
                let remembered =
                    histories.and_then(|(histories, row)| histories.at(row, *percept, self.now, decay));
                remembered.is_none_or(|sample| f64::from(sample.confidence) < *floor)
            }
            // Without a frame in this step the thing may have come back, so the belief stays.
            CullFn::PlaceEmptyFor(time) => {
                let is_empty_for = |since| self.now.since(since) >= *time;
                active_sources.intersects(memory.seen_by) && memory.empty_since.is_some_and(is_empty_for)
            }
            CullFn::Plugin(plugin) => {
                let remembered = |number: u16| {
                    let decay = self.percepts.get(usize::from(number))?.decay_per_s;
                    let (histories, row) = self.beliefs.arena.histories(slot)?;
                    histories.at(row, number, self.now, decay)
                };
                plugin.agrees(&CullContext {
                    now: self.now,
                    memory,
                    place: self.place_of(slot),
                    remembered: &remembered,
                    in_view: &|place| {
                        active_sources.intersects(memory.seen_by) && !self.is_hidden(slot) && in_view(place)
                    },
                })
            }
        }
    }

    /// Whether a belief that is not announced yet was not observed where it should have been.
    fn is_unconfirmed(
        &self,
        slot: u32,
        active_sources: SourceSet,
        in_view: impl Fn([f32; 3]) -> bool,
    ) -> bool {
        let is_missed = |memory: &Memory| {
            !memory.is_announced && memory.updated_at < self.now && active_sources.intersects(memory.seen_by)
        };
        let is_missed = self.beliefs.arena.memory(slot).is_some_and(is_missed);
        is_missed && !self.is_hidden(slot) && self.expected_place_of(slot).is_some_and(in_view)
    }

    /// Removes the beliefs beyond the capacity, the youngest first.
    pub(super) fn evict(&mut self) {
        for index in self.capacity..self.live_len() {
            let Some(&slot) = self.beliefs.arena.live().get(index) else { break };
            self.counts.evicted += 1;
            self.counts.overflowed += self.beliefs.arena.memory(slot).map_or(0, |memory| memory.observations);
            self.free_slot(slot);
        }
        if self.live_len() > self.capacity {
            self.beliefs.arena.compact();
        }
    }
}
