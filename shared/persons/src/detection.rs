use clock::{Duration, Instant};
use message::Observation;

use crate::PersonSettings;
use crate::assignment::{HYPOTHESES, Row};

/// Observations of a detection that are this far apart are independent evidence. Of closer ones, the same error of position
/// comes again and again.
const INDEPENDENT: Duration = Duration::from_secs(1);
/// Number of sightings, at least, after which a person gets a number.
const MIN_SIGHTINGS: u32 = 3;

/// A person as one source numbers them: a face, a body or a voice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Detection {
    pub(crate) source: u16,
    number: u16,
    /// The probability of each hypothesis after the last sighting.
    posterior: Row,
    pub(crate) at: Instant,
    /// The probability of each hypothesis in the last frame, with all of its evidence.
    pub(crate) last: Row,
    /// The most confident recognition, and its confidence.
    recognition: Option<(usize, f64)>,
    /// The successive sightings that were certainly of a person without a number, and the first of them.
    sightings: u32,
    unnumbered_since: Instant,
}

impl Detection {
    /// A detection that is seen for the first time: every hypothesis is equally probable.
    pub(crate) fn new(observation: &Observation) -> Self {
        let at = Instant::from_nanos(observation.observed_at_ns);
        Self {
            source: observation.source,
            number: observation.detection,
            posterior: [UNIFORM; HYPOTHESES],
            at,
            last: [UNIFORM; HYPOTHESES],
            recognition: None,
            sightings: 0,
            unnumbered_since: at,
        }
    }

    /// Whether an observation is of this detection.
    pub(crate) fn is_of(&self, observation: &Observation) -> bool {
        (self.source, self.number) == (observation.source, observation.detection)
    }

    /// How much of what was known at the last sighting still holds at an instant, from 1 to 0. A source may meanwhile have
    /// given the number to another person.
    fn kept(&self, at: Instant, settings: &PersonSettings) -> f64 {
        let half_life_s = settings.forget_s.get().max(1e-3);
        0.5_f64.powf(at.since(self.at).as_secs_f64() / half_life_s)
    }

    /// The probability of each hypothesis at an instant, before anything is observed there.
    pub(crate) fn prior(&self, at: Instant, settings: &PersonSettings) -> Row {
        let kept = self.kept(at, settings);
        self.posterior.map(|probability| kept * probability + (1.0 - kept) * UNIFORM)
    }

    /// The same for what is asked between two sightings: the last frame counts fully.
    pub(crate) fn presumption(&self, at: Instant, settings: &PersonSettings) -> Row {
        let kept = self.kept(at, settings);
        self.last.map(|probability| kept * probability + (1.0 - kept) * UNIFORM)
    }

    /// The recognized partner, and the confidence at an instant: one half says nothing.
    pub(crate) fn recognition(&self, at: Instant, settings: &PersonSettings) -> Option<(usize, f64)> {
        let (partner, confidence) = self.recognition?;
        Some((partner, 0.5 + self.kept(at, settings) * (confidence - 0.5)))
    }

    /// Takes a recognition. Only the most confident one counts: the same image is recognized again and again. It makes the
    /// partner possible, however certain another one was.
    pub(crate) fn recognize(
        &mut self,
        partner: usize,
        confidence: f64,
        at: Instant,
        settings: &PersonSettings,
    ) {
        if self.recognition(at, settings).is_none_or(|(_, known)| confidence >= known) {
            self.recognition = Some((partner, confidence));
        }
        if let Some(probability) = self.posterior.get_mut(partner) {
            *probability = probability.max(UNIFORM);
        }
    }

    /// Takes a sighting: its prior, and the factor of each hypothesis. Successive ones count as far as they are independent.
    pub(crate) fn update(&mut self, prior: &Row, evidence: &Row, at: Instant, is_first: bool) {
        let share = if is_first {
            1.0
        } else {
            (at.since(self.at).as_secs_f64() / INDEPENDENT.as_secs_f64()).min(1.0)
        };
        let greatest = evidence.iter().fold(f64::MIN_POSITIVE, |greatest, own| greatest.max(*own));
        let mut posterior = *prior;
        for (probability, factor) in posterior.iter_mut().zip(evidence) {
            *probability *= (factor / greatest).powf(share);
        }
        let total: f64 = posterior.iter().sum();
        if total > 0.0 {
            self.posterior = posterior.map(|probability| probability / total);
        }
        self.at = self.at.max(at);
    }

    /// Counts a sighting that was certainly of a person without a number. Returns whether they get one now.
    pub(crate) fn is_confirmed(&mut self, at: Instant, settings: &PersonSettings) -> bool {
        if self.sightings == 0 {
            self.unnumbered_since = at;
        }
        self.sightings = self.sightings.saturating_add(1);
        let is_long = at.since(self.unnumbered_since) >= settings.confirm_s.duration();
        self.sightings >= MIN_SIGHTINGS && is_long && self.recognition.is_none()
    }

    /// The sighting was not certainly of a person without a number.
    pub(crate) const fn interrupt(&mut self) {
        self.sightings = 0;
    }

    /// A person has got a number: what was certainly of a person without a number may be of them.
    pub(crate) fn reconsider(&mut self, partner: usize) {
        self.sightings = 0;
        let [nobody, partners @ ..] = &mut self.posterior;
        if let Some(probability) = partner.checked_sub(1).and_then(|index| partners.get_mut(index)) {
            *nobody /= 2.0;
            *probability += *nobody;
        }
    }

    /// What was of one partner is of another one from now on.
    pub(crate) fn rename(&mut self, from: usize, to: usize) {
        for row in [&mut self.posterior, &mut self.last] {
            let probability = row.get_mut(from).map_or(0.0, std::mem::take);
            if let Some(sum) = row.get_mut(to) {
                *sum += probability;
            }
        }
    }

    /// The detection certainly belongs to a partner.
    pub(crate) fn belongs_to(&mut self, partner: usize) {
        self.sightings = 0;
        self.posterior = [0.0; HYPOTHESES];
        if let Some(probability) = self.posterior.get_mut(partner) {
            *probability = 1.0;
        }
    }
}

/// The probability of each hypothesis if nothing is known.
const UNIFORM: f64 = 1.0 / 9.0;
const _: () = assert!(HYPOTHESES == 9, "`UNIFORM` is one divided by their number");
