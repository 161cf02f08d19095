#[cfg(test)]
mod tests;

use clock::Instant;
use invariant::invariant;
use message::{Feature, Perceived};
use quantity::number::saturating_u32;

use super::error::BeliefSystemError;
use super::percepts::Percepts;
use super::plugins::BeliefPlugins;
use crate::association::{DetectionHistory, Features, Interval, Metric, PREFETCH_DISTANCE};
use crate::storage::{Arena, Histories};

/// B, the current set of beliefs, in preallocated slots: what the storage remembers of each, and what the association
/// compares of it.
#[derive(Clone, Debug)]
pub(crate) struct Beliefs {
    pub(crate) arena: Arena,
    pub(crate) features: Features,
    /// The cannot-link constraints; `None` if beliefs observed in the same frame may merge.
    pub(crate) detection_history: Option<DetectionHistory>,
}

impl Beliefs {
    pub(crate) fn new(
        percepts: &Percepts,
        plugins: &BeliefPlugins,
        slots: u32,
    ) -> Result<Self, BeliefSystemError> {
        let count = slots as usize;
        let metric = Metric::new(&percepts.belief.metric(), |name| plugins.distance(name))?;
        let generators: Vec<_> =
            percepts.percepts.iter().map(|percept| (&percept.history, &percept.kernel)).collect();
        let histories = Histories::new(&generators, |name| plugins.history(name), count)?;
        let cannot_link = percepts.belief.cannot_link_same_source_instant;
        Ok(Self {
            features: Features::new(metric, percepts.place(), count, &histories, percepts.belief.tracking),
            arena: Arena::new(histories, count),
            detection_history: cannot_link.then(|| DetectionHistory::new(count)),
        })
    }

    /// The gate radius: the largest distance in metres between two beliefs that are closer than the threshold.
    pub(crate) fn gate_radius_m(&self) -> Option<f64> {
        self.features.gate().map(|gate| gate.metres)
    }

    /// Whether beliefs observed in the same frame cannot be linked.
    pub(crate) fn has_cannot_link(&self) -> bool {
        self.detection_history.is_some()
    }

    /// Creates a belief (N, Eq. 6) from entry `entry` of the perceived things. `at` is the sample's time, `now` the
    /// step's. `id` must be higher than every other. `None` if no slot is free.
    pub(crate) fn create(
        &mut self,
        id: u64,
        [at, now]: [Instant; 2],
        entry: u32,
        perceived: &Perceived,
    ) -> Option<u32> {
        let Perceived { observation, .. } = perceived;
        let slot = self.arena.create(id, [at, now], entry, observation)?;
        self.features.set(slot, at, perceived, self.arena.prevalidated(), self.arena.all_histories());
        if let Some(detection_history) = &mut self.detection_history {
            let observed_at = Instant::from_nanos(observation.observed_at_ns);
            detection_history.begin(slot as usize, Interval::of(observation.source, observed_at));
        }
        Some(slot)
    }

    /// Removes the beliefs of this step whose entry is not below `entries`; returns their number.
    pub(crate) fn truncate_entries(&mut self, entries: usize) -> u64 {
        let before = self.arena.fresh().len();
        while let Some(slot) = self.arena.pop_fresh(entries) {
            self.free_slot(slot);
        }
        u64::from(saturating_u32(before - self.arena.fresh().len()))
    }

    /// Called once all beliefs of the step are created. `before` returns the instant of a source's frame that precedes
    /// the given one.
    pub(crate) fn set_previous_frame(&mut self, before: impl Fn(u16, Instant) -> Option<Instant>) {
        if let Some(detection_history) = &mut self.detection_history {
            detection_history.set_previous_frame(self.arena.fresh(), before);
        }
    }

    /// Merges the belief in `gone` into the one in `kept` (M). `perceived` is the input of this step.
    pub(crate) fn merge(&mut self, kept: u32, gone: u32, perceived: &[Perceived]) {
        let are_two = kept != gone && self.arena.is_live(kept) && self.arena.is_live(gone);
        if !invariant!(are_two, "slots {kept} and {gone} have a belief each") {
            return;
        }
        if self.appends(kept, gone) {
            self.arena.append(kept, gone);
            self.features.append(kept, gone, self.arena.all_histories());
        } else if self.arena.unite(kept, gone, perceived) {
            self.refresh(kept, Some(gone));
        }
        self.arena.change(kept);
        if let Some(detection_history) = &mut self.detection_history {
            detection_history.merge(kept as usize, gone as usize);
        }
        self.free_slot(gone);
    }

    /// D of two beliefs; `None` if it is not below the threshold or the two cannot be linked.
    pub(crate) fn distance(&self, a: u32, b: u32) -> Option<f64> {
        let distance = self.features.distance(a, b)?;
        (!self.cannot_link(a, b)).then_some(distance)
    }

    /// Whether two beliefs were detected in one frame.
    #[inline]
    pub(crate) fn cannot_link(&self, a: u32, b: u32) -> bool {
        let detection_history = self.detection_history.as_ref();
        detection_history.is_some_and(|seen| seen.cannot_link(a as usize, b as usize))
    }

    /// D of a belief and a detection that continues its [track](Features::distance_along_track): of the frame that follows
    /// its last, or of any later one if its expected position is out of view. `None` if D is not below the threshold.
    pub(crate) fn distance_along_track(
        &self,
        old: u32,
        fresh: u32,
        in_view: impl Fn([f32; 3]) -> bool,
    ) -> Option<f64> {
        if !self.arena.is_live(old) || !self.arena.is_snapshot(fresh) || self.cannot_link(old, fresh) {
            return None;
        }
        let detection_history = self.detection_history.as_ref()?;
        if detection_history.continues(old as usize, fresh as usize)
            && let Some(distance) = self.features.distance_along_track(old, fresh, false)
        {
            return Some(distance);
        }
        let distance = self.features.distance_along_track(old, fresh, true)?;
        self.features.place(old).is_some_and(|place| !in_view(place)).then_some(distance)
    }

    /// Whether the other belief is a snapshot newer than everything in `older`, and the new features can be predicted.
    /// Then the histories are updated on commit.
    #[inline]
    pub(crate) fn appends(&self, older: u32, newer: u32) -> bool {
        self.features.are_predictable() && self.arena.appends(older, newer)
    }

    /// Frees the slot and all that is remembered of its belief.
    pub(crate) fn free_slot(&mut self, slot: u32) {
        if self.arena.free(slot)
            && let Some(detection_history) = &mut self.detection_history
        {
            detection_history.clear(slot as usize);
        }
    }

    /// Commits the step after merging: updates the histories of the older beliefs, gives histories to the remaining new
    /// ones and appends them to the list. Returns the number of those.
    pub(crate) fn commit(&mut self, perceived: &[Perceived]) -> usize {
        let Self { arena, .. } = self;
        arena.compact();
        let old = arena.live().len();
        for index in 0..old {
            let Some(&slot) = arena.live().get(index) else { break };
            if let Some(&slot) = arena.live().get(index + 2 * PREFETCH_DISTANCE) {
                arena.prefetch(slot, false);
            }
            if let Some(&slot) = arena.live().get(index + PREFETCH_DISTANCE) {
                arena.prefetch(slot, true);
            }
            arena.remember(slot, perceived);
        }
        self.commit_new(perceived)
    }

    /// Like [`Self::commit`], when all detections that merged are already in the histories of the older beliefs.
    pub(crate) fn commit_new(&mut self, perceived: &[Perceived]) -> usize {
        let old = self.arena.live().len();
        for index in 0..self.arena.fresh().len() {
            let Some(&slot) = self.arena.fresh().get(index) else { break };
            if self.arena.is_live(slot) && !self.arena.commit_new(slot, perceived) {
                // Neither in the list nor free, the slot would be lost.
                self.free_slot(slot);
            }
        }
        self.arena.clear_fresh();
        self.arena.live().len() - old
    }

    /// The newest feature of a percept of a committed belief.
    #[inline]
    pub(crate) fn newest(&self, slot: u32, percept: u16) -> Option<Feature> {
        // Features that the metric compares are cached in a contiguous array.
        match self.features.newest(slot, percept) {
            Some(feature) => feature,
            None => self.arena.newest(slot, percept),
        }
    }

    /// Recomputes the cached features and symbols of a belief from its histories. `united` is the belief that was merged
    /// into it, if that is the reason.
    pub(crate) fn refresh(&mut self, slot: u32, united: Option<u32>) {
        if let Some((histories, row)) = self.arena.histories(slot) {
            self.features.refresh(slot, row, united, histories);
        }
    }

    /// The complete contents of a belief, bit for bit, and its detection intervals.
    #[cfg(test)]
    pub(crate) fn contents(&self, slot: u32) -> String {
        let (histories, row) = self.arena.histories(slot).unwrap();
        self.features.assert_are_stored(slot, row, histories);
        let detection_history = self
            .detection_history
            .as_ref()
            .map(|detection_history| detection_history.intervals(slot as usize));
        format!("{:?}\n{detection_history:?}\n{}", self.arena.memory(slot).unwrap(), histories.contents(row))
    }
}
