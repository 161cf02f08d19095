mod reanchor;
mod step_builder;
#[cfg(test)]
mod tests;

use clock::{Duration, Instant};
use invariant::{invariant, require};
use message::{Belief, Perceived, PerceptValue, Remembered, SourceSet};
use quantity::number::saturating_u32;

use crate::arena::{Arena, Detections, Step};
use crate::cluster::Clustering;
use crate::percepts::{self, Percept, Percepts};
use crate::plugin::{self, BeliefPlugins, CullContext, PluginHandle};
use crate::sample::Sample;
use crate::sources::{Admission, Sources};

pub use step_builder::StepBuilder;

/// Largest amount by which an observation's time stamp may be later than the step's instant. The sensor process
/// continues while a frame is in transit. A larger amount means that the source's clock is wrong.
const MAX_CLOCK_AHEAD: Duration = Duration::from_secs(1);

/// Largest capacity of a belief system, in beliefs.
const MAX_CAPACITY: usize = 1_000_000;

/// The belief system of one perspective: (B, G, M, d, q, w, c).
///
/// [`BeliefSystem::new`] allocates all memory. A clone is a snapshot Snp(t): a deep copy that evolves independently.
///
/// ```
/// use belief::BeliefSystem;
/// use clock::Instant;
/// use belief::percepts::Percepts;
/// use message::{Observation, Perceived, SourceSet};
/// use perception::{Frame, Perception};
///
/// let percepts = Percepts::builtin();
/// let perception = Perception::new(&percepts).unwrap();
/// let mut system = BeliefSystem::new(&percepts, 64).unwrap();
/// for millis in [0, 5, 10] {
///     let now = Instant::from_nanos(1 + millis * 1_000_000);
///     let observation = Observation::object(0, now.as_nanos());
///     let snapshot = perception.perceive(&observation, &Frame { agent: 0 });
///     system.step(now, &[Perceived { observation, snapshot }], 0..1, SourceSet::of(0), |_place| true);
/// }
/// assert_eq!(system.len(), 1);
/// let belief = system.beliefs().next().unwrap();
/// assert_eq!((belief.id, belief.observations), (1, 3));
/// ```
#[derive(Clone, Debug)]
pub struct BeliefSystem {
    percepts: Vec<Percept>,
    /// k of Eq. 2.
    threshold: f64,
    /// Index of the percept that gives a thing's position.
    place: Option<u16>,
    cull: Vec<CullFn>,
    capacity: usize,
    arena: Arena,
    detections: Detections,
    /// Whether this step collects its observations first and creates beliefs only when it finishes.
    defers_creation: bool,
    clustering: Clustering,
    /// Whether no two beliefs are closer than the threshold, because none has changed since the last clustering.
    is_clustered: bool,
    sources: Sources,
    next_id: u64,
    now: Instant,
    /// Start of the uninterrupted period in which the perspective has been observing.
    observing_since: Instant,
    counts: Counts,
}

/// Counters since the system was created.
///
/// The number of current beliefs is those created, less those merged, culled and evicted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Observations rejected because of invalid numbers, and percept evaluations omitted for the same reason.
    pub unsound: u64,
    /// Observations rejected because their time stamp was too far ahead: their source's clock is wrong.
    pub ahead: u64,
    /// Observations rejected because they were not newer than those that their source delivered in an earlier step.
    pub stale: u64,
    /// Steps whose instant was before that of the previous step; the previous instant was used instead.
    pub backwards: u64,
    /// Beliefs created, one per snapshot (Eq. 6).
    pub created: u64,
    /// Pairs of beliefs merged.
    pub merged: u64,
    /// Beliefs culled (Eq. 5).
    pub culled: u64,
    /// Observations dropped because the system was full.
    pub overflowed: u64,
    /// New beliefs dropped because the system was full: those that merged into no older one.
    pub evicted: u64,
}

impl Counts {
    /// Observations and evaluations rejected, for any reason.
    #[must_use]
    pub const fn refused(&self) -> u64 {
        self.unsound + self.ahead + self.stale
    }
}

/// A culling function c (Eq. 5) with its plug-in found: [`percepts::Cull`] ready for use.
#[derive(Clone, Debug)]
enum CullFn {
    UnseenLongerThan(u64),
    ConfidenceBelow { percept: u16, floor: f64 },
    PlaceEmptyFor(Duration),
    Plugin(PluginHandle<dyn plugin::Cull>),
}

impl CullFn {
    fn new(config: &percepts::Cull, plugin: &BeliefPlugins) -> Result<Self, BeliefSystemError> {
        Ok(match config {
            percepts::Cull::UnseenLongerThan(limit) => Self::UnseenLongerThan(clock::nanos(*limit)),
            percepts::Cull::ConfidenceBelow { percept, floor } => {
                Self::ConfidenceBelow { percept: *percept, floor: *floor }
            }
            percepts::Cull::PlaceEmptyFor(time) => Self::PlaceEmptyFor(*time),
            percepts::Cull::Plugin(name) => Self::Plugin(plugin.cull(name)?),
        })
    }
}

/// Reasons why a belief system cannot be created.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BeliefSystemError {
    /// The capacity is out of range.
    #[error("a belief system for {capacity} beliefs: the capacity must be from 1 to 1000000")]
    Capacity {
        /// Requested number of beliefs.
        capacity: usize,
    },
    /// The configuration names a plug-in function that the program does not supply.
    #[error("the configuration names the custom {what} `{name}`, which this program does not have")]
    NoSuchFunction {
        /// The kind of function.
        what: &'static str,
        /// Its name.
        name: String,
    },
    /// A plug-in history keeps too many samples, or none.
    #[error("the custom history `{name}` keeps {samples} samples: it must be from 1 to 4096")]
    Samples {
        /// Its name.
        name: String,
        /// The number of samples that it requests.
        samples: usize,
    },
}

impl BeliefSystem {
    /// Creates an empty belief system that holds at most `capacity` beliefs. A step accepts new observations up to a
    /// total of twice the capacity, the existing beliefs included.
    ///
    /// # Errors
    ///
    /// The capacity is zero or above a million, or the configuration names a plug-in function: see [`Self::with_plugins`].
    pub fn new(percepts: &Percepts, capacity: usize) -> Result<Self, BeliefSystemError> {
        Self::with_plugins(percepts, &BeliefPlugins::default(), capacity)
    }

    /// Like [`Self::new`], with plug-in functions.
    ///
    /// # Errors
    ///
    /// The capacity is zero or above a million. Or the configuration names a function that `plugin` lacks. Or a plug-in
    /// history keeps too many samples or none.
    pub fn with_plugins(
        percepts: &Percepts,
        plugin: &BeliefPlugins,
        capacity: usize,
    ) -> Result<Self, BeliefSystemError> {
        if !(1..=MAX_CAPACITY).contains(&capacity) {
            return Err(BeliefSystemError::Capacity { capacity });
        }
        let arena = Arena::new(percepts, plugin, saturating_u32(2 * capacity))?;
        Ok(Self {
            percepts: percepts.percepts.clone(),
            threshold: percepts.threshold,
            place: percepts.place(),
            cull: percepts
                .belief
                .cull
                .iter()
                .map(|cull| CullFn::new(cull, plugin))
                .collect::<Result<_, _>>()?,
            capacity,
            detections: Detections::new(arena.slots()),
            defers_creation: false,
            clustering: Clustering::new(arena.slots(), arena.gate_radius_m()),
            arena,
            is_clustered: true,
            sources: Sources::new(),
            next_id: 1,
            now: Instant::EPOCH,
            observing_since: Instant::EPOCH,
            counts: Counts::default(),
        })
    }

    /// Skips validation. The caller guarantees that all inputs are [sound](Perceived::is_sound); invalid input is
    /// stored as it is.
    #[must_use]
    pub fn assume_validated(mut self) -> Self {
        self.arena.set_prevalidated();
        self
    }

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

    /// Number of beliefs.
    #[must_use]
    pub fn len(&self) -> usize {
        self.arena.live().len()
    }

    /// Whether there is no belief.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.arena.live().is_empty()
    }

    /// The counters since the system was created.
    #[must_use]
    pub fn counts(&self) -> Counts {
        Counts { unsound: self.counts.unsound + self.arena.unsound(), ..self.counts }
    }

    /// The instant of the last step.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// The beliefs in order of their identities, evaluated at the instant of the last step.
    pub fn beliefs(&self) -> impl Iterator<Item = Belief> {
        (0..self.len()).filter_map(|index| self.write(index, self.now))
    }

    /// The belief at `index` in order of the identities, with all its percepts evaluated at `instant` (Eq. 3). Percepts
    /// whose first sample is later are omitted.
    #[must_use]
    pub fn write(&self, index: usize, instant: Instant) -> Option<Belief> {
        let slot = *self.arena.live().get(index)?;
        let (memory, (histories, row)) = (self.arena.memory(slot)?, self.arena.histories(slot)?);
        let (born_at, perceived_at) = (memory.born_at.as_nanos(), memory.perceived_at.as_nanos());
        let mut belief = Belief::new(memory.id, born_at, perceived_at, memory.observations, memory.held_by);
        for (number, percept) in (0..).zip(&self.percepts) {
            if let Some(sample) = histories.at(row, number, instant, percept.decay_per_s) {
                let Sample { at, matching, confidence, feature } = sample;
                let remembered = Remembered::new(number, at.as_nanos(), matching, confidence, feature);
                invariant!(belief.push(remembered), "a belief has room for percept {number}");
            }
        }
        Some(belief)
    }

    /// The identity of the belief at `index` in order of the identities.
    #[must_use]
    pub fn id(&self, index: usize) -> Option<u64> {
        Some(self.arena.memory(*self.arena.live().get(index)?)?.id)
    }

    /// The agent that holds the thing of the belief at `index`, or `NOBODY`.
    #[must_use]
    pub fn held_by(&self, index: usize) -> Option<u16> {
        Some(self.arena.memory(*self.arena.live().get(index)?)?.held_by)
    }

    /// The last perceived position of the belief at `index`, in metres in the perspective's frame; `None` if it has no
    /// position.
    #[must_use]
    pub fn position(&self, index: usize) -> Option<[f32; 3]> {
        self.place_of(*self.arena.live().get(index)?)
    }

    /// Updates the spatial index with the position of the belief at `index`.
    fn place(&mut self, index: usize) {
        if let Some(&slot) = self.arena.live().get(index) {
            self.clustering.place(&Step { arena: &mut self.arena, perceived: &[] }, slot);
        }
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
            self.detections.record(&self.arena, at, entry, perceived)
        } else {
            self.arena.create(self.next_id, [at, self.now], entry, perceived).is_some()
        };
        if is_created {
            self.counts.created += 1;
            self.next_id += 1;
        } else {
            self.counts.overflowed += 1;
        }
    }

    /// Tells the system that the perspective observes again after an interruption. Absence found before `now` no longer
    /// counts.
    pub fn look_anew(&mut self, now: Instant) {
        self.observing_since = self.observing_since.max(now);
    }

    /// C: removes the beliefs on which all culling functions agree (Eq. 5).
    fn cull(&mut self, active_sources: SourceSet, in_view: impl Fn([f32; 3]) -> bool) {
        if self.cull.is_empty() {
            return;
        }
        let watches = self.cull.iter().any(|cull| matches!(cull, CullFn::PlaceEmptyFor(_)));
        let culled = self.counts.culled;
        for index in 0..self.len() {
            let Some(&slot) = self.arena.live().get(index) else { break };
            if watches {
                self.update_empty_since(slot, active_sources, &in_view);
            }
            if self.cull.iter().all(|cull| self.agrees(cull, slot, active_sources, &in_view)) {
                self.free_slot(slot);
                self.counts.culled += 1;
            }
        }
        if self.counts.culled > culled {
            self.arena.compact();
        }
    }

    /// Updates since when the position of a belief is empty. If no source that ever saw the thing delivered a frame in
    /// this step, the state is unchanged, as between two images of a slow camera.
    fn update_empty_since(
        &mut self,
        slot: u32,
        active_sources: SourceSet,
        in_view: impl Fn([f32; 3]) -> bool,
    ) {
        let (now, observing_since) = (self.now, self.observing_since);
        let Some(memory) = require!(self.arena.memory(slot), "slot {slot} is live") else { return };
        // Whatever is at that position now was not associated with this belief, so the position counts as empty.
        if memory.updated_at >= now || !active_sources.intersects(memory.seen_by) {
            return;
        }
        let is_empty = self.place_of(slot).is_some_and(in_view);
        if let Some(memory) = self.arena.memory_mut(slot) {
            let since = memory.empty_since.filter(|since| *since >= observing_since).unwrap_or(now);
            memory.empty_since = is_empty.then_some(since);
        }
    }

    /// Evaluates a culling function c for a belief.
    fn agrees(
        &self,
        cull: &CullFn,
        slot: u32,
        active_sources: SourceSet,
        in_view: impl Fn([f32; 3]) -> bool,
    ) -> bool {
        let Some(memory) = require!(self.arena.memory(slot), "slot {slot} is live") else { return false };
        match cull {
            // In nanoseconds, because this is evaluated for every belief in every step.
            CullFn::UnseenLongerThan(limit_ns) => {
                self.now.as_nanos().saturating_sub(memory.updated_at.as_nanos()) > *limit_ns
            }
            CullFn::ConfidenceBelow { percept, floor } => {
                let decay =
                    self.percepts.get(usize::from(*percept)).map_or(0.0, |percept| percept.decay_per_s);
                let histories = self.arena.histories(slot);
                let remembered =
                    histories.and_then(|(histories, row)| histories.at(row, *percept, self.now, decay));
                remembered.is_none_or(|sample| f64::from(sample.confidence) < *floor)
            }
            // Without a frame in this step the thing may have come back, so the belief stays.
            CullFn::PlaceEmptyFor(time) => {
                let is_empty_for = |since| self.now.since(since) >= *time;
                active_sources.intersects(memory.seen_by) && memory.empty_since.is_some_and(is_empty_for)
            }
            CullFn::Plugin(plugin) => {
                let remembered = |number: u16| {
                    let decay = self.percepts.get(usize::from(number))?.decay_per_s;
                    let (histories, row) = self.arena.histories(slot)?;
                    histories.at(row, number, self.now, decay)
                };
                plugin.agrees(&CullContext {
                    now: self.now,
                    memory,
                    place: self.place_of(slot),
                    remembered: &remembered,
                    in_view: &|place| active_sources.intersects(memory.seen_by) && in_view(place),
                })
            }
        }
    }

    /// Removes the beliefs beyond the capacity, the youngest first.
    fn evict(&mut self) {
        for index in self.capacity..self.len() {
            let Some(&slot) = self.arena.live().get(index) else { break };
            self.counts.evicted += 1;
            self.counts.overflowed += self.arena.memory(slot).map_or(0, |memory| memory.observations);
            self.free_slot(slot);
        }
        if self.len() > self.capacity {
            self.arena.compact();
        }
    }

    fn free_slot(&mut self, slot: u32) {
        self.clustering.remove_member(slot);
        self.arena.free_slot(slot);
    }

    /// Renumbers the new beliefs without gaps, because most of them merged into older ones.
    fn number(&mut self, first_new: u64) {
        self.next_id = first_new;
        let is_old = |slot: &u32| self.arena.memory(*slot).is_some_and(|memory| memory.id < first_new);
        for index in self.arena.live().partition_point(is_old)..self.len() {
            let slot = self.arena.live().get(index).copied();
            let memory = slot.and_then(|slot| self.arena.memory_mut(slot));
            let Some(memory) = require!(memory, "the belief at index {index} is live") else { continue };
            memory.id = self.next_id;
            self.next_id += 1;
        }
    }

    fn place_of(&self, slot: u32) -> Option<[f32; 3]> {
        self.arena.newest(slot, self.place?)?.vector()
    }
}
