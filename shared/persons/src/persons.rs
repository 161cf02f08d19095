use clock::Instant;
use invariant::require;
use message::{MAX_SOURCES, NOBODY, Observation, ObservationKind};

use crate::PersonSettings;
use crate::assignment::{Assignment, HYPOTHESES, MAX_PERSONS, Row};
use crate::detection::Detection;
use crate::track::{Place, Track};

/// Maximum number of detections of persons in a frame of one source. More are left unnamed.
pub const MAX_DETECTIONS: usize = 16;
/// Number of detections that are remembered of each source. A new one replaces the one that was not seen for the longest.
const MAX_REMEMBERED: usize = 2 * MAX_DETECTIONS;
/// Recognition is never surer than this, whatever confidence it states.
const MAX_RECOGNITION: f64 = 0.99;
/// A source that names a partner itself is believed from this confidence on.
const MIN_CONFIDENCE: f32 = 0.5;

/// The partners as far as detections tell, and what each detection belongs to. Allocates only in `new`.
#[derive(Clone, Debug)]
pub struct Persons {
    settings: PersonSettings,
    /// Where each partner is, if they were ever detected.
    tracks: [Option<Track>; MAX_PERSONS],
    /// The numbers that were given here, to persons without one.
    given: Partners,
    /// The numbers that are not free: given, recognized or named by a source.
    used: Partners,
    detections: Vec<Detection>,
    assignment: Assignment,
    found: Vec<Found>,
    rows: Vec<Row>,
}

/// A detection in a frame.
#[derive(Clone, Copy, Debug)]
struct Found {
    /// The index of the newest observation.
    observation: usize,
    /// The index of the detection.
    detection: usize,
    /// Whether it was never seen before.
    is_first: bool,
    /// The probability of each hypothesis without this frame.
    prior: Row,
    /// The factor of each hypothesis by recognition.
    recognition: Row,
}

/// A set of partners.
#[derive(Clone, Copy, Debug, Default)]
struct Partners(u8);

impl Partners {
    fn add(&mut self, partner: usize) {
        self.0 |= Self::bit(partner);
    }

    fn remove(&mut self, partner: usize) {
        self.0 &= !Self::bit(partner);
    }

    fn has(self, partner: usize) -> bool {
        self.0 & Self::bit(partner) != 0
    }

    fn bit(partner: usize) -> u8 {
        if (1..=MAX_PERSONS).contains(&partner) { 1 << (partner - 1) } else { 0 }
    }
}

impl Persons {
    /// No partner has been detected.
    #[must_use]
    pub fn new(settings: &PersonSettings) -> Self {
        let mut used = Partners::default();
        (1..=usize::from(settings.recognized.get())).for_each(|partner| used.add(partner));
        Self {
            settings: *settings,
            tracks: [None; MAX_PERSONS],
            given: Partners::default(),
            used,
            detections: Vec::with_capacity(MAX_SOURCES * MAX_REMEMBERED),
            assignment: Assignment::new(MAX_DETECTIONS),
            found: Vec::with_capacity(MAX_DETECTIONS),
            rows: Vec::with_capacity(MAX_DETECTIONS),
        }
    }

    /// Sets `partner` in each observation of a frame that has a `detection`. It is [`NOBODY`] if no partner is probable
    /// enough. The observations are of one source and in the robot's base frame. `quality` is the factor by which the
    /// confidence of this source was lowered.
    ///
    /// - A person with both numbers is recognized: `partner` is evidence of the stated confidence.
    /// - A person with a partner alone is that partner: no detection of this frame is them too.
    /// - A hand with a detection belongs to the partner of this detection.
    /// - The robot's own head and hands, and partners above [`MAX_PERSONS`], stay as they are.
    pub fn identify(&mut self, observations: &mut [Observation], quality: f32) {
        self.found.clear();
        self.rows.clear();
        let mut taken = Partners::default();
        for (index, observation) in observations.iter().enumerate() {
            if !is_detection(observation) {
                taken.0 |= self.take_named(observation).0;
            } else if is_person(observation) {
                self.take_detection(index, observation, quality);
            }
        }
        for found in 0..self.found.len() {
            self.weigh(found, observations);
        }
        if !self.found.is_empty() {
            self.assignment.solve(&mut self.rows, taken.0);
        }
        observations.iter_mut().filter(|seen| is_detection(seen) && is_person(seen)).for_each(unname);
        for index in 0..self.found.len() {
            let (Some(found), Some(row)) = (self.found.get(index).copied(), self.rows.get(index).copied())
            else {
                continue;
            };
            let Some(observation) = observations.get(found.observation).copied() else { continue };
            let partner = self.decide(&found, &row, &observation);
            let is_same = |seen: &&mut Observation| {
                is_detection(seen) && is_person(seen) && seen.detection == observation.detection
            };
            observations.iter_mut().filter(is_same).for_each(|seen| seen.partner = partner);
        }
        for hand in observations.iter_mut().filter(|seen| is_detection(seen) && is_hand(seen)) {
            let owner = self.owner(hand);
            if owner != NOBODY {
                hand.partner = owner;
            }
        }
    }

    /// Removes what does not become a percept after [`Self::identify`]: detections without a partner, whose number is
    /// returned, and detections of persons without an orientation: their line of sight is unknown.
    pub fn retain_identified(observations: &mut Vec<Observation>) -> u64 {
        let mut unidentified = 0;
        observations.retain(|observation| {
            if observation.detection == 0 || !(is_person(observation) || is_hand(observation)) {
                return true;
            }
            let is_named = observation.partner != NOBODY;
            unidentified += u64::from(!is_named);
            is_named && (is_hand(observation) || observation.orientation().is_some())
        });
        unidentified
    }

    /// Takes a person or a hand that the source names itself; returns the set of a person's partner.
    fn take_named(&mut self, observation: &Observation) -> Partners {
        let mut named = Partners::default();
        let partner = usize::from(observation.partner);
        if !(is_person(observation) || is_hand(observation)) || observation.confidence < MIN_CONFIDENCE {
            return named;
        }
        self.used.add(partner);
        if is_person(observation) && (1..=MAX_PERSONS).contains(&partner) {
            named.add(partner);
            self.follow(partner, &Place::of(observation, &self.settings), &[]);
        }
        named
    }

    /// Takes an observation of a detection. Of several in a frame the newest counts.
    fn take_detection(&mut self, index: usize, observation: &Observation, quality: f32) {
        let at = Instant::from_nanos(observation.observed_at_ns);
        let known = self.detections.iter().position(|known| known.is_of(observation));
        let again = known.and_then(|known| self.found.iter_mut().find(|found| found.detection == known));
        let detection = if let Some(again) = again {
            if self.detections.get(again.detection).is_some_and(|known| at > known.at) {
                again.observation = index;
            }
            again.detection
        } else {
            if self.found.len() >= MAX_DETECTIONS {
                return;
            }
            let Some(detection) = known.or_else(|| self.remember(observation)) else { return };
            self.found.push(Found {
                observation: index,
                detection,
                is_first: known.is_none(),
                prior: [0.0; HYPOTHESES],
                recognition: [1.0; HYPOTHESES],
            });
            self.rows.push([0.0; HYPOTHESES]);
            detection
        };
        let partner = usize::from(observation.partner);
        if (1..=MAX_PERSONS).contains(&partner) {
            let stated = f64::from(observation.confidence) / f64::from(quality).max(f64::MIN_POSITIVE);
            self.recognize(detection, partner, stated.min(MAX_RECOGNITION), at);
        }
    }

    /// Remembers a new detection; returns its index. Of a full source the oldest one is replaced; a trace may have more
    /// sources than a robot: then the oldest one of all.
    fn remember(&mut self, observation: &Observation) -> Option<usize> {
        let new = Detection::new(observation);
        let is_own = |known: &Detection| known.source == new.source;
        let is_full = self.detections.iter().filter(|known| is_own(known)).count() >= MAX_REMEMBERED;
        if !is_full && self.detections.len() < self.detections.capacity() {
            self.detections.push(new);
            return Some(self.detections.len() - 1);
        }
        let is_in_frame = |index: usize| self.found.iter().any(|found| found.detection == index);
        let replaceable = self
            .detections
            .iter_mut()
            .enumerate()
            .filter(|(index, known)| !is_in_frame(*index) && (!is_full || is_own(known)));
        let oldest = replaceable.min_by_key(|(_, known)| known.at);
        let (index, slot) = require!(oldest, "more detections are remembered than a frame has")?;
        *slot = new;
        Some(index)
    }

    /// Takes a recognition. If a number was given to this person before, the recognized one replaces it from now on, in all
    /// sources.
    fn recognize(&mut self, detection: usize, partner: usize, confidence: f64, at: Instant) {
        self.used.add(partner);
        let settings = self.settings;
        let Some(known) = self.detections.get_mut(detection) else { return };
        let before = certain(&known.prior(at, &settings), &settings);
        known.recognize(partner, confidence, at, &settings);
        let given = before.filter(|before| *before != partner && self.given.has(*before));
        if let Some(given) = given.filter(|_| confidence >= settings.min_probability.get()) {
            if let Some(track) = given.checked_sub(1).and_then(|index| self.tracks.get_mut(index)?.take())
                && let Some(slot) = partner.checked_sub(1).and_then(|index| self.tracks.get_mut(index))
            {
                *slot = Some(track);
            }
            // The number is not given again: there are beliefs of it.
            self.given.remove(given);
            self.detections.iter_mut().for_each(|other| other.rename(given, partner));
        }
    }

    /// Computes the weight of each hypothesis about a detection in the frame.
    fn weigh(&mut self, index: usize, observations: &[Observation]) {
        let settings = self.settings;
        let (Some(found), Some(row)) = (self.found.get_mut(index), self.rows.get_mut(index)) else { return };
        let (Some(detection), Some(observation)) =
            (self.detections.get(found.detection), observations.get(found.observation))
        else {
            return;
        };
        let place = Place::of(observation, &settings);
        let recognition = detection.recognition(place.at, &settings);
        found.prior = detection.prior(place.at, &settings);
        let anywhere = place.newcomer_per_m3();
        for hypothesis in 0..HYPOTHESES {
            let track = hypothesis.checked_sub(1).and_then(|index| self.tracks.get(index)?.as_ref());
            let here = track
                .filter(|track| track.is_current(place.at, &settings))
                .map(|track| track.density_per_m3(&place, &settings));
            let is_recognized = recognition.is_some_and(|(partner, _)| partner == hypothesis);
            let likelihood = if hypothesis == 0 {
                anywhere
            } else if is_recognized {
                // Wherever the partner was before.
                here.unwrap_or(0.0).max(anywhere)
            } else {
                here.unwrap_or(0.0)
            };
            let recognized = recognition
                .map_or(1.0, |(_, confidence)| if is_recognized { confidence } else { 1.0 - confidence });
            if let (Some(slot), Some(weight)) =
                (found.recognition.get_mut(hypothesis), row.get_mut(hypothesis))
            {
                *slot = recognized;
                *weight = found.prior.get(hypothesis).copied().unwrap_or(0.0) * likelihood * recognized;
            }
        }
    }

    /// The partner of a detection after all evidence, or [`NOBODY`].
    fn decide(&mut self, found: &Found, row: &Row, observation: &Observation) -> u16 {
        let settings = self.settings;
        let place = Place::of(observation, &settings);
        let Some(known) = self.detections.get_mut(found.detection) else { return NOBODY };
        // What the frame says beside the prior: positions and exclusion. Recognition is taken again in every frame.
        let mut evidence = *row;
        for ((evidence, prior), recognized) in evidence.iter_mut().zip(&found.prior).zip(&found.recognition) {
            *evidence /= (prior * recognized).max(f64::MIN_POSITIVE);
        }
        known.update(&found.prior, &evidence, place.at, found.is_first);
        known.last = *row;
        let partner = match certain(row, &settings) {
            Some(0) => {
                if !known.is_confirmed(place.at, &settings) {
                    return NOBODY;
                }
                let Some(free) = (1..=MAX_PERSONS).find(|partner| !self.used.has(*partner)) else {
                    return NOBODY;
                };
                self.used.add(free);
                self.given.add(free);
                free
            }
            Some(partner) => {
                known.interrupt();
                partner
            }
            None => {
                known.interrupt();
                return NOBODY;
            }
        };
        let is_new = self.tracks.get(partner - 1).is_some_and(Option::is_none);
        if is_new && let Some(known) = self.detections.get_mut(found.detection) {
            known.belongs_to(partner);
        }
        // Copied: `follow` looks at the other detections.
        let mut here = [usize::MAX; MAX_DETECTIONS];
        here.iter_mut().zip(&self.found).for_each(|(slot, found)| *slot = found.detection);
        self.follow(partner, &place, &here);
        u16::try_from(partner).unwrap_or(NOBODY)
    }

    /// Moves a partner's track to a detection, or begins it there. When it begins, detections that are not in this frame
    /// may be of this partner too.
    fn follow(&mut self, partner: usize, place: &Place, in_frame: &[usize]) {
        let settings = self.settings;
        let Some(track) = partner.checked_sub(1).and_then(|index| self.tracks.get_mut(index)) else { return };
        match track {
            Some(track) if track.is_current(place.at, &settings) => track.update(place, &settings),
            Some(track) => *track = Track::new(place),
            None => {
                *track = Some(Track::new(place));
                for (index, other) in self.detections.iter_mut().enumerate() {
                    if !in_frame.contains(&index) {
                        other.reconsider(partner);
                    }
                }
            }
        }
    }

    /// The partner of a hand, or [`NOBODY`].
    fn owner(&self, hand: &Observation) -> u16 {
        let at = Instant::from_nanos(hand.observed_at_ns);
        let known = self.detections.iter().find(|known| known.is_of(hand));
        let best = known.and_then(|known| certain(&known.presumption(at, &self.settings), &self.settings));
        best.filter(|best| *best > 0).and_then(|best| u16::try_from(best).ok()).unwrap_or(NOBODY)
    }
}

/// The hypothesis that is probable enough, if any.
fn certain(row: &Row, settings: &PersonSettings) -> Option<usize> {
    row.iter().position(|probability| *probability >= settings.min_probability.get())
}

fn is_person(observation: &Observation) -> bool {
    observation.kind() == Some(ObservationKind::Person)
}

fn is_hand(observation: &Observation) -> bool {
    observation.kind() == Some(ObservationKind::Hand)
}

/// Whether the partner is to be found out. The robot itself, and a partner beyond those that can be told apart, are known.
fn is_detection(observation: &Observation) -> bool {
    let partner = usize::from(observation.partner);
    observation.detection != 0 && (observation.partner == NOBODY || (1..=MAX_PERSONS).contains(&partner))
}

fn unname(observation: &mut Observation) {
    observation.partner = NOBODY;
}

#[cfg(test)]
mod tests;
