use clock::Instant;
use message::{Feature, MAX_PERCEPTS, Perceived, Snapshot, SourceSet};
use quantity::number::saturating_u32;

use super::{Arena, Holds, Step, evaluation};
use crate::cluster::{Population, Seen, Symbols};
use crate::memory::Memory;
use crate::metric::Reach;
use crate::room::Room;
use crate::sightings::Run;

/// What a step perceived in one frame and no belief has taken in yet: of each thing no more than it takes to
/// find the belief that will.
///
/// Nearly all that is perceived is of a thing that is believed in already, and is over with the step. It is not
/// made a belief of its own first (N, Eq. 6): what there was to write, to read again and to take out of the way
/// would be most of the cost. Those that are left are [made beliefs](Self::admit) then, and so are all where it takes
/// more to find out who becomes whom.
#[derive(Clone, Debug)]
pub(crate) struct Arrivals {
    things: Room<Arrival>,
    /// Their numbers, behind those of all slots.
    numbers: Box<[u32]>,
    /// The frame that they are of, if it is one.
    frame: Run,
    /// When they are remembered.
    at: Instant,
}

#[derive(Clone, Copy, Debug)]
struct Arrival {
    /// Of what was perceived; [`TAKEN_IN`] once a belief has it.
    entry: u32,
    place_m: Option<[f32; 3]>,
    symbols: Symbols,
}

const TAKEN_IN: u32 = u32::MAX;

impl Arrivals {
    /// Room for as many as there are slots.
    pub(crate) fn new(slots: usize) -> Self {
        let first = saturating_u32(slots);
        Self {
            things: Room::for_most(slots),
            numbers: (first..first.saturating_mul(2)).collect(),
            frame: Run::of(0, Instant::EPOCH),
            at: Instant::EPOCH,
        }
    }

    /// Notes an entry of what was perceived, remembered at `at`. `false` where there is no room for one
    /// belief more.
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

    /// All are noted, and all of one frame: `before` says of a source and an instant which frame of the source was
    /// the one before.
    pub(crate) fn follow(&mut self, arena: &mut Arena, before: impl Fn(u16, Instant) -> Option<Instant>) {
        self.frame.follows = before(self.frame.source, self.frame.first);
        if let Some(sightings) = &mut arena.sightings {
            sightings.follow_frame((!self.things.is_empty()).then_some(self.frame));
        }
    }

    /// Forgets all that are no entry of so many; how many they are.
    pub(crate) fn keep_within(&mut self, entries: usize) -> u64 {
        let before = self.things.len();
        // They come in the order of the entries.
        while self.things.pop_if(|arrival| arrival.entry as usize >= entries).is_some() {}
        u64::from(saturating_u32(before - self.things.len()))
    }

    /// Makes a belief of each that none has taken in, as in a step at `now`, the first of all having the identity
    /// `first_new`.
    pub(crate) fn admit(&mut self, arena: &mut Arena, first_new: u64, now: Instant, perceived: &[Perceived]) {
        for (id, arrival) in (first_new..).zip(self.things.drain(..)) {
            let Arrival { entry, .. } = arrival;
            // What a belief has is in no entry.
            if let Some(perceived) = perceived.get(entry as usize) {
                let at = Instant::from_nanos(perceived.observation.observed_at_ns).min(now);
                arena.create(id, [at, now], entry, perceived);
            }
        }
    }
}

/// The beliefs of earlier steps, and what has arrived.
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

/// Old members are in slots, fresh ones have the numbers behind them.
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

    /// Nobody waits for who has changed.
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
    /// Whether all there is to know of what is perceived, to find the belief that takes it in, is seen at a
    /// glance as a rule, and what that belief becomes is known before its histories have taken it in.
    pub(crate) fn glances(&self) -> bool {
        let finds = self.reach.is_some() && self.metric.weight_of_place().is_some();
        self.foreseen && finds && self.keeps_apart() && self.terms.len() <= MAX_PERCEPTS
    }

    /// Place and symbols of what is perceived.
    #[inline(always)]
    fn glance(&self, snapshot: &Snapshot) -> (Option<[f32; 3]>, Symbols) {
        let feature = |term: usize| self.feature_in(snapshot, *self.terms.get(term)?);
        let place = self.reach.and_then(|Reach { term, .. }| feature(term)?.vector());
        (place, self.metric.symbols(feature))
    }

    /// All features of what is perceived that the metric compares, in the order of its terms.
    fn features_in(&self, snapshot: &Snapshot) -> [Option<Feature>; MAX_PERCEPTS] {
        let mut features = [None; MAX_PERCEPTS];
        for (feature, percept) in features.iter_mut().zip(&self.terms) {
            *feature = self.feature_in(snapshot, *percept);
        }
        features
    }

    /// D of a belief and what is perceived in a frame, where it is below the threshold and they may be merged.
    fn distance_to(&self, slot: u32, perceived: &Perceived, frame: &Run) -> Option<f64> {
        let features = self.features_in(&perceived.snapshot);
        let distance = self.metric.below_threshold(self.features(slot), &features)?;
        (!self.saw(slot, frame)).then_some(distance)
    }

    #[inline]
    fn saw(&self, slot: u32, frame: &Run) -> bool {
        self.sightings.as_ref().is_some_and(|sightings| sightings.saw(slot as usize, frame))
    }

    /// Whether a belief has histories, and all that they remember is older.
    #[inline]
    fn is_older(&self, slot: u32, at: Instant) -> bool {
        let has_histories = matches!(self.holds(slot), Holds::Histories(_));
        let is_older = |memory: &Memory| memory.perceived_at < at;
        has_histories && (self.latest < at || self.memory(slot).is_some_and(is_older))
    }

    /// A belief takes in what was perceived in a `frame`, remembered `at`, later than all that it remembers, and
    /// taken in `now`: what [`Self::create`] and [`Self::merge`] come to, without a belief in between.
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
        // As a rule it has the same symbols and keeps them: then there is its place besides.
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

    /// The features that the metric compares become what they will be when a belief has taken in a snapshot.
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
