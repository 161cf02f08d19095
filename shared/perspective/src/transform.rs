use geometry::{Base, Person, Pose, Position, Thing};
use message::Observation;
use quantity::number::single;

/// Where an observation was made, in the base frame; `None` where its numbers are no pose.
#[must_use]
pub fn place_of<B>(observation: &Observation) -> Option<Pose<Base, B>> {
    Pose::from_parts(observation.position_m.map(f64::from), observation.orientation_xyzw.map(f64::from))
}

/// The pose and half extents of the box that stands for an observed thing.
#[must_use]
pub fn place_of_thing(observation: &Observation) -> Option<(Pose<Base, Thing>, [f64; 3])> {
    Some((place_of(observation)?, observation.half_extents_m.map(f64::from)))
}

/// P (Eq. 9): the observation as a person makes it, in his frame.
///
/// Only the pose changes. What is indexical besides (left, near, mine) is no part of an
/// observation: it is perceived in the new frame.
#[must_use]
pub fn observed_from(
    x_person_base: &Pose<Person, Base>,
    x_base_thing: &Pose<Base, Thing>,
    observation: &Observation,
) -> Observation {
    let x_person_thing = *x_person_base * *x_base_thing;
    Observation {
        position_m: x_person_thing.position_m().map(single),
        orientation_xyzw: x_person_thing.orientation_xyzw().map(single),
        ..*observation
    }
}

/// A remembered place of a person's frame, in the base frame.
pub(crate) fn place_in_base(x_base_person: &Pose<Base, Person>, place_m: [f32; 3]) -> Position<Base> {
    let [x, y, z] = place_m.map(f64::from);
    *x_base_person * Position::new(x, y, z)
}
