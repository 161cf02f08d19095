//! Tracking: what prediction adds to a step. Without [`Tracking`](super::percepts::Tracking) none of it does anything.

use clock::Instant;
use invariant::require;
use message::Perceived;
use quantity::number::single;

use super::belief_system::BeliefSystem;
use super::continuation::Continuation;
use super::evidence::Evidence;
use crate::association::Motion;

impl BeliefSystem {
    /// Compares every belief by the position that is expected when the first frame of the step was taken.
    pub(super) fn expect(&mut self) {
        if self.beliefs.features.tracking().is_none() {
            return;
        }
        let Some(instant) = self.sources.first_frame() else { return };
        for index in 0..self.live_len() {
            let Some(&slot) = self.beliefs.arena.live().get(index) else { break };
            self.beliefs.features.expect_at(slot, instant);
            self.place_slot(slot);
        }
    }

    /// Merges the remaining detections with beliefs whose [track they
    /// continue](super::beliefs::Beliefs::distance_along_track). Returns the number of merges.
    ///
    /// The nearest pair is merged first. A thing seen once may have any velocity, so a fast one is found here; so is one
    /// that comes out from behind an occluder.
    pub(super) fn continue_tracks(
        &mut self,
        perceived: &[Perceived],
        in_view: impl Fn([f32; 3]) -> bool,
    ) -> u64 {
        let mut merged = 0;
        if self.beliefs.features.tracking().is_none() || self.beliefs.detection_history.is_none() {
            return merged;
        }
        loop {
            self.find_continuations(&in_view);
            if self.continuations.is_empty() {
                return merged;
            }
            self.continuations.sort_unstable_by(|a, b| {
                a.distance.total_cmp(&b.distance).then((a.old, a.fresh).cmp(&(b.old, b.fresh)))
            });
            for index in 0..self.continuations.len() {
                let Some(&Continuation { old, fresh, .. }) = self.continuations.get(index) else { break };
                // An earlier pair of this round may have taken one of the two.
                if self.beliefs.distance_along_track(old, fresh, &in_view).is_some() {
                    self.beliefs.merge(old, fresh, perceived);
                    self.clustering.remove_member(fresh);
                    self.place_slot(old);
                    merged += 1;
                }
            }
        }
    }

    /// Finds for each remaining detection the nearest track that it may continue.
    fn find_continuations(&mut self, in_view: impl Fn([f32; 3]) -> bool) {
        self.continuations.clear();
        for &fresh in self.beliefs.arena.fresh() {
            let mut nearest: Option<Continuation> = None;
            for &old in self.beliefs.arena.live() {
                let Some(distance) = self.beliefs.distance_along_track(old, fresh, &in_view) else {
                    continue;
                };
                if nearest.is_none_or(|nearest| distance < nearest.distance) {
                    nearest = Some(Continuation { distance, old, fresh });
                }
            }
            if let Some(nearest) = nearest {
                self.continuations.push(nearest);
            }
        }
    }

    /// Merges two beliefs of one thing: one is observed where the other is expected, whose position is in view and
    /// empty, in a configured number of steps in a row.
    ///
    /// Two beliefs of earlier steps are not merged otherwise: a hidden thing is not the one that passes it.
    pub(super) fn merge_by_evidence(&mut self, in_view: impl Fn([f32; 3]) -> bool) {
        let Some(tracking) = self.beliefs.features.tracking() else { return };
        let merge_after = tracking.merge_after.max(1);
        if self.sources.first_frame().is_none() {
            return;
        }
        let merged = self.counts.merged;
        for index in 0..self.live_len() {
            let Some(&slot) = self.beliefs.arena.live().get(index) else { break };
            let other = self.observed_instead_of(slot, &in_view);
            let of = other.and_then(|other| self.beliefs.arena.memory(other)).map_or(0, |memory| memory.id);
            let evidence = require!(self.evidence.get_mut(slot as usize), "slot {slot} has evidence");
            let Some(evidence) = evidence else { continue };
            let before = if evidence.of == of { evidence.steps } else { 0 };
            *evidence = Evidence { of, steps: before.saturating_add(1) };
            if let Some(other) = other
                && evidence.steps >= merge_after
            {
                self.merge_old(slot, other);
            }
        }
        if self.counts.merged > merged {
            self.beliefs.arena.compact();
        }
    }

    /// The nearest belief that is observed in this step within the gate of an unobserved one whose expected position is
    /// in view.
    fn observed_instead_of(&self, slot: u32, in_view: impl Fn([f32; 3]) -> bool) -> Option<u32> {
        let is_observed =
            |slot: u32| self.beliefs.arena.memory(slot).is_some_and(|memory| memory.updated_at >= self.now);
        if !self.beliefs.arena.is_live(slot) || is_observed(slot) || self.is_hidden(slot) {
            return None;
        }
        let place = self.beliefs.features.place(slot)?;
        let mut nearest: Option<(f64, u32)> = None;
        self.clustering.for_each_within_gate(slot, |other| {
            if is_observed(other)
                && let Some(distance) = self.beliefs.distance(slot, other)
                && nearest.is_none_or(|(least, _)| distance < least)
            {
                nearest = Some((distance, other));
            }
        });
        nearest.filter(|_| in_view(place)).map(|(_, other)| other)
    }

    /// Merges two beliefs of earlier steps. The older identity survives.
    fn merge_old(&mut self, a: u32, b: u32) {
        let id = |slot: u32| self.beliefs.arena.memory(slot).map(|memory| memory.id);
        let (kept, gone) = if id(a) < id(b) { (a, b) } else { (b, a) };
        self.clustering.remove_member(gone);
        self.beliefs.merge(kept, gone, &[]);
        self.place_slot(kept);
        self.counts.merged += 1;
    }

    /// The position at which a thing is expected now; the remembered one without tracks.
    pub(super) fn expected_place_of(&self, slot: u32) -> Option<[f32; 3]> {
        match self.beliefs.features.motion(slot, self.now) {
            Some(motion) => Some(motion.position_m),
            None => self.place_of(slot),
        }
    }

    /// Whether a belief may be announced later than at its first sighting.
    pub(super) fn announces_later(&self) -> bool {
        self.beliefs.features.tracking().is_some_and(|tracking| tracking.announce_after > 1)
    }

    /// The slots of the announced beliefs in order of their identities.
    pub(super) fn announced(&self) -> &[u32] {
        if self.announces_later() { &self.announced } else { self.beliefs.arena.live() }
    }

    /// Announces the beliefs of which enough was observed.
    pub(super) fn announce(&mut self) {
        let Some(tracking) = self.beliefs.features.tracking().filter(|tracking| tracking.announce_after > 1)
        else {
            return;
        };
        let (after, confidence) = (u64::from(tracking.announce_after), single(tracking.announce_confidence));
        let begins = self.sources.is_any_new(after);
        self.announced.clear();
        for index in 0..self.live_len() {
            let Some(&slot) = self.beliefs.arena.live().get(index) else { break };
            let Some(memory) = self.beliefs.arena.memory_mut(slot) else { continue };
            memory.is_announced |= memory.observations >= after
                || memory.confidence >= confidence
                || (begins && memory.updated_at >= self.now);
            if memory.is_announced {
                self.announced.push(slot);
            }
        }
    }

    /// The motion expected of the belief at `index` in order of the identities, in the perspective's frame. `None` if
    /// positions are not predicted, or the belief has none.
    #[must_use]
    pub fn motion(&self, index: usize, instant: Instant) -> Option<Motion> {
        self.beliefs.features.motion(*self.announced().get(index)?, instant)
    }
}
