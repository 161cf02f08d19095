use geometry::{Base, Person, Pose, Thing};
use message::{Modality, Observation, ObservationKind, Perceived};
use perception::{Frame, Perception};
use scene::{Samples, Sight};

use crate::Awareness;
use crate::field::glimpses;
use crate::robot::is_object;
use crate::transform::{observe_from, place_of_thing};

/// A thing is seen when more than this share of its sample points is.
const MAJORITY: f64 = 0.5;

/// So many observations are moved into his frame before they are perceived there, and then told: what has just
/// been written is read late, and what was written long ago lies far away.
const TOGETHER: usize = 64;

/// With what an agent perceives, and what of that which his parent is aware of.
#[derive(Clone)]
pub(crate) struct Senses {
    pub(crate) frame: Frame,
    pub(crate) perception: Perception,
    pub(crate) sight: Sight,
    pub(crate) samples: Samples,
    pub(crate) hearing_range_m: f64,
    /// Whether he also perceives occluders.
    pub(crate) of_occluders: bool,
    /// V (Eq. 8) of each observation.
    pub(crate) visible: Vec<bool>,
    /// O' (Eq. 7).
    pub(crate) perceived: Vec<Perceived>,
    /// Objects that he does not perceive.
    pub(crate) hidden: usize,
    /// Observations that were none in his frame.
    pub(crate) refused: u64,
}

impl Senses {
    /// O' = {P(o') | o' ∈ O, V(o') = 1} (Eq. 7), perceived again in his frame and told at once, each with its index.
    pub(crate) fn perceive(
        &mut self,
        entries: &[Perceived],
        parent: &Awareness,
        x_base_person: &Pose<Base, Person>,
        mut tell: impl FnMut(usize, &Perceived),
    ) {
        let x_person_base = x_base_person.inverse();
        self.hidden = 0;
        self.visible.clear();
        self.perceived.clear();
        for (entries, aware) in entries.chunks(TOGETHER).zip(parent.perceives().chunks(TOGETHER)) {
            let first = self.perceived.len();
            for (entry, aware) in entries.iter().zip(aware) {
                self.look_at(entry, *aware, &x_person_base);
            }
            let perceived = self.perceived.get_mut(first..).unwrap_or(&mut []);
            for Perceived { observation, snapshot } in &mut *perceived {
                self.perception.perceive_again_in(observation, &self.frame, snapshot);
            }
            (first..).zip(perceived).for_each(|(index, perceived)| tell(index, perceived));
        }
    }

    /// V of one observation; of an object that he perceives, how it is in his frame.
    fn look_at(&mut self, entry: &Perceived, aware: bool, x_person_base: &Pose<Person, Base>) {
        let Perceived { observation, .. } = entry;
        let is_asked = aware && (is_object(entry) || self.of_occluders && is_occluder(observation));
        let place = if is_asked { place_of_thing(observation) } else { None };
        let seen = place.filter(|(place, half)| self.perceives(observation, place, *half));
        self.visible.push(seen.is_some());
        if !(aware && is_object(entry)) {
            return;
        }
        let Some((x_base_thing, _)) = seen else {
            self.hidden += 1;
            return;
        };
        self.perceived.push(*entry);
        // In its place: put together first, it would be copied twice.
        if let Some(Perceived { observation, .. }) = self.perceived.last_mut() {
            observe_from(x_person_base, &x_base_thing, observation);
            if !observation.is_placed() {
                // Further away from him than anything is.
                self.perceived.pop();
                self.refused += 1;
            }
        }
    }

    /// V (Eq. 8), for each sense its own; an actor perceives what he himself handles. Of an occluder
    /// a glimpse is enough.
    fn perceives(
        &self,
        observation: &Observation,
        x_base_thing: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
    ) -> bool {
        if observation.held_by == self.frame.agent {
            return true;
        }
        match observation.modality() {
            Some(Modality::Vision) if is_occluder(observation) => {
                glimpses(&self.sight, x_base_thing, half_extents_m)
            }
            Some(Modality::Vision) => {
                self.sight.visible_share(x_base_thing, half_extents_m, self.samples) > MAJORITY
            }
            Some(Modality::Hearing) => {
                self.sight.eye().distance(&x_base_thing.origin()) <= self.hearing_range_m
            }
            // What the robot feels in its own joints, nobody else feels.
            Some(Modality::Touch) | None => false,
        }
    }
}

fn is_occluder(observation: &Observation) -> bool {
    observation.kind() == Some(ObservationKind::Occluder)
}
