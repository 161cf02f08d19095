use std::collections::BTreeMap;

use geometry::{Base, Person, Pose, Position, Thing};
use message::{Belief, BeliefHead, Feature, NOBODY, Remembered};
use serde::{Deserialize, Serialize};

use crate::{Identities, Language};

/// A state is on from this degree upwards, and off from `1 - ON` downwards; in between it stays
/// as it was, so that noise about one half is no change.
const ON: f32 = 0.6;

/// A deep copy of what one perspective believes at an instant: Snp(t, P) in the paper.
///
/// It shares nothing with the belief system it was taken from: low-pass histories rewrite their
/// past, and a snapshot must not change with them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// The instant it speaks about, in nanoseconds of the clock.
    pub at_ns: u64,
    /// Position of the perspective's own frame in the robot's base frame, in metres.
    pub frame_position_m: [f64; 3],
    /// Orientation of that frame, quaternion `[x, y, z, w]`.
    pub frame_orientation_xyzw: [f64; 4],
    /// The objects, in the order of their identities.
    pub objects: Vec<Object>,
}

/// One remembered object.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// Its identity within the perspective.
    pub id: u64,
    /// Class features by name: `colour` is `red`.
    pub features: BTreeMap<String, String>,
    /// States by name; an object has no entry for a state that it cannot be in.
    #[serde(default)]
    pub states: BTreeMap<String, bool>,
    /// Its centre in the robot's base frame, in metres, whatever the perspective.
    #[serde(default)]
    pub position_m: Option<[f64; 3]>,
    /// Half its extents, in metres.
    #[serde(default)]
    pub half_extents_m: Option<[f64; 3]>,
    /// How far it is turned about the vertical in the robot's base frame, in radians.
    #[serde(default)]
    pub heading_rad: Option<f64>,
    /// The agent to whom it belongs in the eyes of the perspective; none where it is everybody's.
    #[serde(default)]
    pub owner: Option<u16>,
    /// The agent who has it in hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_by: Option<u16>,
}

impl Snapshot {
    /// A copy of a belief buffer.
    ///
    /// `identities` says which object a belief is about. `previous` is an earlier snapshot of the
    /// same perspective, if there is one: a state whose degree is near one half stays as it was
    /// there. Percepts whose numbers are nonsense are left out.
    #[must_use]
    pub fn of(
        language: &Language,
        head: &BeliefHead,
        beliefs: &[Belief],
        identities: &Identities,
        previous: Option<&Self>,
    ) -> Self {
        let frame = head.frame().unwrap_or_else(Pose::identity);
        let mut objects: Vec<Object> = beliefs
            .iter()
            .map(|belief| {
                let id = identities.object(belief.id);
                object(language, &frame, belief, id, previous.and_then(|past| past.object(id)))
            })
            .collect();
        objects.sort_by_key(|object| object.id);
        Self {
            at_ns: head.header.valid_at_ns,
            frame_position_m: frame.position_m(),
            frame_orientation_xyzw: frame.orientation_xyzw(),
            objects,
        }
    }

    /// The object of an identity.
    #[must_use]
    pub fn object(&self, id: u64) -> Option<&Object> {
        self.objects.iter().find(|object| object.id == id)
    }

    /// The same with those objects alone that `keeps` says.
    #[must_use]
    pub(crate) fn filtered(&self, keeps: impl Fn(&Object) -> bool) -> Self {
        let objects = self.objects.iter().filter(|object| keeps(object)).cloned().collect();
        Self { objects, ..*self }
    }

    /// The object of the same class features nearest to a place, within `within_m` of it.
    #[must_use]
    pub fn nearest(
        &self,
        features: &BTreeMap<String, String>,
        place_m: [f64; 3],
        within_m: f64,
    ) -> Option<&Object> {
        self.objects
            .iter()
            .filter(|object| object.features == *features)
            .filter_map(|object| object.distance(place_m).map(|distance| (distance, object)))
            .filter(|(distance, _)| *distance <= within_m)
            .min_by(|(a, _), (b, _)| a.total_cmp(b))
            .map(|(_, object)| object)
    }
}

impl Object {
    /// Distance of its centre from a place in the robot's base frame, in metres.
    #[must_use]
    pub fn distance(&self, place_m: [f64; 3]) -> Option<f64> {
        let [x, y, z] = place_m;
        self.position().map(|position| position.distance(&Position::new(x, y, z)))
    }

    /// Its centre.
    #[must_use]
    pub fn position(&self) -> Option<Position<Base>> {
        self.position_m.map(|[x, y, z]| Position::new(x, y, z))
    }
}

fn object(
    language: &Language,
    frame: &Pose<Base, Person>,
    belief: &Belief,
    id: u64,
    past: Option<&Object>,
) -> Object {
    let mut features = BTreeMap::new();
    for words in &language.features {
        if let Some(Feature::Symbol(symbol)) = belief.percept(words.percept).and_then(Remembered::feature)
            && let Some(value) = words.values.get(usize::from(symbol))
        {
            features.insert(words.name.clone(), value.clone());
        }
    }
    let mut states = BTreeMap::new();
    for words in &language.states {
        if let Some(Feature::Number(degree)) = belief.percept(words.percept).and_then(Remembered::feature) {
            let before = past.and_then(|past| past.states.get(&words.name)).copied();
            states.insert(words.name.clone(), is_on(degree, before));
        }
    }
    Object {
        id,
        features,
        states,
        position_m: position(language, belief).map(|place| (*frame * place).to_array()),
        half_extents_m: language.extents.and_then(|percept| belief.vector(percept)),
        heading_rad: language.orientation.and_then(|percept| heading_rad(frame, belief, percept)),
        owner: Some(belief.owner).filter(|owner| *owner != NOBODY),
        held_by: Some(belief.held_by).filter(|holder| *holder != NOBODY),
    }
}

fn heading_rad(frame: &Pose<Base, Person>, belief: &Belief, percept: u16) -> Option<f64> {
    let Feature::Orientation(xyzw) = belief.percept(percept).and_then(Remembered::feature)? else {
        return None;
    };
    let x_person_thing = Pose::<Person, Thing>::from_parts([0.0; 3], xyzw.map(f64::from))?;
    Some((*frame * x_person_thing).heading_rad())
}

/// Whether a state is on, given its degree and what it was.
pub(crate) fn is_on(degree: f32, before: Option<bool>) -> bool {
    match before {
        _ if degree >= ON => true,
        _ if degree <= 1.0 - ON => false,
        Some(before) => before,
        None => degree > 0.5,
    }
}

/// Where a belief remembers its object to be, in the frame of its perspective.
pub(crate) fn position(language: &Language, belief: &Belief) -> Option<Position<Person>> {
    belief.vector(language.position).map(|[x, y, z]| Position::new(x, y, z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_in_doubt_stays_as_it_was() {
        assert!(is_on(0.45, Some(true)) && !is_on(0.55, Some(false)));
        assert!(is_on(0.65, Some(false)) && !is_on(0.35, Some(true)));
        assert!(is_on(0.55, None) && !is_on(0.45, None));
    }

    #[test]
    fn places_are_in_the_base_frame_whoever_believes_them() {
        let language = Language {
            features: Vec::new(),
            states: Vec::new(),
            position: 0,
            orientation: None,
            extents: None,
            moved_m: 0.03,
        };
        let mut head = BeliefHead::of(1, message::Header::at(5));
        let x_base_person = Pose::<Base, Person>::upright(1.5, 0.0, 0.0, std::f64::consts::PI);
        head.frame_position_m = x_base_person.position_m();
        head.frame_orientation_xyzw = x_base_person.orientation_xyzw();
        let mut belief = Belief::new(7, 0, 0, 1, NOBODY);
        belief.push(Remembered::new(0, 0, 1.0, 1.0, Feature::Vector([1.0, 0.25, 0.0])));
        let snapshot = Snapshot::of(&language, &head, &[belief], &Identities::default(), None);
        let place = snapshot.objects[0].position().unwrap();
        assert!(place.distance(&Position::new(0.5, -0.25, 0.0)) < 1e-9, "{place:?}");
    }
}
