use clock::Instant;
use message::{NOBODY, Observation, ObservationKind};

use crate::PersonSettings;
use crate::assignment::{Assignment, HYPOTHESES, MAX_PERSONS, Row};
use crate::detection::Detection;
use crate::track::{NEWCOMERS_PER_M3, Place, Track};

/// Maximum number of detections of persons in a frame of one source. More are left unnamed.
pub const MAX_DETECTIONS: usize = 16;
/// Number of detections that are remembered, of all sources. A new one replaces the one that was not seen for the longest.
const MAX_REMEMBERED: usize = 64;
/// Recognition is never surer than this, whatever confidence it states.
const MAX_RECOGNITION: f64 = 0.99;

/// The partners as far as detections tell, and what each detection belongs to. Allocates only in `new`.
#[derive(Clone, Debug)]
pub struct Persons {
    settings: PersonSettings,
    tracks: [Option<Track>; MAX_PERSONS],
    detections: Vec<Detection>,
    assignment: Assignment,
    /// The detections of a frame: the index of the observation and of the detection.
    found: Vec<(usize, usize)>,
    rows: Vec<Row>,
}

impl Persons {
    /// No partner has been detected.
    #[must_use]
    pub fn new(settings: &PersonSettings) -> Self {
        Self {
            settings: *settings,
            tracks: [None; MAX_PERSONS],
            detections: Vec::with_capacity(MAX_REMEMBERED),
            assignment: Assignment::new(MAX_DETECTIONS),
            found: Vec::with_capacity(MAX_DETECTIONS),
            rows: Vec::with_capacity(MAX_DETECTIONS),
        }
    }

    /// Sets `partner` in each observation of a frame that has a `detection`. It is [`NOBODY`] if no partner is probable
    /// enough. The observations are of one source and in the robot's base frame.
    ///
    /// - A person with both numbers is recognized: `partner` before the call is evidence of the observation's confidence.
    /// - A person with a partner alone is that partner: no detection of this frame is them too.
    /// - A hand with a detection belongs to whom the person with this detection belongs.
    pub fn identify(&mut self, observations: &mut [Observation]) {
        self.found.clear();
        self.rows.clear();
        let mut taken = 0;
        for (index, observation) in observations.iter().enumerate().filter(|(_, seen)| is_person(seen)) {
            if observation.detection == 0 {
                taken |= self.take_named(observation);
            } else if self.found.len() < MAX_DETECTIONS {
                let detection = self.detection(observation);
                self.found.push((index, detection));
                let row = self.weights(observation, detection);
                self.rows.push(row);
            }
        }
        if !self.found.is_empty() {
            self.assignment.solve(&mut self.rows, taken);
        }
        observations.iter_mut().filter(|seen| is_person(seen) && seen.detection != 0).for_each(unname);
        for place in 0..self.found.len() {
            let (Some(&(index, detection)), Some(&row)) = (self.found.get(place), self.rows.get(place))
            else {
                continue;
            };
            if let Some(observation) = observations.get_mut(index) {
                observation.partner = self.decide(observation, detection, row);
            }
        }
        for hand in observations.iter_mut().filter(|seen| is_hand(seen) && seen.detection != 0) {
            hand.partner = self.owner(hand);
        }
    }

    /// Removes what does not become a percept after [`Self::identify`]: detections without a partner, whose number is
    /// returned, and detections of persons without an orientation, who have no known line of sight.
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

    /// Takes a person whom the source names itself; returns the set of this partner.
    fn take_named(&mut self, observation: &Observation) -> u8 {
        let index = usize::from(observation.partner).checked_sub(1);
        let Some((index, track)) = index.and_then(|index| Some((index, self.tracks.get_mut(index)?))) else {
            return 0;
        };
        follow(track, &place(observation, &self.settings), &self.settings);
        1 << index
    }

    /// The index of an observation's detection, which is remembered from now on.
    fn detection(&mut self, observation: &Observation) -> usize {
        if let Some(known) = self.detections.iter().position(|known| known.is_of(observation)) {
            return known;
        }
        let new = Detection::new(observation);
        if self.detections.len() < MAX_REMEMBERED {
            self.detections.push(new);
            return self.detections.len() - 1;
        }
        // None of this frame is replaced: they are the newest, and fewer than are remembered.
        let oldest = (0..).zip(&self.detections).min_by_key(|(_, known)| known.at);
        let index = oldest.map_or(0, |(index, _)| index);
        if let Some(slot) = self.detections.get_mut(index) {
            *slot = new;
        }
        index
    }

    /// The weight of each hypothesis about a detection, up to a common factor.
    fn weights(&mut self, observation: &Observation, detection: usize) -> Row {
        let Some(detection) = self.detections.get_mut(detection) else { return [0.0; HYPOTHESES] };
        let place = place(observation, &self.settings);
        let mut row = detection.prior(place.at, &self.settings);
        detection.at = detection.at.max(place.at);
        let recognized = Some(usize::from(observation.partner)).filter(|_| observation.partner != NOBODY);
        let confidence = f64::from(observation.confidence).min(MAX_RECOGNITION);
        for (hypothesis, weight) in row.iter_mut().enumerate() {
            let track = hypothesis.checked_sub(1).and_then(|index| self.tracks.get(index)?.as_ref());
            let is_recognized = recognized == Some(hypothesis);
            *weight *= match track.filter(|track| track.is_current(place.at, &self.settings)) {
                Some(track) => track.density_per_m3(&place, &self.settings),
                None if hypothesis == 0 || is_recognized => NEWCOMERS_PER_M3,
                None => 0.0,
            };
            if recognized.is_some() {
                *weight *= if is_recognized { confidence } else { 1.0 - confidence };
            }
        }
        row
    }

    /// The partner of a detection after all evidence, or [`NOBODY`].
    fn decide(&mut self, observation: &Observation, detection: usize, row: Row) -> u16 {
        let Some(known) = self.detections.get_mut(detection) else { return NOBODY };
        known.posterior = row;
        let Some(best) = certain(&row, &self.settings) else {
            known.sightings = 0;
            return NOBODY;
        };
        let place = place(observation, &self.settings);
        let partner = if best == 0 {
            known.sightings = known.sightings.saturating_add(1);
            if known.sightings < self.settings.sightings {
                return NOBODY;
            }
            let free = self.tracks.iter().position(Option::is_none);
            let Some(partner) = free.map(|index| index + 1) else { return NOBODY };
            // The other detections of this frame are other persons.
            let found = &self.found;
            let is_elsewhere = |index: usize| !found.iter().any(|(_, here)| *here == index);
            let others = self.detections.iter_mut().enumerate().filter(|(index, _)| is_elsewhere(*index));
            others.for_each(|(_, other)| other.reconsider(partner));
            if let Some(known) = self.detections.get_mut(detection) {
                known.belongs_to(partner);
            }
            partner
        } else {
            known.sightings = 0;
            best
        };
        if let Some(track) = partner.checked_sub(1).and_then(|index| self.tracks.get_mut(index)) {
            follow(track, &place, &self.settings);
        }
        u16::try_from(partner).unwrap_or(NOBODY)
    }

    /// The partner to whom a hand belongs, or [`NOBODY`].
    fn owner(&self, hand: &Observation) -> u16 {
        let at = Instant::from_nanos(hand.observed_at_ns);
        let known = self.detections.iter().find(|known| known.is_of(hand));
        let best = known.and_then(|known| certain(&known.prior(at, &self.settings), &self.settings));
        best.filter(|best| *best > 0).and_then(|best| u16::try_from(best).ok()).unwrap_or(NOBODY)
    }
}

/// The hypothesis that is probable enough, if any.
fn certain(row: &Row, settings: &PersonSettings) -> Option<usize> {
    row.iter().position(|probability| *probability >= settings.min_probability.get())
}

/// Moves a partner's track to a detection, or begins it there.
fn follow(track: &mut Option<Track>, place: &Place, settings: &PersonSettings) {
    match track {
        Some(track) if track.is_current(place.at, settings) => track.update(place, settings),
        _ => *track = Some(Track::new(place)),
    }
}

/// The position of an observation, with the variance that it states and that of the place on the body.
fn place(observation: &Observation, settings: &PersonSettings) -> Place {
    let spread_m2 = settings.spread_m.get().powi(2);
    Place {
        position_m: observation.position_m.map(f64::from),
        variance_m2: observation.position_sd_m.map(|sd_m| f64::from(sd_m).powi(2) + spread_m2),
        at: Instant::from_nanos(observation.observed_at_ns),
    }
}

fn is_person(observation: &Observation) -> bool {
    observation.kind() == Some(ObservationKind::Person)
}

fn is_hand(observation: &Observation) -> bool {
    observation.kind() == Some(ObservationKind::Hand)
}

fn unname(observation: &mut Observation) {
    observation.partner = NOBODY;
}

#[cfg(test)]
mod tests;
