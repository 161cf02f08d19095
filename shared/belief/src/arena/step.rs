use invariant::require;
use message::Perceived;

use super::{Arena, Storage};
use crate::cluster::{AssociationProblem, GateKeys, MemberSummary};
use crate::detection_history::Interval;
use crate::metric::Gate;

/// The association problem of a step: the beliefs, and the things perceived.
pub(crate) struct Step<'a> {
    pub(crate) arena: &'a mut Arena,
    pub(crate) perceived: &'a [Perceived],
}

impl AssociationProblem for Step<'_> {
    #[inline]
    fn old(&self) -> &[u32] {
        &self.arena.live
    }

    #[inline]
    fn fresh(&self) -> &[u32] {
        &self.arena.fresh
    }

    fn is_live(&self, slot: u32) -> bool {
        self.arena.is_live(slot)
    }

    #[inline]
    fn id(&self, slot: u32) -> u64 {
        require!(self.arena.memory(slot), "slot {slot} exists").map_or(0, |memory| memory.id)
    }

    fn version(&self, slot: u32) -> u32 {
        require!(self.arena.versions.get(slot as usize), "slot {slot} exists").copied().unwrap_or(0)
    }

    #[inline]
    fn place(&self, slot: u32) -> Option<[f32; 3]> {
        let Gate { term, .. } = self.arena.gate?;
        self.arena.features(slot).get(term).copied().flatten()?.vector()
    }

    #[inline]
    fn gate_keys(&self, slot: u32) -> GateKeys {
        let gate_keys = require!(self.arena.gate_keys.get(slot as usize), "slot {slot} exists");
        gate_keys.copied().unwrap_or(GateKeys::NONE)
    }

    fn distance(&self, a: u32, b: u32) -> Option<f64> {
        let Arena { metric, detection_history, .. } = &*self.arena;
        let distance = metric.below_threshold(self.arena.features(a), self.arena.features(b))?;
        let apart = detection_history
            .as_ref()
            .is_some_and(|detection_history| detection_history.cannot_link(a as usize, b as usize));
        (!apart).then_some(distance)
    }

    #[inline]
    fn gated_distance(
        &self,
        (a, of_a): (u32, &MemberSummary),
        (b, of_b): (u32, &MemberSummary),
    ) -> Option<f64> {
        let Some(distance) = self.arena.distance_from_summaries(of_a, of_b) else {
            return self.distance(a, b);
        };
        let detection_history = self.arena.detection_history.as_ref();
        let is_apart =
            |_: &f64| !detection_history.is_some_and(|seen| seen.cannot_link(a as usize, b as usize));
        distance.filter(is_apart)
    }

    #[inline]
    fn gate_radius_m(&self, distance: f64) -> f64 {
        // Margin for the rounding of a sum of several terms.
        self.arena.gate.map_or(f64::INFINITY, |gate| distance * gate.metres_per_distance * (1.0 + 1e-9))
    }

    #[inline]
    fn is_convex_merge(&self, old: u32, fresh: u32) -> bool {
        let arena = &*self.arena;
        arena.predictable
            && arena.appends(old, fresh)
            && arena.keeps_gate_keys(old, self.gate_keys(fresh), || Some(arena.features(fresh)))
    }

    #[inline]
    fn co_detected(&self, old: u32) -> bool {
        self.arena
            .detection_history
            .as_ref()
            .is_some_and(|detection_history| detection_history.was_in_previous_frame(old as usize))
    }

    fn remains_cannot_link(&self, a: u32, b: u32) -> bool {
        self.arena
            .detection_history
            .as_ref()
            .is_some_and(|detection_history| detection_history.remains_cannot_link(a as usize, b as usize))
    }

    fn frame(&self, fresh: u32) -> Option<(u16, u64)> {
        let Interval { source, first, .. } =
            self.arena.detection_history.as_ref()?.intervals(fresh as usize).first()?;
        Some((*source, first.as_nanos()))
    }

    fn diameter_bound(&self, members: &[u32]) -> Option<f64> {
        let Arena { predictable, metric, detection_history, .. } = &*self.arena;
        let (&oldest, others) = members.split_first()?;
        let has_room = detection_history.as_ref()?.has_room_for(oldest as usize, others.len());
        // A snapshot has no samples that could lie between the others.
        let is_snapshot = self.arena.storage(oldest) == Storage::Snapshot;
        let all_newer = is_snapshot || others.iter().all(|&slot| self.arena.appends(oldest, slot));
        let bound = metric.diameter_bound(&members.iter().map(|&slot| self.arena.features(slot)));
        bound.filter(|_| *predictable && has_room && all_newer)
    }

    fn merge(&mut self, kept: u32, gone: u32) {
        self.arena.merge(kept, gone, self.perceived);
    }
}
