use geometry::{Base, Person, Pose, Position, Thing};
use message::Observation;
use quantity::number::single;

/// The pose of an observation in the base frame; `None` if its orientation was not observed, or if its numbers are no
/// valid pose.
#[must_use]
pub fn place_of<B>(observation: &Observation) -> Option<Pose<Base, B>> {
    Pose::from_parts(observation.position_m.map(f64::from), observation.orientation_xyzw.map(f64::from))
}

/// The pose and half extents of the bounding box of an observed thing, in the base frame and in metres; `None` if its
/// numbers are no valid pose.
///
/// What was not observed does not prevent an answer about visibility: the box of a thing of unknown orientation is
/// upright, and that of a thing of unknown extents is a point.
#[must_use]
pub fn place_of_thing(observation: &Observation) -> Option<(Pose<Base, Thing>, [f64; 3])> {
    let is_turned = has_orientation(observation);
    let xyzw = if is_turned { observation.orientation_xyzw.map(f64::from) } else { [0.0, 0.0, 0.0, 1.0] };
    let x_base_thing = Pose::from_parts(observation.position_m.map(f64::from), xyzw)?;
    Some((x_base_thing, observation.half_extents().map_or([0.0; 3], |half_m| half_m.map(f64::from))))
}

/// Whether the orientation was observed, valid or not.
#[inline]
fn has_orientation(observation: &Observation) -> bool {
    observation.orientation_xyzw.iter().any(|part| !part.is_nan())
}

/// P (Eq. 9): brings an observation into a person's frame.
///
/// Only the pose changes. Other indexical content (left, near, mine) is not part of an observation: it is
/// perceived again in the new frame. An orientation that was not observed stays unobserved.
///
/// Example: the partner stands at x = 1.5 m facing the robot. So P(x, y, z) = (1.5 − x, −y, z), and every
/// heading changes by half a turn. A thing at (0.5, 0.25, 0.05) m, turned by a quarter to the left, maps to
/// (1.0, −0.25, 0.05) m. That is on the partner's right, turned by a quarter to the right.
///
/// ```
/// use belief::percepts::Percepts;
/// use geometry::{Base, Person, Pose, Thing};
/// use message::Observation;
/// use perception::{Frame, Perception};
/// use perspective::{observe_from, place_of};
///
/// let half = std::f32::consts::FRAC_1_SQRT_2;
/// let mine = Observation {
///     position_m: [0.5, 0.25, 0.05],
///     orientation_xyzw: [0.0, 0.0, half, half],
///     ..Observation::object(0, 1)
/// };
/// let x_base_person = Pose::<Base, Person>::upright(1.5, 0.0, 0.0, std::f64::consts::PI);
/// let x_base_thing: Pose<Base, Thing> = place_of(&mine).unwrap();
/// let mut his = mine;
/// observe_from(&x_base_person.inverse(), &x_base_thing, &mut his);
/// assert_eq!(his.position_m, [1.0, -0.25, 0.05]);
/// let turned: Pose<Base, Thing> = place_of(&his).unwrap();
/// assert!((turned.heading_rad() + std::f64::consts::FRAC_PI_2).abs() < 1e-6);
///
/// let percepts = Percepts::builtin();
/// let left = percepts.index("left").unwrap();
/// let perception = Perception::new(&percepts)?;
/// let known = perception.perceive(&mine, &Frame { agent: 0 });
/// let mut again = known;
/// perception.reperceive(&his, &Frame { agent: 1 }, &mut again);
/// let degree = |snapshot: &message::Snapshot| snapshot.value(left).unwrap().feature();
/// assert_eq!(degree(&known), Some(message::Feature::Number(1.0)));
/// assert_eq!(degree(&again), Some(message::Feature::Number(0.0)));
/// # Ok::<(), perception::PerceptionError>(())
/// ```
#[inline]
pub fn observe_from(
    x_person_base: &Pose<Person, Base>,
    x_base_thing: &Pose<Base, Thing>,
    observation: &mut Observation,
) {
    let x_person_thing = *x_person_base * *x_base_thing;
    observation.position_m = x_person_thing.position_m().map(single);
    observation.position_sd_m =
        x_person_base.position_sd_m(observation.position_sd_m.map(f64::from)).map(single);
    if has_orientation(observation) {
        observation.orientation_xyzw = x_person_thing.orientation_xyzw().map(single);
    }
}

/// Transforms a position of a person's frame into the base frame.
pub(crate) fn place_in_base(x_base_person: &Pose<Base, Person>, place_m: [f32; 3]) -> Position<Base> {
    let [x, y, z] = place_m.map(f64::from);
    *x_base_person * Position::new(x, y, z)
}
