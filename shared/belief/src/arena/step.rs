use message::Perceived;

use super::{Arena, Holds};
use crate::cluster::{Population, Seen, Symbols};
use crate::metric::Reach;
use crate::sightings::Run;

/// The association problem of a step: the beliefs, and the things perceived.
pub(crate) struct Step<'a> {
    pub(crate) arena: &'a mut Arena,
    pub(crate) perceived: &'a [Perceived],
}

impl Population for Step<'_> {
    #[inline]
    fn old(&self) -> &[u32] {
        &self.arena.live
    }

    #[inline]
    fn fresh(&self) -> &[u32] {
        &self.arena.fresh
    }

    fn lives(&self, slot: u32) -> bool {
        self.arena.lives(slot)
    }

    #[inline]
    fn id(&self, slot: u32) -> u64 {
        self.arena.memory(slot).map_or(0, |memory| memory.id)
    }

    fn version(&self, slot: u32) -> u32 {
        self.arena.versions.get(slot as usize).copied().unwrap_or(0)
    }

    #[inline]
    fn place(&self, slot: u32) -> Option<[f32; 3]> {
        let Reach { term, .. } = self.arena.reach?;
        self.arena.features(slot).get(term).copied().flatten()?.vector()
    }

    #[inline]
    fn symbols(&self, slot: u32) -> Symbols {
        self.arena.symbols.get(slot as usize).copied().unwrap_or(Symbols::NONE)
    }

    fn distance(&self, a: u32, b: u32) -> Option<f64> {
        let Arena { metric, sightings, .. } = &*self.arena;
        let distance = metric.below_threshold(self.arena.features(a), self.arena.features(b))?;
        let apart = sightings.as_ref().is_some_and(|sightings| sightings.are_apart(a as usize, b as usize));
        (!apart).then_some(distance)
    }

    #[inline]
    fn distance_seen(&self, (a, of_a): (u32, &Seen), (b, of_b): (u32, &Seen)) -> Option<f64> {
        let Some(distance) = self.arena.distance_at_a_glance(of_a, of_b) else { return self.distance(a, b) };
        let sightings = self.arena.sightings.as_ref();
        let is_apart = |_: &f64| !sightings.is_some_and(|seen| seen.are_apart(a as usize, b as usize));
        distance.filter(is_apart)
    }

    #[inline]
    fn reach_m(&self, distance: f64) -> f64 {
        // Margin for the rounding of a sum of several terms.
        self.arena.reach.map_or(f64::INFINITY, |reach| distance * reach.metres_per_distance * (1.0 + 1e-9))
    }

    #[inline]
    fn takes_in(&self, old: u32, fresh: u32) -> bool {
        let arena = &*self.arena;
        arena.foreseen
            && arena.appends(old, fresh)
            && arena.keeps_symbols(old, self.symbols(fresh), || Some(arena.features(fresh)))
    }

    #[inline]
    fn is_companion(&self, old: u32) -> bool {
        self.arena.sightings.as_ref().is_some_and(|sightings| sightings.was_there(old as usize))
    }

    fn stay_apart(&self, a: u32, b: u32) -> bool {
        self.arena.sightings.as_ref().is_some_and(|sightings| sightings.stay_apart(a as usize, b as usize))
    }

    fn frame(&self, fresh: u32) -> Option<(u16, u64)> {
        let Run { source, first, .. } = self.arena.sightings.as_ref()?.runs(fresh as usize).first()?;
        Some((*source, first.as_nanos()))
    }

    fn spread(&self, members: &[u32]) -> Option<f64> {
        let Arena { foreseen, metric, sightings, .. } = &*self.arena;
        let (&oldest, others) = members.split_first()?;
        let has_room = sightings.as_ref()?.has_room_for(oldest as usize, others.len());
        // A snapshot has no samples that could lie between the others.
        let is_snapshot = self.arena.holds(oldest) == Holds::Snapshot;
        let all_newer = is_snapshot || others.iter().all(|&slot| self.arena.appends(oldest, slot));
        let bound = metric.spread(&members.iter().map(|&slot| self.arena.features(slot)));
        bound.filter(|_| *foreseen && has_room && all_newer)
    }

    fn merge(&mut self, kept: u32, gone: u32) {
        self.arena.merge(kept, gone, self.perceived);
    }
}
