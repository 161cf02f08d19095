use clock::Instant;
use message::{Perceived, SourceSet};
use quantity::number::saturating_u32;

use super::BeliefSystem;
use crate::arena::Step;

/// A [step](BeliefSystem::step) that has begun: things are taken in one by one, each as soon as it was
/// perceived and while it is at hand. It counts once it is [finished](Self::finish); what was taken in by one
/// that never is is forgotten when the next one begins, and counted as [overflowed](crate::Counts::overflowed).
#[derive(Debug)]
#[must_use = "what is taken in is believed once the step is finished"]
pub struct Intake<'a> {
    system: &'a mut BeliefSystem,
    first_new: u64,
}

impl BeliefSystem {
    /// Begins a step at `now`; an instant before that of the step before is taken as the latter, and counted.
    pub fn begin(&mut self, now: Instant) -> Intake<'_> {
        if now < self.now {
            self.counts.backwards += 1;
        }
        self.now = self.now.max(now);
        let forsaken = self.arena.forsake();
        self.counts.created -= forsaken;
        self.next_id -= forsaken;
        self.counts.overflowed += forsaken;
        self.sources.begin();
        Intake { first_new: self.next_id, system: self }
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
        let BeliefSystem { arena, clustering, sources, settled, .. } = &mut *system;
        arena.follow(|source, at| sources.before(source, at));
        let settled = std::mem::replace(settled, true);
        // What one source sees at one instant is apart, and so is whatever takes any of it in.
        let fresh_apart = arena.keeps_apart() && sources.frames() <= 1;
        system.counts.merged += clustering.run(&mut Step { arena, perceived }, settled, fresh_apart);
        let stayed = system.arena.settle(perceived);
        for stayed in system.len() - stayed..system.len() {
            system.place(stayed);
        }
        system.cull(looked, in_view);
        system.evict();
        system.number(first_new);
    }
}
