//! Copies a belief buffer into a snapshot.

use std::collections::BTreeMap;

use geometry::{Base, Person, Pose, Position, Thing};
use message::{Belief, BeliefHead, Feature, NOBODY, Remembered};

use super::identity::Identities;
use super::snapshot::{Object, Snapshot};
use crate::language::Language;

/// A state switches on at this degree and off at `1 - ON`. In between it keeps its value (hysteresis), so noise
/// around one half does not toggle it.
const ON: f32 = 0.6;

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
    fn an_uncertain_state_keeps_its_earlier_value() {
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
