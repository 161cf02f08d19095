use clock::Instant;
use message::{Feature, MAX_PERCEPTS, Perceived, Snapshot, SourceSet};
use quantity::number::saturating_u32;

use super::{Arena, Holds, Step, evaluation};
use crate::cluster::{Population, Seen, Symbols};
use crate::memory::Memory;
use crate::metric::Reach;
use crate::room::Room;
use crate::sightings::Run;

/// The detections of one frame that are not assigned yet, each with only the data needed to find its belief.
///
/// Nearly every detection belongs to an existing belief and is discarded after the step. Creating a belief for each (N,
/// Eq. 6) would write, read and free a slot, which would dominate the cost. Unassigned detections [become
/// beliefs](Self::admit) at the end. If the association needs the full clustering loop, all of them do.
#[derive(Clone, Debug)]
pub(crate) struct Arrivals {
    things: Room<Arrival>,
    /// The member numbers of the detections, which follow those of all slots.
    numbers: Box<[u32]>,
    /// The frame of the detections, if it is only one.
    frame: Run,
    /// The time at which they are stored.
    at: Instant,
}

#[derive(Clone, Copy, Debug)]
struct Arrival {
    /// Index into the perceived things; [`TAKEN_IN`] once assigned to a belief.
    entry: u32,
    place_m: Option<[f32; 3]>,
    symbols: Symbols,
}

const TAKEN_IN: u32 = u32::MAX;

impl Arrivals {
    /// Capacity for as many detections as there are slots.
    pub(crate) fn new(slots: usize) -> Self {
        let first = saturating_u32(slots);
        Self {
            things: Room::for_most(slots),
            numbers: (first..first.saturating_mul(2)).collect(),
            frame: Run::of(0, Instant::EPOCH),
            at: Instant::EPOCH,
        }
    }

    /// Records a detection by its entry, to be stored with time `at`. `false` if the arena has no free slot for it.
    #[inline]
    pub(crate) fn note(&mut self, arena: &Arena, at: Instant, entry: u32, perceived: &Perceived) -> bool {
        if self.things.len() + arena.live().len() >= arena.slots() {
            return false;
        }
        if self.things.is_empty() {
            let Perceived { observation, .. } = perceived;
            self.frame = Run::of(observation.source, Instant::from_nanos(observation.observed_at_ns));
            self.at = at;
        }
        let (place_m, symbols) = arena.glance(&perceived.snapshot);
        self.things.push(Arrival { entry, place_m, symbols });
        true
    }

    /// Called once all detections are recorded, which are all of one frame. `before` returns the instant of a source's
    /// frame that precedes the given one.
    pub(crate) fn follow(&mut self, arena: &mut Arena, before: impl Fn(u16, Instant) -> Option<Instant>) {
        self.frame.follows = before(self.frame.source, self.frame.first);
        if let Some(sightings) = &mut arena.sightings {
            sightings.follow_frame((!self.things.is_empty()).then_some(self.frame));
        }
    }

    /// Removes the detections whose entry is not below `entries`; returns their number.
    pub(crate) fn keep_within(&mut self, entries: usize) -> u64 {
        let before = self.things.len();
        // They are in the order of their entries.
        while self.things.pop_if(|arrival| arrival.entry as usize >= entries).is_some() {}
        u64::from(saturating_u32(before - self.things.len()))
    }

    /// Creates a belief for each unassigned detection, in a step at `now`. Identity `first_new` belongs to the first of
    /// all detections.
    pub(crate) fn admit(&mut self, arena: &mut Arena, first_new: u64, now: Instant, perceived: &[Perceived]) {
        for (id, arrival) in (first_new..).zip(self.things.drain(..)) {
            let Arrival { entry, .. } = arrival;
            // An assigned detection has no entry.
            if let Some(perceived) = perceived.get(entry as usize) {
                let at = Instant::from_nanos(perceived.observation.observed_at_ns).min(now);
                arena.create(id, [at, now], entry, perceived);
            }
        }
    }
}

/// The association problem of one frame: the beliefs of earlier steps and the detections.
pub(crate) struct Arriving<'a> {
    pub(crate) step: Step<'a>,
    pub(crate) arrivals: &'a mut Arrivals,
    pub(crate) first_new: u64,
    pub(crate) now: Instant,
}

impl Arriving<'_> {
    fn index(&self, number: u32) -> Option<usize> {
        (number as usize).checked_sub(self.step.arena.slots())
    }

    #[inline]
    fn arrival(&self, number: u32) -> Option<&Arrival> {
        self.arrivals.things.get(self.index(number)?)
    }

    fn perceived(&self, number: u32) -> Option<&Perceived> {
        self.step.perceived.get(self.arrival(number)?.entry as usize)
    }
}

/// Tracks are numbered by their slots; the numbers of detections follow.
impl Population for Arriving<'_> {
    #[inline]
    fn old(&self) -> &[u32] {
        self.step.old()
    }

    #[inline]
    fn fresh(&self) -> &[u32] {
        self.arrivals.numbers.get(..self.arrivals.things.len()).unwrap_or(&[])
    }

    fn lives(&self, number: u32) -> bool {
        match self.index(number) {
            None => self.step.lives(number),
            Some(_) => self.arrival(number).is_some_and(|arrival| arrival.entry != TAKEN_IN),
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
        match self.arrival(number) {
            None => self.step.place(number),
            Some(arrival) => arrival.place_m,
        }
    }

    #[inline]
    fn symbols(&self, number: u32) -> Symbols {
        self.arrival(number).map_or_else(|| self.step.symbols(number), |arrival| arrival.symbols)
    }

    fn distance(&self, old: u32, fresh: u32) -> Option<f64> {
        self.step.arena.distance_to(old, self.perceived(fresh)?, &self.arrivals.frame)
    }

    #[inline]
    fn distance_seen(&self, (old, of_old): (u32, &Seen), (fresh, of_fresh): (u32, &Seen)) -> Option<f64> {
        match self.step.arena.distance_at_a_glance(of_old, of_fresh) {
            Some(distance) => distance.filter(|_| !self.step.arena.saw(old, &self.arrivals.frame)),
            None => self.distance(old, fresh),
        }
    }

    #[inline]
    fn reach_m(&self, distance: f64) -> f64 {
        self.step.reach_m(distance)
    }

    #[inline]
    fn takes_in(&self, old: u32, fresh: u32) -> bool {
        let arena = &*self.step.arena;
        let Some(Arrival { symbols, .. }) = self.arrival(fresh) else { return false };
        let features = || self.perceived(fresh).map(|perceived| arena.features_in(&perceived.snapshot));
        arena.is_older(old, self.arrivals.at) && arena.keeps_symbols(old, *symbols, features)
    }

    #[inline]
    fn is_companion(&self, old: u32) -> bool {
        self.step.is_companion(old)
    }

    fn stay_apart(&self, a: u32, b: u32) -> bool {
        self.step.stay_apart(a, b)
    }

    fn are_expected(&self) -> bool {
        self.step.arena.are_many()
    }

    #[inline]
    fn expect(&self, old: u32, fresh: u32, soon: bool) {
        self.step.arena.prefetch(old, soon);
        if !soon && let Some(perceived) = self.perceived(fresh) {
            prefetch::prefetch_whole(perceived);
        }
    }

    fn merge(&mut self, old: u32, fresh: u32) {
        let Some(index) = self.index(fresh) else { return };
        let Arrivals { things, frame, at, .. } = &mut *self.arrivals;
        let Some(Arrival { entry, symbols, .. }) = things.get_mut(index) else { return };
        if let Some(perceived) = self.step.perceived.get(*entry as usize) {
            self.step.arena.take_in(old, [*at, self.now], perceived, *symbols, frame);
            *entry = TAKEN_IN;
        }
    }
}

impl Arena {
    /// Whether position and symbols usually suffice to find the belief of a detection, and the belief's new features
    /// can be predicted before its histories are updated.
    pub(crate) fn glances(&self) -> bool {
        let finds = self.reach.is_some() && self.metric.weight_of_place().is_some();
        self.foreseen && finds && self.keeps_apart() && self.terms.len() <= MAX_PERCEPTS
    }

    /// Position and gate keys of a snapshot.
    #[inline(always)]
    fn glance(&self, snapshot: &Snapshot) -> (Option<[f32; 3]>, Symbols) {
        let feature = |term: usize| self.feature_in(snapshot, *self.terms.get(term)?);
        let place = self.reach.and_then(|Reach { term, .. }| feature(term)?.vector());
        (place, self.metric.symbols(feature))
    }

    /// The features of a snapshot that the metric compares, in the order of its terms.
    fn features_in(&self, snapshot: &Snapshot) -> [Option<Feature>; MAX_PERCEPTS] {
        let mut features = [None; MAX_PERCEPTS];
        for (feature, percept) in features.iter_mut().zip(&self.terms) {
            *feature = self.feature_in(snapshot, *percept);
        }
        features
    }

    /// D between a belief and a detection of a frame; `None` if it is not below the threshold or the two cannot be
    /// linked.
    fn distance_to(&self, slot: u32, perceived: &Perceived, frame: &Run) -> Option<f64> {
        let features = self.features_in(&perceived.snapshot);
        let distance = self.metric.below_threshold(self.features(slot), &features)?;
        (!self.saw(slot, frame)).then_some(distance)
    }

    #[inline]
    fn saw(&self, slot: u32, frame: &Run) -> bool {
        self.sightings.as_ref().is_some_and(|sightings| sightings.saw(slot as usize, frame))
    }

    /// Whether a belief has histories, and all its samples are older than `at`.
    #[inline]
    fn is_older(&self, slot: u32, at: Instant) -> bool {
        let has_histories = matches!(self.holds(slot), Holds::Histories(_));
        let is_older = |memory: &Memory| memory.perceived_at < at;
        has_histories && (self.latest < at || self.memory(slot).is_some_and(is_older))
    }

    /// Assigns a detection of a `frame` to a belief. `at` is the detection's time, later than every sample of the
    /// belief; `now` is the step's. The result equals [`Self::create`] followed by [`Self::merge`].
    fn take_in(
        &mut self,
        slot: u32,
        [at, now]: [Instant; 2],
        perceived: &Perceived,
        newer: Symbols,
        frame: &Run,
    ) {
        let Perceived { observation, snapshot } = perceived;
        let (Some(row), Some(memory)) = (self.row(slot), self.memories.get_mut(slot as usize)) else {
            return;
        };
        memory.take_in(at, now, observation.held_by, SourceSet::of(observation.source));
        self.latest = self.latest.max(at);
        let phase = memory.id;
        // Usually the symbols are unchanged, and only the position needs an update.
        if self.symbols.get(slot as usize) == Some(&newer)
            && self.metric.are_all_told(newer)
            && let Some(Reach { term, .. }) = self.reach
        {
            let feature = self.features.get_mut(slot as usize * self.terms.len() + term);
            if let (Some(feature), Some(percept)) = (feature, self.terms.get(term))
                && let Some(value) = evaluation(snapshot, *percept, self.trusts)
            {
                self.histories.foresee(*percept, feature, value);
            }
        } else {
            self.foresee_all(slot, snapshot);
        }
        self.change(slot);
        if let Some(sightings) = &mut self.sightings {
            sightings.add(slot as usize, frame);
        }
        self.unsound += self.histories.take_all(row, snapshot.values(), self.trusts, at, phase);
    }

    /// Updates the compared features to the values they have once the belief has stored the snapshot.
    #[inline(never)]
    fn foresee_all(&mut self, slot: u32, snapshot: &Snapshot) {
        let terms = self.terms.len();
        let features = slot as usize * terms..(slot as usize + 1) * terms;
        let (Some(features), Some(symbols)) =
            (self.features.get_mut(features), self.symbols.get_mut(slot as usize))
        else {
            return;
        };
        for (feature, percept) in features.iter_mut().zip(&self.terms) {
            if let Some(value) = evaluation(snapshot, *percept, self.trusts) {
                self.histories.foresee(*percept, feature, value);
            }
        }
        *symbols = self.metric.symbols_of(features);
    }
}
