use std::collections::BTreeMap;

use geometry::{Base, Position};
use message::NOBODY;

use crate::Phase;

/// Height above its start from which an object counts as lifted, in metres …
const LIFTED_M: f64 = 0.03;
/// … and sideways motion before that from which it counts as pushed instead.
const PUSHED_M: f64 = 0.05;
/// Sideways motion from which a lifted object counts as carried, in metres.
const CARRIED_M: f64 = 0.03;
/// Length of the path over which its direction is determined, in metres: above the noise of an object at rest.
const STRETCH_M: f64 = 0.015;

/// An object and its holder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Handled {
    /// Identifier of the object.
    pub id: u64,
    /// Centre of the object, in metres.
    pub centre: Position<Base>,
    /// The holder: 0 the robot, partner 1, 2, …, or [`NOBODY`].
    pub held_by: u16,
}

/// A movement of a partner that matches one of the robot's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartnerMovement {
    /// The actor: partner 1, 2, …
    pub actor: u16,
    /// Identifier of the moved object.
    pub thing: u64,
    /// Centre of the object when it was taken, or when first seen in the actor's hand, in metres.
    pub from: Position<Base>,
    /// Centre of the object as it begins to come down, in metres. The robot lowers objects straight down, so the
    /// intended place lies below.
    pub above: Position<Base>,
}

/// Recognises the robot's own movements in those of others. This is the motor level, one of the three on which a
/// partner is monitored by the robot's own actions (Berlin et al. 2006, "Architecture", after Gray et al. 2005).
///
/// The robot carries an object up, across and down ([`Phase::Lift`], [`Phase::Carry`], [`Phase::Lower`]) to
/// [insert](crate::Skill::Insert) or to [place](crate::Skill::Place) it. A partner whose object takes this path is
/// doing the same. The goal is known as the object begins to come down, before the action is complete. Pushing an
/// object along the table is no movement of the robot, and neither is lifting it and putting it back.
///
/// The result does not depend on the speed of the movement, nor on where the partner sits. But noise above 15 mm in
/// the positions looks like an up-and-down movement.
///
/// ```
/// use geometry::Position;
/// use motion::{Handled, Mirror};
///
/// let mut mirror = Mirror::default();
/// let way = [[0.5, 0.1, 0.02], [0.5, 0.1, 0.15], [0.6, -0.2, 0.15], [0.6, -0.2, 0.12]];
/// let seen = way.map(|[x, y, z]| {
///     let peg = Handled { id: 7, centre: Position::new(x, y, z), held_by: 1 };
///     mirror.step([peg])
/// });
/// assert_eq!(seen[..3], [None; 3]);
/// let movement = seen[3].expect("a movement of Leo's own");
/// assert_eq!((movement.actor, movement.thing), (1, 7));
/// ```
#[derive(Clone, Debug, Default)]
pub struct Mirror {
    paths: BTreeMap<u64, ObjectPath>,
}

/// Path of one object in one hand.
#[derive(Clone, Copy, Debug)]
struct ObjectPath {
    actor: u16,
    from: Position<Base>,
    /// Start of the stretch over which the direction is determined.
    stretch: Position<Base>,
    /// The matching phase of the robot's own carrying; `None` if there is none.
    phase: Option<Phase>,
    /// Where the object last began to come down, if that was reported.
    reported: Option<Position<Base>>,
}

impl Mirror {
    /// Updates the positions and holders of objects. Returns a movement that has just been recognised. If there are
    /// two at once, the other is returned by the next step.
    pub fn step(&mut self, things: impl IntoIterator<Item = Handled>) -> Option<PartnerMovement> {
        let mut reported = None;
        for Handled { id, centre, held_by } in things {
            let path = self.paths.entry(id).or_insert_with(|| ObjectPath::begun(held_by, centre));
            if path.actor != held_by {
                // An object at rest was taken where it was last seen. Taking an object from another hand starts a new
                // movement.
                let from = if path.actor == NOBODY { path.from } else { centre };
                *path = ObjectPath::begun(held_by, from);
            }
            if held_by == NOBODY || held_by == 0 {
                path.from = centre;
            } else if reported.is_none() && path.comes_down_at(centre) {
                reported =
                    Some(PartnerMovement { actor: held_by, thing: id, from: path.from, above: centre });
            }
        }
        reported
    }
}

impl ObjectPath {
    fn begun(actor: u16, from: Position<Base>) -> Self {
        Self { actor, from, stretch: from, phase: Some(Phase::Close), reported: None }
    }

    /// Follows the object. Returns `true` when it has just begun to come down, at another place than before.
    fn comes_down_at(&mut self, centre: Position<Base>) -> bool {
        let [aside_m, up_m] = displacement_m(&self.from, &centre);
        self.phase = match self.phase {
            Some(Phase::Close) if up_m >= LIFTED_M => Some(Phase::Lift),
            Some(Phase::Close) if aside_m > PUSHED_M => None,
            other => other,
        };
        if self.phase == Some(Phase::Lift) && aside_m > CARRIED_M {
            self.phase = Some(Phase::Carry);
        }
        let [aside_m, up_m] = displacement_m(&self.stretch, &centre);
        if aside_m.hypot(up_m) < STRETCH_M {
            return false;
        }
        self.stretch = centre;
        let goes_down = -up_m > aside_m;
        match self.phase {
            Some(Phase::Carry) if goes_down => {
                self.phase = Some(Phase::Lower);
                let is_elsewhere =
                    self.reported.is_none_or(|reported| displacement_m(&reported, &centre)[0] > PUSHED_M);
                if is_elsewhere {
                    self.reported = Some(centre);
                }
                is_elsewhere
            }
            // The actor changed their mind and carries the object on.
            Some(Phase::Lower) if !goes_down => {
                self.phase = Some(Phase::Carry);
                false
            }
            _ => false,
        }
    }
}

/// Displacement between two positions: sideways and upwards, in metres.
fn displacement_m(from: &Position<Base>, to: &Position<Base>) -> [f64; 2] {
    let path = to.point() - from.point();
    [path.x.hypot(path.y), path.z]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const TAKEN: [f64; 3] = [0.5, 0.1, 0.025];
    const OVER: [f64; 3] = [0.6, -0.2, 0.16];

    fn at([x, y, z]: [f64; 3]) -> Position<Base> {
        Position::new(x, y, z)
    }

    /// A path through these points in steps of `step_m` metres.
    fn through(points: &[[f64; 3]], step_m: f64) -> Vec<[f64; 3]> {
        let mut path = Vec::new();
        for ends in points.windows(2) {
            let (from, to) = (at(ends[0]), at(ends[1]));
            let steps = (from.distance(&to) / step_m).ceil().max(1.0);
            let mut step = 0.0;
            while step < steps {
                path.push((from.point() + (to.point() - from.point()) * (step / steps)).into());
                step += 1.0;
            }
        }
        path.extend(points.last());
        path
    }

    fn seen(path: &[[f64; 3]], held_by: u16) -> Vec<PartnerMovement> {
        let mut mirror = Mirror::default();
        path.iter()
            .filter_map(|place| mirror.step([Handled { id: 7, centre: at(*place), held_by }]))
            .collect()
    }

    fn carried(step_m: f64) -> Vec<[f64; 3]> {
        through(&[TAKEN, [0.5, 0.1, 0.16], OVER, [0.6, -0.2, 0.06]], step_m)
    }

    #[test]
    fn a_carried_object_is_reported_once_when_it_is_lowered() {
        for step_m in [0.001, 0.004, 0.02, 0.05] {
            let movements = seen(&carried(step_m), 2);
            let [PartnerMovement { actor: 2, thing: 7, from, above }] = movements[..] else {
                panic!("{step_m}: {movements:?}");
            };
            assert_eq!(from, at(TAKEN));
            assert!(above.distance(&at(OVER)) < STRETCH_M + step_m, "{above:?}");
        }
    }

    #[test]
    fn movements_of_leo_itself_are_not_reported() {
        let pushed = through(&[TAKEN, [0.6, -0.2, 0.025], [0.6, -0.2, 0.01]], 0.004);
        assert_eq!(seen(&pushed, 1), []);
        let put_back = through(&[TAKEN, [0.5, 0.1, 0.16], TAKEN], 0.004);
        assert_eq!(seen(&put_back, 1), []);
        let held_up = through(&[TAKEN, [0.5, 0.1, 0.16], OVER], 0.004);
        assert_eq!(seen(&held_up, 1), []);
        assert_eq!(seen(&carried(0.004), 0), []);
        assert_eq!(seen(&carried(0.004), NOBODY), []);
    }

    #[test]
    fn a_changed_destination_is_reported_again() {
        let twice = [TAKEN, [0.5, 0.1, 0.16], OVER, [0.6, -0.2, 0.1], [0.4, 0.3, 0.1], [0.4, 0.3, 0.05]];
        let above: Vec<f64> = seen(&through(&twice, 0.004), 1).iter().map(|it| it.above.point().y).collect();
        assert!(
            matches!(above[..], [first, second] if (first + 0.2).abs() < 0.02 && (second - 0.3).abs() < 0.02)
        );
    }

    #[test]
    fn a_hand_over_is_a_movement_of_the_receiver() {
        let mut mirror = Mirror::default();
        let path = carried(0.004);
        let half = path.len() / 2;
        let step = |(count, place): (usize, [f64; 3])| {
            let held_by = if count < half { 1 } else { 2 };
            mirror.step([Handled { id: 7, centre: at(place), held_by }])
        };
        // The second actor never lifted it, so their goal is unknown.
        assert_eq!(path.into_iter().enumerate().filter_map(step).collect::<Vec<_>>(), []);
    }

    #[test]
    fn objects_with_invalid_positions_are_not_reported_as_moved() {
        let nowhere = [TAKEN, [f64::NAN, 0.0, 0.2], [0.6, f64::INFINITY, 0.2], [f64::NAN; 3]];
        assert_eq!(seen(&nowhere, 1), []);
    }

    proptest! {
        #[test]
        fn position_noise_and_the_seat_do_not_change_the_reported_movement(
            turn in 0.0..std::f64::consts::TAU,
            noise in prop::collection::vec(prop::array::uniform3(-0.003..0.003), 256),
        ) {
            let (sin, cos) = turn.sin_cos();
            let path: Vec<[f64; 3]> = carried(0.008)
                .iter()
                .zip(noise.iter().cycle())
                .map(|([x, y, z], [dx, dy, dz])| [x * cos - y * sin + dx, x * sin + y * cos + dy, z + dz])
                .collect();
            let movements = seen(&path, 1);
            prop_assert_eq!(movements.len(), 1);
            let [x, y, _] = OVER;
            let over = Position::new(x * cos - y * sin, x * sin + y * cos, movements[0].above.point().z);
            prop_assert!(movements[0].above.distance(&over) < 0.03);
        }
    }
}
