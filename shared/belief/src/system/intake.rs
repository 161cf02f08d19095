use clock::Instant;
use message::{Perceived, SourceSet};
use quantity::number::saturating_u32;

use super::BeliefSystem;
use crate::arena::{Arriving, Step};

/// A [step](BeliefSystem::step) that has begun: things are taken in one by one, each as soon as it was
/// perceived and while it is at hand. It counts once it is [finished](Self::finish); what was taken in by one
/// that never is is forgotten when the next one begins, and counted as [overflowed](crate::Counts::overflowed).
#[derive(Debug)]
#[must_use = "what is taken in is believed once the step is finished"]
pub struct Intake<'a> {
    pub(super) system: &'a mut BeliefSystem,
    first_new: u64,
}

impl BeliefSystem {
    /// Begins a step at `now`; an instant before that of the step before is taken as the latter, and counted.
    pub fn begin(&mut self, now: Instant) -> Intake<'_> {
        if now < self.now {
            self.counts.backwards += 1;
        }
        self.now = self.now.max(now);
        let forsaken = self.arena.forsake() + self.arrivals.keep_within(0);
        self.forsake(forsaken);
        // Of several frames it takes more to find out who becomes whom: as a rule there are as many every time.
        self.notes = self.arena.glances() && self.sources.frames() <= 1;
        self.sources.begin();
        Intake { first_new: self.next_id, system: self }
    }

    /// So many things were taken in for nothing.
    fn forsake(&mut self, things: u64) {
        self.counts.created -= things;
        self.next_id -= things;
        self.counts.overflowed += things;
    }
}

impl Intake<'_> {
    /// Takes in one thing, in the perspective's frame: that at `index`, higher than those before it, of what
    /// [`Self::finish`] is told. An observation that may not enter is counted; one whose snapshot is empty
    /// creates nothing.
    pub fn take_in(&mut self, index: usize, perceived: &Perceived) {
        if self.system.arena.trusts() || self.system.look_through(perceived) {
            self.system.create(saturating_u32(index), perceived);
        }
    }

    /// Finishes the step: merges, culls. `perceived` holds all that was taken in; `looked` and `in_view` are as
    /// for [`BeliefSystem::step`].
    pub fn finish(self, perceived: &[Perceived], looked: SourceSet, in_view: impl Fn([f32; 3]) -> bool) {
        let Self { system, first_new } = self;
        let settled = std::mem::replace(&mut system.settled, true);
        // What one source sees at one instant is apart, and so is whatever takes any of it in.
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
    /// Clusters what was noted only, and settles; how many are new and stay.
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
        // Those that nobody has taken in.
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
