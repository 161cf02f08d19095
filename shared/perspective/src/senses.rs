use geometry::{Base, Person, Pose, Position, Thing};
use message::{Modality, Observation, ObservationKind, Perceived};
use perception::{Frame, Perception};
use quantity::number::single;
use scene::{Samples, Sight};

use crate::PerceptualContext;
use crate::field::is_partly_visible;
use crate::gaze::Gaze;
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
    /// `None` if the edge of the cone is hard.
    pub(crate) gaze: Option<Gaze>,
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
        let visibility = place.map_or(0.0, |(place, half)| self.visibility(observation, &place, half));
        let seen = place.filter(|_| visibility > 0.0);
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
        if visibility < 1.0 && !self.scale_confidence(visibility) {
            self.perceived.pop();
            self.hidden += 1;
            if let Some(visible) = self.visible.last_mut() {
                *visible = false;
            }
            return;
        }
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

    /// Scales the confidence of the last observation by its visibility; `false` if no percept passes any more (Eq. 2).
    fn scale_confidence(&mut self, visibility: f64) -> bool {
        self.perceived.last_mut().is_some_and(|Perceived { observation, snapshot }| {
            observation.confidence *= single(visibility);
            *snapshot = self.perception.perceive(observation, &self.frame);
            !snapshot.values().is_empty()
        })
    }

    /// V (Eq. 8): 1 or 0, or with a soft edge of the cone a probability, which is the visible share times that of the
    /// cone.
    fn visibility(
        &self,
        observation: &Observation,
        x_base_thing: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
    ) -> f64 {
        let is_soft = observation.kind() == Some(ObservationKind::Object)
            && observation.modality() == Some(Modality::Vision)
            && observation.held_by != self.frame.agent;
        match self.gaze.filter(|_| is_soft) {
            None => f64::from(u8::from(self.perceives(observation, x_base_thing, half_extents_m))),
            Some(gaze) => {
                let share = self.sight.visible_share(x_base_thing, half_extents_m, self.samples);
                share * gaze.probability(self.sight.angle_rad(&x_base_thing.origin()))
            }
        }
    }

    /// Whether the agent probably sees a point.
    pub(crate) fn sees(&self, point: &Position<Base>) -> bool {
        self.gaze.is_none_or(|gaze| gaze.is_likely(self.sight.angle_rad(point))) && self.sight.sees(point)
    }

    /// Whether a point is certainly in the cone of the agent.
    pub(crate) fn is_certain(&self, point: &Position<Base>) -> bool {
        self.gaze.is_none_or(|gaze| gaze.is_certain(self.sight.angle_rad(point)))
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
                self.gaze.is_none_or(|gaze| gaze.is_likely(self.sight.angle_rad(&x_base_thing.origin())))
                    && self.sight.visible_share(x_base_thing, half_extents_m, self.samples) > MAJORITY
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
