#[cfg(test)]
mod tests;

use clock::Instant;
use invariant::invariant;
use message::{Belief, Remembered};
use quantity::number::saturating_u32;

use super::beliefs::Beliefs;
use super::carriers::Carriers;
use super::continuation::Continuation;
use super::counts::Counts;
use super::cull_fn::CullFn;
use super::detections::Detections;
use super::error::BeliefSystemError;
use super::evidence::Evidence;
use super::percepts::{Kernel, Percept, Percepts};
use super::plugins::BeliefPlugins;
use super::sources::Sources;
use super::step::Step;
use crate::association::Clustering;
use crate::storage::{BoundedVec, Sample};

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
    pub(super) percepts: Vec<Percept>,
    /// k of Eq. 2.
    pub(super) threshold: f64,
    /// Index of the percept that gives a thing's position.
    pub(super) place: Option<u16>,
    pub(super) cull: Vec<CullFn>,
    pub(super) capacity: usize,
    pub(super) beliefs: Beliefs,
    pub(super) detections: Detections,
    /// Whether this step collects its observations first and creates beliefs only when it finishes.
    pub(super) defers_creation: bool,
    pub(super) clustering: Clustering,
    /// Whether no two beliefs are closer than the threshold, because none has changed since the last clustering.
    pub(super) is_clustered: bool,
    pub(super) sources: Sources,
    /// The slots of the announced beliefs in order of their identities; not used if all are announced at once.
    pub(super) announced: BoundedVec<u32>,
    /// The pairs of [`Self::continue_tracks`].
    pub(super) continuations: BoundedVec<Continuation>,
    /// Per slot; empty if positions are not predicted.
    pub(super) evidence: Box<[Evidence]>,
    /// `None` if unobserved things do not move with others.
    pub(super) carriers: Option<Carriers>,
    pub(super) next_id: u64,
    pub(super) now: Instant,
    /// Start of the uninterrupted period in which the perspective has been observing.
    pub(super) observing_since: Instant,
    pub(super) counts: Counts,
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
        let beliefs = Beliefs::new(percepts, plugin, saturating_u32(2 * capacity))?;
        let slots = beliefs.arena.slots();
        let tracked = if beliefs.features.tracking().is_some() { slots } else { 0 };
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
            detections: Detections::new(slots),
            defers_creation: false,
            clustering: Clustering::new(slots, beliefs.gate_radius_m()),
            beliefs,
            is_clustered: true,
            sources: Sources::new(),
            announced: BoundedVec::with_bound(tracked),
            continuations: BoundedVec::with_bound(tracked),
            evidence: vec![Evidence::default(); tracked].into_boxed_slice(),
            carriers: percepts.belief.carrying.filter(|_| tracked > 0).map(|carrying| {
                let of = |kernel: &Kernel| percepts.with_kernel(|other| other == kernel).next();
                Carriers::new(carrying, [of(&Kernel::Extents), of(&Kernel::Orientation)], slots)
            }),
            next_id: 1,
            now: Instant::EPOCH,
            observing_since: Instant::EPOCH,
            counts: Counts::default(),
        })
    }

    /// Skips validation. The caller guarantees that all inputs are [sound](message::Perceived::is_sound); invalid input is
    /// stored as it is.
    #[must_use]
    pub fn assume_validated(mut self) -> Self {
        self.beliefs.arena.set_prevalidated();
        self
    }

    /// Number of beliefs. One that is not [announced](super::percepts::Tracking::announce_after) yet is not counted.
    #[must_use]
    pub fn len(&self) -> usize {
        self.announced().len()
    }

    /// Whether there is no belief.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.announced().is_empty()
    }

    /// Number of beliefs that are not announced yet.
    #[must_use]
    pub fn unannounced(&self) -> usize {
        self.live_len() - self.len()
    }

    /// Number of beliefs, announced or not.
    pub(super) fn live_len(&self) -> usize {
        self.beliefs.arena.live().len()
    }

    /// The counters since the system was created.
    #[must_use]
    pub fn counts(&self) -> Counts {
        Counts { unsound: self.counts.unsound + self.beliefs.arena.unsound(), ..self.counts }
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
        let slot = *self.announced().get(index)?;
        let (memory, (histories, row)) =
            (self.beliefs.arena.memory(slot)?, self.beliefs.arena.histories(slot)?);
        let (born_at, perceived_at) = (memory.born_at.as_nanos(), memory.perceived_at.as_nanos());
        let mut belief = Belief::new(memory.id, born_at, perceived_at, memory.observations, memory.held_by);
        if let Some(motion) = self.beliefs.features.motion(slot, instant) {
            belief.expected_position_m = motion.position_m;
            belief.velocity_m_s = motion.velocity_m_s;
            belief.position_variance_m2 = motion.position_variance_m2;
            belief.velocity_variance_m2_s2 = motion.velocity_variance_m2_s2;
        }
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
        Some(self.beliefs.arena.memory(*self.announced().get(index)?)?.id)
    }

    /// The agent that holds the thing of the belief at `index`, or `NOBODY`.
    #[must_use]
    pub fn held_by(&self, index: usize) -> Option<u16> {
        Some(self.beliefs.arena.memory(*self.announced().get(index)?)?.held_by)
    }

    /// The last perceived position of the belief at `index`, in metres in the perspective's frame; `None` if it has no
    /// position.
    #[must_use]
    pub fn position(&self, index: usize) -> Option<[f32; 3]> {
        self.place_of(*self.announced().get(index)?)
    }

    /// Updates the spatial index with the position of the belief at `index`.
    pub(super) fn place(&mut self, index: usize) {
        if let Some(&slot) = self.beliefs.arena.live().get(index) {
            self.place_slot(slot);
        }
    }

    /// Updates the spatial index with the position of the belief in a slot.
    #[inline]
    pub(super) fn place_slot(&mut self, slot: u32) {
        let step = Step { beliefs: &mut self.beliefs, perceived: &[], first_new: self.next_id };
        self.clustering.place(&step, slot);
    }

    /// Tells the system that the perspective observes again after an interruption. Absence found before `now` no longer
    /// counts.
    pub fn look_anew(&mut self, now: Instant) {
        self.observing_since = self.observing_since.max(now);
    }

    pub(super) fn free_slot(&mut self, slot: u32) {
        self.clustering.remove_member(slot);
        self.beliefs.free_slot(slot);
    }

    pub(super) fn place_of(&self, slot: u32) -> Option<[f32; 3]> {
        self.beliefs.newest(slot, self.place?)?.vector()
    }
}
