use clock::{Duration, Instant};
use invariant::require;
use message::{ObservationKind, Perceived, PerceptValue, SourceSet};
use quantity::number::saturating_u32;

use super::belief_system::BeliefSystem;
use super::detections::FrameAssociation;
use super::sources::Admission;
use super::step::Step;

/// Largest amount by which an observation's time stamp may be later than the step's instant. The sensor process
/// continues while a frame is in transit. A larger amount means that the source's clock is wrong.
pub(super) const MAX_CLOCK_AHEAD: Duration = Duration::from_secs(1);

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
    /// Adds the observations of one step at `now`: creates beliefs, merges them, culls.
    ///
    /// - `which`: the ascending indices of the `perceived` entries to use. Observations and snapshots are in the
    ///   perspective's frame. An observation whose snapshot is empty creates nothing.
    /// - `active_sources`: the sources that delivered a frame (possibly empty) in this step. A belief seen earlier by one of
    ///   them, in view and not observed now, counts as missed.
    /// - `in_view`: whether the perspective now sees the given position, in metres in its frame.
    ///
    /// If `now` is before the previous step, the previous step's instant is used. Rejected observations are counted.
    pub fn step(
        &mut self,
        now: Instant,
        perceived: &[Perceived],
        which: impl Iterator<Item = usize>,
        active_sources: SourceSet,
        in_view: impl Fn([f32; 3]) -> bool,
    ) {
        let mut step_builder = self.begin(now);
        for index in which {
            if let Some(perceived) = require!(perceived.get(index), "entry {index} exists") {
                step_builder.add_observation(index, perceived);
            }
        }
        step_builder.finish(perceived, active_sources, in_view);
    }

    /// Begins a step at `now`. If `now` is before the previous step, the previous step's instant is used, and this is
    /// counted.
    pub fn begin(&mut self, now: Instant) -> StepBuilder<'_> {
        if now < self.now {
            self.counts.backwards += 1;
        }
        self.now = self.now.max(now);
        let dropped_things = self.beliefs.truncate_entries(0) + self.detections.truncate_entries(0);
        self.rollback(dropped_things);
        // Several frames in one step need a more expensive association. The number of frames is assumed to be that of
        // the previous step.
        self.defers_creation = self.beliefs.can_associate_by_summary() && self.sources.frames() <= 1;
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
    /// higher than those before it. A rejected observation is counted; one whose snapshot is empty creates nothing. A hand
    /// creates nothing either: it moves what it holds.
    pub fn add_observation(&mut self, index: usize, perceived: &Perceived) {
        if self.system.beliefs.arena.prevalidated() || self.system.validate(perceived) {
            if perceived.observation.kind() == Some(ObservationKind::Hand) {
                self.system.observe_hand(perceived);
            } else {
                self.system.create(saturating_u32(index), perceived);
            }
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
        // Two tracked beliefs are never merged by their distance alone, so it does not matter that they moved.
        let is_tracked = system.beliefs.features.tracking().is_some();
        let is_clustered = std::mem::replace(&mut system.is_clustered, true) || is_tracked;
        system.expect();
        // Two things of one frame cannot be linked, and neither can beliefs that merged with them.
        let detections_cannot_link = system.beliefs.has_cannot_link() && system.sources.frames() <= 1;
        let remaining = if system.defers_creation {
            system.cluster_detections(first_new, perceived, is_clustered, detections_cannot_link, &in_view)
        } else {
            let lost = system.beliefs.truncate_entries(perceived.len());
            system.rollback(lost);
            let BeliefSystem { beliefs, clustering, sources, .. } = &mut *system;
            beliefs.set_previous_frame(|source, at| sources.before(source, at));
            let mut step = Step { beliefs, perceived, first_new };
            system.counts.merged += clustering.run(&mut step, is_clustered, detections_cannot_link);
            system.counts.merged += system.continue_tracks(perceived, &in_view);
            system.beliefs.commit(perceived)
        };
        for remaining in system.live_len() - remaining..system.live_len() {
            system.place(remaining);
        }
        system.carry(active_sources);
        system.merge_by_evidence(&in_view);
        system.cull(active_sources, in_view);
        system.evict();
        system.number(first_new);
        system.announce();
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
        in_view: impl Fn([f32; 3]) -> bool,
    ) -> usize {
        let lost = self.detections.truncate_entries(perceived.len());
        self.rollback(lost);
        let Self { beliefs, detections, clustering, sources, .. } = self;
        let mut matched = None;
        if is_clustered && detections_cannot_link {
            detections.set_previous_frame(beliefs, |source, at| sources.before(source, at));
            let step = Step { beliefs: &mut *beliefs, perceived, first_new };
            matched =
                clustering.run_matched(&mut FrameAssociation { step, detections, first_new, now: self.now });
        }
        // Creates beliefs from the unmatched detections.
        detections.admit(beliefs, first_new, self.now, perceived);
        beliefs.set_previous_frame(|source, at| sources.before(source, at));
        if let Some(merged) = matched {
            let continued = self.continue_tracks(perceived, &in_view);
            self.counts.merged += merged + continued;
            // What was matched is remembered already.
            return if continued == 0 {
                self.beliefs.commit_new(perceived)
            } else {
                self.beliefs.commit(perceived)
            };
        }
        let step = &mut Step { beliefs: &mut *beliefs, perceived, first_new };
        self.counts.merged += clustering.run_unmatched(step, is_clustered, detections_cannot_link);
        self.counts.merged += self.continue_tracks(perceived, &in_view);
        self.beliefs.commit(perceived)
    }

    /// Validates an observation; counts it if it is not sound.
    fn validate(&mut self, perceived: &Perceived) -> bool {
        let values = perceived.snapshot.values();
        let in_order = values.is_sorted_by(|a, b| a.percept < b.percept);
        let is_some = in_order && values.iter().any(PerceptValue::is_sound);
        let is_sound = perceived.observation.is_sound() && (is_some || values.is_empty());
        self.counts.unsound += u64::from(!is_sound);
        is_sound
    }

    fn create(&mut self, entry: u32, perceived: &Perceived) {
        let Perceived { observation, snapshot } = perceived;
        let observed_at = Instant::from_nanos(observation.observed_at_ns);
        if observed_at > self.now + MAX_CLOCK_AHEAD {
            self.counts.ahead += 1;
            return;
        }
        if snapshot.values().is_empty() {
            return;
        }
        // A remembered sample is not later than now; otherwise h(now) would not contain it.
        let at = observed_at.min(self.now);
        match self.sources.admit(observation.source, observed_at) {
            Admission::Accepted => {}
            Admission::Stale => {
                self.counts.stale += 1;
                return;
            }
            Admission::NoRoom => {
                self.counts.overflowed += 1;
                return;
            }
        }
        let is_created = if self.defers_creation {
            self.detections.record(&self.beliefs, at, entry, perceived)
        } else {
            self.beliefs.create(self.next_id, [at, self.now], entry, perceived).is_some()
        };
        if is_created {
            self.counts.created += 1;
            self.next_id += 1;
        } else {
            self.counts.overflowed += 1;
        }
    }

    /// Renumbers the new beliefs without gaps, because most of them merged into older ones.
    fn number(&mut self, first_new: u64) {
        self.next_id = first_new;
        let is_old =
            |slot: &u32| self.beliefs.arena.memory(*slot).is_some_and(|memory| memory.id < first_new);
        for index in self.beliefs.arena.live().partition_point(is_old)..self.live_len() {
            let slot = self.beliefs.arena.live().get(index).copied();
            let memory = slot.and_then(|slot| self.beliefs.arena.memory_mut(slot));
            let Some(memory) = require!(memory, "the belief at index {index} is live") else { continue };
            memory.id = self.next_id;
            self.next_id += 1;
        }
    }
}
