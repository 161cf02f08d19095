use geometry::{Base, Person, Pose, Thing};
use message::{Modality, Observation, ObservationKind, Perceived};
use perception::{Frame, Perception};
use scene::{Samples, Sight};

use crate::PerceptualContext;
use crate::field::is_partly_visible;
use crate::robot::{is_hand, is_object};
use crate::transform::{observe_from, place_of_thing};

/// A thing is seen if more than this share of its sample points is visible.
const MAJORITY: f64 = 0.5;

/// Number of observations that are transformed before they are perceived again. A batch this small stays in
/// the cache and still hides the store-to-load latency.
const TOGETHER: usize = 64;

/// The senses of an agent and what they perceived of the parent's observations.
#[derive(Clone)]
pub(crate) struct Senses {
    pub(crate) frame: Frame,
    pub(crate) perception: Perception,
    pub(crate) sight: Sight,
    pub(crate) samples: Samples,
    pub(crate) hearing_range_m: f64,
    /// Whether occluders are perceived too.
    pub(crate) sees_occluders: bool,
    /// V (Eq. 8) of each observation.
    pub(crate) visible: Vec<bool>,
    /// O' (Eq. 7).
    pub(crate) perceived: Vec<Perceived>,
    /// Number of hands in `perceived`.
    pub(crate) hands: usize,
    /// Number of objects not perceived.
    pub(crate) hidden: usize,
    /// Number of observations that are invalid in the agent's frame.
    pub(crate) refused: u64,
}

impl Senses {
    /// O' = {P(o') | o' ∈ O, V(o') = 1} (Eq. 7), perceived again in the agent's frame. Calls `tell` with each
    /// entry and its index.
    pub(crate) fn perceive(
        &mut self,
        entries: &[Perceived],
        parent: &PerceptualContext,
        x_base_person: &Pose<Base, Person>,
        mut tell: impl FnMut(usize, &Perceived),
    ) {
        let x_person_base = x_base_person.inverse();
        self.hidden = 0;
        self.hands = 0;
        self.visible.clear();
        self.perceived.clear();
        for (entries, aware) in entries.chunks(TOGETHER).zip(parent.perceives().chunks(TOGETHER)) {
            let first = self.perceived.len();
            for (entry, aware) in entries.iter().zip(aware) {
                self.look_at(entry, *aware, &x_person_base);
            }
            let perceived = self.perceived.get_mut(first..).unwrap_or(&mut []);
            for Perceived { observation, snapshot } in &mut *perceived {
                self.perception.reperceive(observation, &self.frame, snapshot);
            }
            (first..).zip(perceived).for_each(|(index, perceived)| tell(index, perceived));
        }
    }

    /// Evaluates V of one observation and, for a perceived object, transforms it into the agent's frame.
    fn look_at(&mut self, entry: &Perceived, aware: bool, x_person_base: &Pose<Person, Base>) {
        let Perceived { observation, .. } = entry;
        let (is_object, is_hand) = (is_object(entry), is_hand(entry));
        let is_asked = aware && (is_object || is_hand || self.sees_occluders && is_occluder(observation));
        let place = if is_asked { place_of_thing(observation) } else { None };
        let seen = place.filter(|(place, half)| self.perceives(observation, place, *half));
        self.visible.push(seen.is_some());
        if !(aware && (is_object || is_hand)) {
            return;
        }
        let Some((x_base_thing, _)) = seen else {
            self.hidden += usize::from(is_object);
            return;
        };
        self.hands += usize::from(is_hand);
        self.perceived.push(*entry);
        // Written in place to avoid a second copy.
        if let Some(Perceived { observation, .. }) = self.perceived.last_mut() {
            observe_from(x_person_base, &x_base_thing, observation);
            if !observation.is_placed() {
                // Out of range in the agent's frame.
                self.perceived.pop();
                self.hands -= usize::from(is_hand);
                self.refused += 1;
            }
        }
    }

    /// V (Eq. 8) by modality. An agent always perceives what it holds, and its hands. Any visible part of an occluder
    /// is enough.
    fn perceives(
        &self,
        observation: &Observation,
        x_base_thing: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
    ) -> bool {
        let is_own_hand =
            observation.kind() == Some(ObservationKind::Hand) && observation.partner == self.frame.agent;
        if is_own_hand || observation.held_by == self.frame.agent {
            return true;
        }
        match observation.modality() {
            Some(Modality::Vision) if is_occluder(observation) => {
                is_partly_visible(&self.sight, x_base_thing, half_extents_m)
            }
            Some(Modality::Vision) => {
                self.sight.visible_share(x_base_thing, half_extents_m, self.samples) > MAJORITY
            }
            Some(Modality::Hearing) => {
                self.sight.eye().distance(&x_base_thing.origin()) <= self.hearing_range_m
            }
            // Touch is the robot's own: no other agent perceives it.
            Some(Modality::Touch) | None => false,
        }
    }
}

fn is_occluder(observation: &Observation) -> bool {
    observation.kind() == Some(ObservationKind::Occluder)
}
