use clock::Instant;
use invariant::require;
use message::{Feature, MAX_PERCEPTS, Perceived, Snapshot};
use quantity::number::saturating_u32;

use super::beliefs::Beliefs;
use super::step::Step;
use crate::association::{AssociationProblem, GateKeys, Interval, MemberSummary};
use crate::storage::BoundedVec;

/// The detections of one frame that are not assigned yet, each with only the data needed to find its belief.
///
/// Nearly every detection belongs to an existing belief and is discarded after the step. Creating a belief for each (N,
/// Eq. 6) would write, read and free a slot, which would dominate the cost. Unassigned detections [become
/// beliefs](Self::admit) at the end. If the association needs the full clustering loop, all of them do.
#[derive(Clone, Debug)]
pub(super) struct Detections {
    things: BoundedVec<Detection>,
    /// The member numbers of the detections, which follow those of all slots.
    numbers: Box<[u32]>,
    /// The frame of the detections, if it is only one.
    frame: Interval,
    /// The time at which they are stored.
    at: Instant,
}

#[derive(Clone, Copy, Debug)]
struct Detection {
    /// Index into the perceived things; [`ASSIGNED`] once assigned to a belief.
    entry: u32,
    place_m: Option<[f32; 3]>,
    gate_keys: GateKeys,
}

const ASSIGNED: u32 = u32::MAX;

impl Detections {
    /// Capacity for as many detections as there are slots.
    pub(super) fn new(slots: usize) -> Self {
        let first = saturating_u32(slots);
        Self {
            things: BoundedVec::with_bound(slots),
            numbers: (first..first.saturating_mul(2)).collect(),
            frame: Interval::of(0, Instant::EPOCH),
            at: Instant::EPOCH,
        }
    }

    /// Records a detection by its entry, to be stored with time `at`. `false` if there is no free slot for it.
    #[inline]
    pub(super) fn record(
        &mut self,
        beliefs: &Beliefs,
        at: Instant,
        entry: u32,
        perceived: &Perceived,
    ) -> bool {
        if self.things.len() + beliefs.arena.live().len() >= beliefs.arena.slots() {
            return false;
        }
        if self.things.is_empty() {
            let Perceived { observation, .. } = perceived;
            self.frame = Interval::of(observation.source, Instant::from_nanos(observation.observed_at_ns));
            self.at = at;
        }
        let (place_m, gate_keys) = beliefs.summary(&perceived.snapshot);
        self.things.push(Detection { entry, place_m, gate_keys });
        true
    }

    /// Called once all detections are recorded, which are all of one frame. `before` returns the instant of a source's
    /// frame that precedes the given one.
    pub(super) fn set_previous_frame(
        &mut self,
        beliefs: &mut Beliefs,
        before: impl Fn(u16, Instant) -> Option<Instant>,
    ) {
        self.frame.previous_frame = before(self.frame.source, self.frame.first);
        if let Some(detection_history) = &mut beliefs.detection_history {
            detection_history.set_step_frame((!self.things.is_empty()).then_some(self.frame));
        }
    }

    /// Removes the detections whose entry is not below `entries`; returns their number.
    pub(super) fn truncate_entries(&mut self, entries: usize) -> u64 {
        let before = self.things.len();
        // They are in the order of their entries.
        while self.things.pop_if(|detection| detection.entry as usize >= entries).is_some() {}
        u64::from(saturating_u32(before - self.things.len()))
    }

    /// Creates a belief for each unassigned detection, in a step at `now`. Identity `first_new` belongs to the first of
    /// all detections.
    pub(super) fn admit(
        &mut self,
        beliefs: &mut Beliefs,
        first_new: u64,
        now: Instant,
        perceived: &[Perceived],
    ) {
        for (id, detection) in (first_new..).zip(self.things.drain(..)) {
            let Detection { entry, .. } = detection;
            if entry == ASSIGNED {
                continue;
            }
            if let Some(perceived) = require!(perceived.get(entry as usize), "entry {entry} exists") {
                let at = Instant::from_nanos(perceived.observation.observed_at_ns).min(now);
                require!(beliefs.create(id, [at, now], entry, perceived), "each detection has a free slot");
            }
        }
    }
}

/// The association problem of one frame: the beliefs of earlier steps and the detections.
pub(super) struct FrameAssociation<'a> {
    pub(super) step: Step<'a>,
    pub(super) detections: &'a mut Detections,
    pub(super) first_new: u64,
    pub(super) now: Instant,
}

impl FrameAssociation<'_> {
    fn index(&self, number: u32) -> Option<usize> {
        (number as usize).checked_sub(self.step.beliefs.arena.slots())
    }

    #[inline]
    fn detection(&self, number: u32) -> Option<&Detection> {
        self.detections.things.get(self.index(number)?)
    }

    fn perceived(&self, number: u32) -> Option<&Perceived> {
        self.step.perceived.get(self.detection(number)?.entry as usize)
    }
}

/// Tracks are numbered by their slots; the numbers of detections follow.
impl AssociationProblem for FrameAssociation<'_> {
    #[inline]
    fn old(&self) -> &[u32] {
        self.step.old()
    }

    #[inline]
    fn fresh(&self) -> &[u32] {
        let count = self.detections.things.len();
        require!(self.detections.numbers.get(..count), "{count} detections are numbered").unwrap_or(&[])
    }

    fn is_live(&self, number: u32) -> bool {
        match self.index(number) {
            None => self.step.is_live(number),
            Some(_) => self.detection(number).is_some_and(|detection| detection.entry != ASSIGNED),
        }
    }

    #[inline]
    fn id(&self, number: u32) -> u64 {
        match self.index(number) {
            None => self.step.id(number),
            Some(index) => self.first_new + u64::from(saturating_u32(index)),
        }
    }

    /// Not used: no pair waits in a queue.
    fn version(&self, _number: u32) -> u32 {
        0
    }

    #[inline]
    fn place(&self, number: u32) -> Option<[f32; 3]> {
        match self.detection(number) {
            None => self.step.place(number),
            Some(detection) => detection.place_m,
        }
    }

    #[inline]
    fn gate_keys(&self, number: u32) -> GateKeys {
        self.detection(number).map_or_else(|| self.step.gate_keys(number), |detection| detection.gate_keys)
    }

    fn distance(&self, old: u32, fresh: u32) -> Option<f64> {
        self.step.beliefs.distance_to(old, self.perceived(fresh)?, &self.detections.frame)
    }

    #[inline]
    fn gated_distance(
        &self,
        (old, of_old): (u32, &MemberSummary),
        (fresh, of_fresh): (u32, &MemberSummary),
    ) -> Option<f64> {
        match self.step.beliefs.features.distance_from_summaries(of_old, of_fresh) {
            Some(distance) => {
                distance.filter(|_| !self.step.beliefs.was_detected_in(old, &self.detections.frame))
            }
            None => self.distance(old, fresh),
        }
    }

    #[inline]
    fn gate_radius_m(&self, distance: f64) -> f64 {
        self.step.gate_radius_m(distance)
    }

    #[inline]
    fn is_convex_merge(&self, old: u32, fresh: u32) -> bool {
        let Beliefs { arena, features, .. } = &*self.step.beliefs;
        let Some(Detection { gate_keys, .. }) = self.detection(fresh) else { return false };
        let newer =
            || self.perceived(fresh).map(|perceived| self.step.beliefs.features_in(&perceived.snapshot));
        arena.is_older(old, self.detections.at) && features.keeps_gate_keys(old, *gate_keys, newer)
    }

    #[inline]
    fn co_detected(&self, old: u32) -> bool {
        self.step.co_detected(old)
    }

    fn remains_cannot_link(&self, a: u32, b: u32) -> bool {
        self.step.remains_cannot_link(a, b)
    }

    fn wants_prefetch(&self) -> bool {
        self.step.beliefs.arena.exceeds_cache()
    }

    #[inline]
    fn expect(&self, old: u32, fresh: u32, soon: bool) {
        self.step.beliefs.arena.prefetch(old, soon);
        if !soon && let Some(perceived) = self.perceived(fresh) {
            prefetch::prefetch_whole(perceived);
        }
    }

    fn merge(&mut self, old: u32, fresh: u32) {
        let Some(index) = require!(self.index(fresh), "{fresh} is a detection of this step") else { return };
        let Detections { things, frame, at, .. } = &mut *self.detections;
        let detection = require!(things.get_mut(index), "detection {index} exists");
        let Some(Detection { entry, gate_keys, .. }) = detection else { return };
        let perceived = self.step.perceived.get(*entry as usize);
        if let Some(perceived) = require!(perceived, "detection {index} is assigned once") {
            self.step.beliefs.add_observation(old, [*at, self.now], perceived, *gate_keys, frame);
            *entry = ASSIGNED;
        }
    }
}

impl Beliefs {
    /// Whether position and symbols usually suffice to find the belief of a detection, and the belief's new features
    /// can be predicted before its histories are updated.
    pub(super) fn can_associate_by_summary(&self) -> bool {
        self.features.suffice_by_summary() && self.has_cannot_link()
    }

    /// Position and gate keys of a snapshot.
    #[inline(always)]
    fn summary(&self, snapshot: &Snapshot) -> (Option<[f32; 3]>, GateKeys) {
        self.features.summary(snapshot, self.arena.prevalidated(), self.arena.all_histories())
    }

    /// The features of a snapshot that the metric compares, in the order of its terms.
    fn features_in(&self, snapshot: &Snapshot) -> [Option<Feature>; MAX_PERCEPTS] {
        self.features.features_in(snapshot, self.arena.prevalidated(), self.arena.all_histories())
    }

    /// D between a belief and a detection of a frame; `None` if it is not below the threshold or the two cannot be
    /// linked.
    fn distance_to(&self, slot: u32, perceived: &Perceived, frame: &Interval) -> Option<f64> {
        let distance = self.features.distance_to(slot, &self.features_in(&perceived.snapshot))?;
        (!self.was_detected_in(slot, frame)).then_some(distance)
    }

    #[inline]
    fn was_detected_in(&self, slot: u32, frame: &Interval) -> bool {
        self.detection_history
            .as_ref()
            .is_some_and(|detection_history| detection_history.was_detected_in(slot as usize, frame))
    }

    /// Assigns a detection of a `frame` to a belief. `at` is the detection's time, later than every sample of the
    /// belief; `now` is the step's. The result equals [`Self::create`] followed by [`Self::merge`].
    fn add_observation(
        &mut self,
        slot: u32,
        [at, now]: [Instant; 2],
        perceived: &Perceived,
        newer: GateKeys,
        frame: &Interval,
    ) {
        if !self.arena.add_observation(slot, [at, now], perceived) {
            return;
        }
        let Self { arena, features, detection_history } = self;
        features.predict(slot, at, perceived, newer, arena.prevalidated(), arena.all_histories());
        if let Some(detection_history) = detection_history {
            detection_history.add(slot as usize, frame);
        }
    }
}
