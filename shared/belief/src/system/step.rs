use invariant::require;
use message::Perceived;

use super::beliefs::Beliefs;
use crate::association::{AssociationProblem, GateKeys, Interval, MemberSummary};

/// The association problem of a step: the beliefs, and the things perceived.
pub(crate) struct Step<'a> {
    pub(crate) beliefs: &'a mut Beliefs,
    pub(crate) perceived: &'a [Perceived],
    /// Beliefs with lower identities are of earlier steps.
    pub(crate) first_new: u64,
}

impl Step<'_> {
    /// Whether two beliefs are never merged by their distance alone: with tracks, two of earlier steps.
    #[inline]
    fn needs_evidence(&self, a: u32, b: u32) -> bool {
        let is_old = |slot| self.id(slot) < self.first_new;
        self.beliefs.features.tracking().is_some() && is_old(a) && is_old(b)
    }
}

impl AssociationProblem for Step<'_> {
    #[inline]
    fn old(&self) -> &[u32] {
        self.beliefs.arena.live()
    }

    #[inline]
    fn fresh(&self) -> &[u32] {
        self.beliefs.arena.fresh()
    }

    fn is_live(&self, slot: u32) -> bool {
        self.beliefs.arena.is_live(slot)
    }

    #[inline]
    fn id(&self, slot: u32) -> u64 {
        require!(self.beliefs.arena.memory(slot), "slot {slot} exists").map_or(0, |memory| memory.id)
    }

    fn version(&self, slot: u32) -> u32 {
        self.beliefs.arena.version(slot).unwrap_or(0)
    }

    #[inline]
    fn place(&self, slot: u32) -> Option<[f32; 3]> {
        self.beliefs.features.place(slot)
    }

    #[inline]
    fn gate_keys(&self, slot: u32) -> GateKeys {
        self.beliefs.features.gate_keys(slot)
    }

    fn distance(&self, a: u32, b: u32) -> Option<f64> {
        if self.needs_evidence(a, b) { None } else { self.beliefs.distance(a, b) }
    }

    #[inline]
    fn gated_distance(
        &self,
        (a, of_a): (u32, &MemberSummary),
        (b, of_b): (u32, &MemberSummary),
    ) -> Option<f64> {
        let Some(distance) = self.beliefs.features.distance_from_summaries(of_a, of_b) else {
            return self.distance(a, b);
        };
        distance.filter(|_| !self.needs_evidence(a, b) && !self.beliefs.cannot_link(a, b))
    }

    #[inline]
    fn gate_radius_m(&self, distance: f64) -> f64 {
        // Margin for the rounding of a sum of several terms.
        self.beliefs
            .features
            .gate()
            .map_or(f64::INFINITY, |gate| distance * gate.metres_per_distance * (1.0 + 1e-9))
    }

    #[inline]
    fn is_convex_merge(&self, old: u32, fresh: u32) -> bool {
        let Beliefs { features, .. } = &*self.beliefs;
        self.beliefs.appends(old, fresh)
            && features.keeps_gate_keys(old, features.gate_keys(fresh), || Some(features.of(fresh)))
    }

    #[inline]
    fn co_detected(&self, old: u32) -> bool {
        self.beliefs
            .detection_history
            .as_ref()
            .is_some_and(|detection_history| detection_history.was_in_previous_frame(old as usize))
    }

    fn remains_cannot_link(&self, a: u32, b: u32) -> bool {
        let detection_history = self.beliefs.detection_history.as_ref();
        self.needs_evidence(a, b)
            || detection_history.is_some_and(|seen| seen.remains_cannot_link(a as usize, b as usize))
    }

    fn frame(&self, fresh: u32) -> Option<(u16, u64)> {
        let Interval { source, first, .. } =
            self.beliefs.detection_history.as_ref()?.intervals(fresh as usize).first()?;
        Some((*source, first.as_nanos()))
    }

    fn diameter_bound(&self, members: &[u32]) -> Option<f64> {
        let Beliefs { arena, features, detection_history } = &*self.beliefs;
        let (&oldest, others) = members.split_first()?;
        let has_room = detection_history.as_ref()?.has_room_for(oldest as usize, others.len());
        // A snapshot has no samples that could lie between the others.
        let all_newer = arena.is_snapshot(oldest) || others.iter().all(|&slot| arena.appends(oldest, slot));
        let bound = features.diameter_bound(members);
        bound.filter(|_| features.are_predictable() && has_room && all_newer)
    }

    fn merge(&mut self, kept: u32, gone: u32) {
        self.beliefs.merge(kept, gone, self.perceived);
    }
}
