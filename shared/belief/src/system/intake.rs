use clock::Instant;
use message::{Perceived, SourceSet};
use quantity::number::saturating_u32;

use super::BeliefSystem;
use crate::arena::{Arriving, Step};

/// A [step](BeliefSystem::step) under construction: the caller adds things one by one, as soon as each was perceived
/// and while it is in the cache. The step takes effect when it is [finished](Self::finish). If it is never finished,
/// the next step discards its things and counts them as [overflowed](crate::Counts::overflowed).
#[derive(Debug)]
#[must_use = "what is taken in is believed once the step is finished"]
pub struct Intake<'a> {
    pub(super) system: &'a mut BeliefSystem,
    first_new: u64,
}

impl BeliefSystem {
    /// Begins a step at `now`. If `now` is before the previous step, the previous step's instant is used, and this is
    /// counted.
    pub fn begin(&mut self, now: Instant) -> Intake<'_> {
        if now < self.now {
            self.counts.backwards += 1;
        }
        self.now = self.now.max(now);
        let forsaken = self.arena.forsake() + self.arrivals.keep_within(0);
        self.forsake(forsaken);
        // Several frames in one step need a more expensive association. The number of frames is assumed to be that of
        // the previous step.
        self.notes = self.arena.glances() && self.sources.frames() <= 1;
        self.sources.begin();
        Intake { first_new: self.next_id, system: self }
    }

    /// Takes back `things` that were added but never merged.
    fn forsake(&mut self, things: u64) {
        self.counts.created -= things;
        self.next_id -= things;
        self.counts.overflowed += things;
    }
}

impl Intake<'_> {
    /// Adds one thing, in the perspective's frame. `index` is its index in the slice given to [`Self::finish`] and is
    /// higher than those before it. A rejected observation is counted; one whose snapshot is empty creates nothing.
    pub fn take_in(&mut self, index: usize, perceived: &Perceived) {
        if self.system.arena.trusts() || self.system.look_through(perceived) {
            self.system.create(saturating_u32(index), perceived);
        }
    }

    /// Finishes the step: merges and culls. `perceived` holds all things that were added; `looked` and `in_view` are as
    /// for [`BeliefSystem::step`].
    pub fn finish(self, perceived: &[Perceived], looked: SourceSet, in_view: impl Fn([f32; 3]) -> bool) {
        let Self { system, first_new } = self;
        let settled = std::mem::replace(&mut system.settled, true);
        // Two things of one frame cannot be linked, and neither can beliefs that merged with them.
        let fresh_apart = system.arena.keeps_apart() && system.sources.frames() <= 1;
        let stayed = if system.notes {
            system.cluster_arrivals(first_new, perceived, settled, fresh_apart)
        } else {
            let BeliefSystem { arena, clustering, sources, .. } = &mut *system;
            arena.follow(|source, at| sources.before(source, at));
            system.counts.merged += clustering.run(&mut Step { arena, perceived }, settled, fresh_apart);
            system.arena.settle(perceived)
        };
        for stayed in system.len() - stayed..system.len() {
            system.place(stayed);
        }
        system.cull(looked, in_view);
        system.evict();
        system.number(first_new);
    }
}

impl BeliefSystem {
    /// Clusters the collected detections and commits the result; returns the number of new beliefs that remain.
    fn cluster_arrivals(
        &mut self,
        first_new: u64,
        perceived: &[Perceived],
        settled: bool,
        fresh_apart: bool,
    ) -> usize {
        let lost = self.arrivals.keep_within(perceived.len());
        self.forsake(lost);
        let Self { arena, arrivals, clustering, sources, .. } = self;
        let mut matched = None;
        if settled && fresh_apart {
            arrivals.follow(arena, |source, at| sources.before(source, at));
            let step = Step { arena: &mut *arena, perceived };
            matched = clustering.run_matched(&mut Arriving { step, arrivals, first_new, now: self.now });
        }
        // Creates beliefs from the unmatched detections.
        arrivals.admit(arena, first_new, self.now, perceived);
        arena.follow(|source, at| sources.before(source, at));
        let (merged, stayed) = match matched {
            Some(merged) => (merged, arena.settle_fresh(perceived)),
            None => {
                let step = &mut Step { arena: &mut *arena, perceived };
                (clustering.run_unmatched(step, settled, fresh_apart), arena.settle(perceived))
            }
        };
        self.counts.merged += merged;
        stayed
    }
}
