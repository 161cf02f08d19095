use clock::{Duration, Instant};
use geometry::{Base, Eye, Pose};
use message::{Observation, ObservationKind, Perceived};
use scene::Occluders;

use crate::field::Field;
use crate::occluders::RememberedOccluders;
use crate::transform::place_of;

/// What one perspective is aware of: all that a perspective within it is made from.
///
/// Allocates in `new` alone.
#[derive(Clone, Debug)]
pub struct Awareness {
    perceives: Vec<bool>,
    eyes: Vec<Option<(Pose<Base, Eye>, Instant)>>,
    absent_after: Duration,
    occluders: RememberedOccluders,
    looked: bool,
    capacity: usize,
}

impl Awareness {
    /// Aware of nothing yet, of up to `partners` partners and `capacity` observations at once.
    #[must_use]
    pub fn new(config: &config::perspective::Perspective, partners: u16, capacity: usize) -> Self {
        Self {
            perceives: Vec::with_capacity(capacity),
            eyes: vec![None; usize::from(partners)],
            absent_after: config.sight.absent_after_ms.duration(),
            occluders: RememberedOccluders::new(&config.occluders),
            looked: false,
            capacity,
        }
    }

    /// Takes note of an instant: of each observation that `perceives` lets through, and of eyes
    /// and occluders among them. Observations beyond the capacity are not perceived. Unless anybody
    /// `looked`, nothing is taken to be gone.
    pub(crate) fn note(
        &mut self,
        at: Instant,
        looked: bool,
        entries: &[Perceived],
        field: &Field,
        perceives: impl Fn(&Perceived) -> bool,
    ) {
        self.looked = looked;
        self.perceives.clear();
        self.occluders.begin();
        for entry in entries.iter().take(self.capacity) {
            let perceived = perceives(entry);
            self.perceives.push(perceived);
            if perceived {
                self.note_one(at, &entry.observation);
            }
        }
        self.occluders.end(at, looked.then_some(field));
    }

    fn note_one(&mut self, at: Instant, observation: &Observation) {
        // What claims to have been observed later than now would outlive everything.
        let observed_at = Instant::from_nanos(observation.observed_at_ns).min(at);
        match observation.kind() {
            Some(ObservationKind::Person) => {
                let index = observation.partner.checked_sub(1).map(usize::from);
                let slot = index.and_then(|index| self.eyes.get_mut(index));
                if let (Some(slot), Some(x_base_eye)) = (slot, place_of(observation))
                    && slot.is_none_or(|(_, noted_at)| noted_at <= observed_at)
                {
                    *slot = Some((x_base_eye, observed_at));
                }
            }
            Some(ObservationKind::Occluder) => {
                let _remembered = self.occluders.observe(observation, observed_at);
            }
            Some(ObservationKind::Object) | None => {}
        }
    }

    /// Whether any sensory process observed anything new at this instant: only then does an absence
    /// say that a thing is gone.
    #[must_use]
    pub fn looked(&self) -> bool {
        self.looked
    }

    /// Which observations of this instant the perspective perceives, in their order.
    #[must_use]
    pub fn perceives(&self) -> &[bool] {
        &self.perceives
    }

    /// The eye of partner `agent`; `None` while he is absent or was never perceived.
    #[must_use]
    pub fn eye(&self, agent: u16, at: Instant) -> Option<Pose<Base, Eye>> {
        let index = usize::from(agent.checked_sub(1)?);
        let (x_base_eye, noted_at) = self.eyes.get(index).copied().flatten()?;
        (at.since(noted_at) <= self.absent_after).then_some(x_base_eye)
    }

    /// The occluders that it remembers, in the base frame.
    #[must_use]
    pub fn occluders(&self) -> &Occluders {
        self.occluders.shapes()
    }
}
