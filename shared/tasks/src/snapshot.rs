use std::collections::BTreeMap;

use geometry::{Base, Person, Pose, Position, Thing};
use message::{Belief, BeliefHead, Feature, NOBODY, Remembered};
use serde::{Deserialize, Serialize};

use crate::{Identities, Language};

/// A state switches on at this degree and off at `1 - ON`. In between it keeps its value (hysteresis), so noise
/// around one half does not toggle it.
const ON: f32 = 0.6;

/// A deep copy of what one perspective believes at an instant: Snp(t, P) in the paper.
///
/// It shares no data with the belief system. Low-pass histories rewrite their past, and a snapshot must not
/// change with them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// The instant of the beliefs, in nanoseconds of the clock.
    pub at_ns: u64,
    /// Position of the perspective's own frame in the robot's base frame, in metres.
    pub frame_position_m: [f64; 3],
    /// Orientation of that frame, quaternion `[x, y, z, w]`.
    pub frame_orientation_xyzw: [f64; 4],
    /// The objects, sorted by identity.
    pub objects: Vec<Object>,
}

/// One remembered object.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// Its identity within the perspective.
    pub id: u64,
    /// Class features by name: `colour` is `red`.
    pub features: BTreeMap<String, String>,
    /// States by name; there is no entry for a state that the object cannot have.
    #[serde(default)]
    pub states: BTreeMap<String, bool>,
    /// Its centre in the robot's base frame, in metres, for every perspective.
    pub position_m: Option<[f64; 3]>,
    /// Half its extents, in metres.
    pub half_extents_m: Option<[f64; 3]>,
    /// Its heading about the vertical in the robot's base frame, in radians.
    pub heading_rad: Option<f64>,
    /// The agent that owns it according to this perspective; `None` if it is shared.
    pub owner: Option<u16>,
    /// The agent that holds it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_by: Option<u16>,
}

impl Snapshot {
    /// Copies a belief buffer.
    ///
    /// `identities` maps beliefs to objects. `previous` is an earlier snapshot of the same perspective, if any: it
    /// provides the state of the hysteresis. Percepts with invalid numbers are left out.
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

    /// The object with an identity.
    #[must_use]
    pub fn object(&self, id: u64) -> Option<&Object> {
        self.objects.iter().find(|object| object.id == id)
    }

    /// A copy with only the objects for which `keeps` holds.
    #[must_use]
    pub(crate) fn filtered(&self, keeps: impl Fn(&Object) -> bool) -> Self {
        let objects = self.objects.iter().filter(|object| keeps(object)).cloned().collect();
        Self { objects, ..*self }
    }

    /// The nearest object with the same class features within `within_m` of a position.
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
    /// Distance of its centre from a position in the robot's base frame, in metres.
    #[must_use]
    pub fn distance(&self, place_m: [f64; 3]) -> Option<f64> {
        let [x, y, z] = place_m;
        self.position().map(|position| position.distance(&Position::new(x, y, z)))
    }

    /// Its centre in the robot's base frame.
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

/// Whether a state is on, given its degree and its previous value.
pub(crate) fn is_on(degree: f32, before: Option<bool>) -> bool {
    match before {
        _ if degree >= ON => true,
        _ if degree <= 1.0 - ON => false,
        Some(before) => before,
        None => degree > 0.5,
    }
}

/// The believed position of an object, in the frame of the perspective.
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
    fn positions_are_in_the_base_frame_for_every_perspective() {
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
