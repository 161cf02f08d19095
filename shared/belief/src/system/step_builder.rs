use clock::Instant;
use message::{Perceived, SourceSet};
use quantity::number::saturating_u32;

use super::BeliefSystem;
use crate::arena::{FrameAssociation, Step};

/// A [step](BeliefSystem::step) under construction: the caller adds things one by one, as soon as each was perceived
/// and while it is in the cache. The step takes effect when it is [finished](Self::finish). If it is never finished,
/// the next step discards its things and counts them as [overflowed](crate::Counts::overflowed).
#[derive(Debug)]
#[must_use = "what is taken in is believed once the step is finished"]
pub struct StepBuilder<'a> {
    pub(super) system: &'a mut BeliefSystem,
    first_new: u64,
}

impl BeliefSystem {
    /// Begins a step at `now`. If `now` is before the previous step, the previous step's instant is used, and this is
    /// counted.
    pub fn begin(&mut self, now: Instant) -> StepBuilder<'_> {
        if now < self.now {
            self.counts.backwards += 1;
        }
        self.now = self.now.max(now);
        let dropped_things = self.arena.rollback() + self.detections.truncate_entries(0);
        self.rollback(dropped_things);
        // Several frames in one step need a more expensive association. The number of frames is assumed to be that of
        // the previous step.
        self.defers_creation = self.arena.can_associate_by_summary() && self.sources.frames() <= 1;
        self.sources.begin();
        StepBuilder { first_new: self.next_id, system: self }
    }

    /// Takes back `things` that were added but never merged.
    fn rollback(&mut self, things: u64) {
        self.counts.created -= things;
        self.next_id -= things;
        self.counts.overflowed += things;
    }
}

impl StepBuilder<'_> {
    /// Adds one thing, in the perspective's frame. `index` is its index in the slice given to [`Self::finish`] and is
    /// higher than those before it. A rejected observation is counted; one whose snapshot is empty creates nothing.
    pub fn add_observation(&mut self, index: usize, perceived: &Perceived) {
        if self.system.arena.prevalidated() || self.system.validate(perceived) {
            self.system.create(saturating_u32(index), perceived);
        }
    }

    /// Finishes the step: merges and culls. `perceived` holds all things that were added; `active_sources` and `in_view` are as
    /// for [`BeliefSystem::step`].
    pub fn finish(
        self,
        perceived: &[Perceived],
        active_sources: SourceSet,
        in_view: impl Fn([f32; 3]) -> bool,
    ) {
        let Self { system, first_new } = self;
        let is_clustered = std::mem::replace(&mut system.is_clustered, true);
        // Two things of one frame cannot be linked, and neither can beliefs that merged with them.
        let detections_cannot_link = system.arena.has_cannot_link() && system.sources.frames() <= 1;
        let remaining = if system.defers_creation {
            system.cluster_detections(first_new, perceived, is_clustered, detections_cannot_link)
        } else {
            let lost = system.arena.truncate_entries(perceived.len());
            system.rollback(lost);
            let BeliefSystem { arena, clustering, sources, .. } = &mut *system;
            arena.set_previous_frame(|source, at| sources.before(source, at));
            system.counts.merged +=
                clustering.run(&mut Step { arena, perceived }, is_clustered, detections_cannot_link);
            system.arena.commit(perceived)
        };
        for remaining in system.len() - remaining..system.len() {
            system.place(remaining);
        }
        system.cull(active_sources, in_view);
        system.evict();
        system.number(first_new);
    }
}

impl BeliefSystem {
    /// Clusters the collected detections and commits the result; returns the number of new beliefs that remain.
    fn cluster_detections(
        &mut self,
        first_new: u64,
        perceived: &[Perceived],
        is_clustered: bool,
        detections_cannot_link: bool,
    ) -> usize {
        let lost = self.detections.truncate_entries(perceived.len());
        self.rollback(lost);
        let Self { arena, detections, clustering, sources, .. } = self;
        let mut matched = None;
        if is_clustered && detections_cannot_link {
            detections.set_previous_frame(arena, |source, at| sources.before(source, at));
            let step = Step { arena: &mut *arena, perceived };
            matched =
                clustering.run_matched(&mut FrameAssociation { step, detections, first_new, now: self.now });
        }
        // Creates beliefs from the unmatched detections.
        detections.admit(arena, first_new, self.now, perceived);
        arena.set_previous_frame(|source, at| sources.before(source, at));
        let (merged, remaining) = match matched {
            Some(merged) => (merged, arena.commit_new(perceived)),
            None => {
                let step = &mut Step { arena: &mut *arena, perceived };
                (
                    clustering.run_unmatched(step, is_clustered, detections_cannot_link),
                    arena.commit(perceived),
                )
            }
        };
        self.counts.merged += merged;
        remaining
    }
}
