//! What a source did not observe is unknown to the robot and to its partners.

use clock::Duration;
use message::{Belief, Observation, UNOBSERVED};

use super::workspace::{EYES, TABLE, Workspace, block, is_present, person, wall};

const SECOND: Duration = Duration::from_secs(1);
const OPEN: [f32; 3] = [0.9, 0.0, 0.03];
/// A wall, and a place that it hides from the partner.
const WALL: [f32; 3] = [0.5, 0.0, 0.125];
const HIDDEN: [f32; 3] = [0.4, 0.0, 0.03];

/// A thing of which only the position was observed.
fn bare(position_m: [f32; 3]) -> Observation {
    Observation {
        orientation_xyzw: [UNOBSERVED; 4],
        half_extents_m: [UNOBSERVED; 3],
        colour_rgb: [UNOBSERVED; 3],
        shape: [UNOBSERVED; 4],
        ..block(position_m)
    }
}

#[test]
fn a_thing_with_only_a_place_is_believed_in_both_frames() {
    let mut world = Workspace::new();
    world.run(SECOND, &[person(EYES, TABLE), bare(OPEN)]);
    let names = |belief: &Belief| -> Vec<String> {
        let name = |percept: u16| world.percepts.get(percept).unwrap().name.clone();
        belief.percepts().iter().map(|remembered| name(remembered.percept)).collect()
    };
    let ([robots], [his]) = (&world.robots()[..], &world.his()[..]) else { panic!("one belief each") };
    assert_eq!((names(robots), names(his)), (vec!["position".to_owned(), "left".to_owned()], names(robots)));
    assert!((world.his_place(his).to_array()[0] - 0.9).abs() < 1e-3);
    assert_eq!(world.robot.refused(), 0);
}

#[test]
fn what_was_observed_before_stays_known_in_both_perspectives() {
    let mut world = Workspace::new();
    world.run(SECOND, &[person(EYES, TABLE), block(OPEN)]);
    let before = [world.robots(), world.his()].map(|beliefs| beliefs[0]);
    world.run(SECOND, &[person(EYES, TABLE), bare(OPEN)]);
    for (before, now) in before.iter().zip([world.robots(), world.his()]) {
        assert_eq!(now.len(), 1);
        for name in ["orientation", "extents", "size", "shape", "colour"] {
            let feature = |belief: &Belief| {
                belief.percept(world.percepts.index(name).unwrap()).and_then(message::Remembered::feature)
            };
            assert_eq!(feature(&now[0]), feature(before), "{name}");
        }
    }
}

#[test]
fn a_barrier_of_unknown_extents_is_refused_and_hides_nothing() {
    let mut world = Workspace::new();
    let sizeless = Observation { half_extents_m: [UNOBSERVED; 3], ..wall(WALL) };
    let turnless = Observation { orientation_xyzw: [UNOBSERVED; 4], ..wall(WALL) };
    world.step(&[sizeless, turnless, person(EYES, TABLE), block(HIDDEN)]);
    assert_eq!((world.robot.perceptual_context().occluders().len(), world.robot.refused()), (0, 2));
    assert_eq!(world.his().len(), 1);
}

#[test]
fn a_person_of_unknown_orientation_has_no_perspective() {
    let mut world = Workspace::new();
    let turnless = Observation { orientation_xyzw: [UNOBSERVED; 4], ..person(EYES, TABLE) };
    world.step(&[turnless, block(OPEN)]);
    assert_eq!((world.robots().len(), world.robot.refused()), (1, 1));
    assert!(!is_present(&world.partner));
}
