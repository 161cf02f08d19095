use clock::Instant;
use message::Observation;

use crate::PersonSettings;
use crate::assignment::{HYPOTHESES, Row};

/// A person as one detector numbers them: a face, a body or a voice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Detection {
    source: u16,
    number: u16,
    /// The probability of each hypothesis at the last sighting.
    pub(crate) posterior: Row,
    pub(crate) at: Instant,
    /// Successive sightings that were certainly of a person without a number.
    pub(crate) sightings: u32,
}

impl Detection {
    /// A detection that is seen for the first time: every hypothesis is equally probable.
    pub(crate) fn new(observation: &Observation) -> Self {
        Self {
            source: observation.source,
            number: observation.detection,
            posterior: [uniform(); HYPOTHESES],
            at: Instant::from_nanos(observation.observed_at_ns),
            sightings: 0,
        }
    }

    /// Whether an observation is of this detection.
    pub(crate) fn is_of(&self, observation: &Observation) -> bool {
        (self.source, self.number) == (observation.source, observation.detection)
    }

    /// The probability of each hypothesis at an instant, before anything is observed there. A detector may meanwhile have
    /// given the number to another person.
    pub(crate) fn prior(&self, at: Instant, settings: &PersonSettings) -> Row {
        let half_life_s = settings.forget_s.get().max(f64::MIN_POSITIVE);
        let kept = 0.5_f64.powf(at.since(self.at).as_secs_f64() / half_life_s);
        self.posterior.map(|probability| kept * probability + (1.0 - kept) * uniform())
    }

    /// Another person has got a number: what was certainly of a person without a number may be of them.
    pub(crate) fn reconsider(&mut self, partner: usize) {
        self.sightings = 0;
        let [nobody, partners @ ..] = &mut self.posterior;
        if let Some(probability) = partner.checked_sub(1).and_then(|index| partners.get_mut(index)) {
            *nobody /= 2.0;
            *probability += *nobody;
        }
    }

    /// The detection certainly belongs to a partner from now on.
    pub(crate) fn belongs_to(&mut self, partner: usize) {
        self.sightings = 0;
        self.posterior = [0.0; HYPOTHESES];
        if let Some(probability) = self.posterior.get_mut(partner) {
            *probability = 1.0;
        }
    }
}

/// The probability of each hypothesis if nothing is known.
const fn uniform() -> f64 {
    1.0 / 9.0
}

const _: () = assert!(HYPOTHESES == 9, "`uniform` divides by their number");
