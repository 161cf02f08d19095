use belief::percepts::{Component, Kernel, Percept, Percepts, Range, Role};
use clock::Duration;
use message::{Belief, Modality, Observation, SourceSet};

use super::workspace::{AWAY, EYES, TABLE, Workspace, block, button, is_present, person, wall};
use crate::settings::Perspective;

const SECOND: Duration = Duration::from_secs(1);

/// The state `on` in the robot's and the partner's only belief.
fn believed(world: &Workspace) -> (Option<f32>, Option<f32>) {
    let (robots, his) = (world.robots(), world.his());
    assert_eq!((robots.len(), his.len()), (1, 1));
    (world.number(&robots[0], "on"), world.number(&his[0], "on"))
}

#[test]
fn a_false_belief_persists_until_the_partner_looks_again() {
    let mut world = Workspace::new();
    world.run(SECOND, &[person(EYES, TABLE), button(0.0)]);
    assert_eq!(believed(&world), (Some(0.0), Some(0.0)));
    world.run(SECOND, &[person(EYES, AWAY), button(0.0)]);
    world.run(SECOND * 5, &[person(EYES, AWAY), button(1.0)]);
    assert_eq!(believed(&world), (Some(1.0), Some(0.0)));
    world.step(&[person(EYES, TABLE), button(1.0)]);
    assert_eq!(believed(&world), (Some(1.0), Some(1.0)));
}

#[test]
fn the_beliefs_of_an_absent_partner_freeze_until_the_return() {
    let mut world = Workspace::new();
    world.run(SECOND, &[person(EYES, TABLE), button(0.0)]);
    // Until the absence timeout the partner counts as present: an observation may have been missed.
    world.run(SECOND, &[button(0.0)]);
    assert!(!is_present(&world.partner));
    let frozen = world.his();
    world.run(SECOND * 10, &[button(1.0)]);
    assert_eq!(world.his(), frozen);
    assert_eq!(believed(&world), (Some(1.0), Some(0.0)));
    let head = world.partner.head(message::Header::at(0));
    assert_eq!((head.present, head.perceivable, head.hidden), (0, 0, 1));
    world.step(&[person(EYES, TABLE), button(1.0)]);
    assert!(is_present(&world.partner));
    assert_eq!(believed(&world), (Some(1.0), Some(1.0)));
    assert_eq!(world.his()[0].id, frozen[0].id);
}

#[test]
fn a_partner_that_was_never_seen_has_no_beliefs() {
    let mut world = Workspace::new();
    world.run(SECOND, &[button(0.0)]);
    assert_eq!((world.robots().len(), world.his().len()), (1, 0));
}

#[test]
fn a_partner_notices_a_missing_object_only_in_view() {
    let mut world = Workspace::new();
    world.run(SECOND, &[person(EYES, TABLE), block([0.6, 0.0, 0.03])]);
    world.run(SECOND * 3, &[person(EYES, AWAY)]);
    assert_eq!((world.robots().len(), world.his().len()), (0, 1));
    world.run(SECOND * 3, &[person(EYES, TABLE)]);
    assert_eq!(world.his().len(), 0);
}

#[test]
fn an_object_moved_unseen_stays_at_its_last_seen_place() {
    let mut world = Workspace::new();
    world.run(SECOND, &[person(EYES, TABLE), block([0.6, 0.0, 0.03])]);
    world.run(SECOND * 3, &[person(EYES, AWAY), block([0.6, 0.5, 0.03])]);
    let his = world.his();
    assert_eq!(his.len(), 1);
    let [x, y, z] = world.his_place(&his[0]).to_array();
    assert!((x - 0.6).abs() < 1e-3 && y.abs() < 1e-3 && (z - 0.03).abs() < 1e-3, "{x} {y} {z}");
}

#[test]
fn a_partner_perceives_handled_objects_without_looking() {
    let mut world = Workspace::new();
    world.run(SECOND, &[person(EYES, AWAY), block([0.6, 0.0, 0.03])]);
    assert_eq!(world.his().len(), 0);
    let others = Observation { held_by: 2, ..block([0.6, 0.0, 0.03]) };
    world.step(&[person(EYES, AWAY), others]);
    assert_eq!(world.his().len(), 0);
    let held = Observation { held_by: 1, ..block([0.6, 0.0, 0.03]) };
    world.step(&[person(EYES, AWAY), held]);
    assert_eq!(world.his().len(), 1);
}

#[test]
fn hearing_passes_barriers_and_touch_is_private() {
    let mut world = Workspace::new();
    let felt = Observation { modality: Modality::Touch.raw(), ..block([0.6, 0.0, 0.03]) };
    world.step(&[person(EYES, TABLE), felt]);
    assert_eq!((world.robots().len(), world.his().len()), (1, 0));
    let heard = Observation { modality: Modality::Hearing.raw(), ..felt };
    world.step(&[person(EYES, AWAY), wall([0.8, 0.0, 0.125]), heard]);
    assert_eq!(world.his().len(), 1);
    let mut far = Workspace::new();
    far.step(&[person([20.0, 0.0, 0.55], [0.6, 0.0, 0.0]), heard]);
    assert_eq!((far.robots().len(), far.his().len()), (1, 0));
}

#[test]
fn a_partners_left_is_not_the_robots_left() {
    let mut world = Workspace::new();
    world.step(&[person(EYES, TABLE), block([0.75, 0.3, 0.03])]);
    assert_eq!(world.number(&world.robots()[0], "left"), Some(1.0));
    assert_eq!(world.number(&world.his()[0], "left"), Some(0.0));
    let [x, y, z] = world.position(&world.his()[0]);
    assert!((x - 0.75).abs() < 1e-5 && (y + 0.3).abs() < 1e-5 && (z - 0.03).abs() < 1e-5, "{x} {y} {z}");
}

#[test]
fn remembered_objects_stay_in_place_when_the_partner_walks() {
    let mut world = Workspace::new();
    world.run(SECOND, &[person(EYES, TABLE), block([0.6, 0.2, 0.03])]);
    let first = world.partner.frame().unwrap();
    // The partner walks with their back to the table: nothing is perceived again.
    world.run(SECOND, &[person([0.75, 1.2, 0.55], [0.75, 3.0, 0.55])]);
    let (moved_m, turned_rad) = first.difference(&world.partner.frame().unwrap());
    assert!(moved_m > 1.0 && turned_rad > 1.0, "the frame was not taken anew");
    let his = world.his();
    assert_eq!(his.len(), 1);
    let [x, y, z] = world.his_place(&his[0]).to_array();
    assert!((x - 0.6).abs() < 1e-5 && (y - 0.2).abs() < 1e-5 && (z - 0.03).abs() < 1e-5, "{x} {y} {z}");
    // After looking again it is the same belief.
    world.run(SECOND, &[person([0.75, 1.2, 0.55], TABLE), block([0.6, 0.2, 0.03])]);
    assert_eq!(world.his().iter().map(|belief| belief.id).collect::<Vec<_>>(), [his[0].id]);
}

#[test]
fn a_silent_source_does_not_make_objects_absent() {
    let mut world = Workspace::new();
    world.run(SECOND, &[person(EYES, TABLE), block([0.6, 0.0, 0.03])]);
    for _ in 0..600 {
        world.step_blindly();
    }
    assert_eq!((world.robots().len(), world.his().len()), (1, 1));
    // The same duration with a frame of an empty table at every step.
    world.run(SECOND * 3, &[person(EYES, TABLE)]);
    assert_eq!((world.robots().len(), world.his().len()), (0, 0));
}

#[test]
fn only_sources_that_saw_it_report_an_object_missing() {
    let mut world = Workspace::new();
    let (simulator, camera) = (SourceSet::of(0), SourceSet::of(1));
    let seen = Observation { source: 1, ..block([0.6, 0.0, 0.03]) };
    let also = block([0.6, 0.3, 0.03]);
    world.run(SECOND, &[person(EYES, TABLE), seen, also]);
    // The camera stopped: an empty frame of the first source concerns only what that source saw.
    for _ in 0..600 {
        world.step_looking(simulator, &[person(EYES, TABLE)]);
    }
    assert_eq!((world.robots().len(), world.his().len()), (1, 1));
    assert!((world.his_place(&world.his()[0]).to_array()[1]).abs() < 1e-3);
    // The camera restarts, and the thing is gone.
    world.step_looking(simulator.union(camera), &[person(EYES, TABLE)]);
    assert_eq!((world.robots().len(), world.his().len()), (0, 0));
}

/// The built-in percepts, some replaced by ranges.
fn ranged() -> Percepts {
    let mut percepts = Percepts::builtin();
    let of_state = percepts.percepts[8].clone();
    percepts.percepts.truncate(8);
    for (name, parent, range) in [
        (
            "near_me",
            "position",
            Range { component: Component::DistanceM, from: None, to: Some(0.5), softness: None },
        ),
        (
            "long",
            "extents",
            Range { component: Component::LongestM, from: Some(0.1), to: None, softness: None },
        ),
    ] {
        percepts.percepts.push(Percept {
            name: name.to_owned(),
            parent: percepts.index(parent),
            role: Role::Neither,
            kernel: Kernel::Range(range),
            ..of_state.clone()
        });
    }
    percepts
}

#[test]
fn near_depends_on_the_perspective_and_length_does_not() {
    let mut world = Workspace::perceiving(ranged(), &Perspective::builtin());
    let mut plank = block([0.3, 0.1, 0.03]);
    plank.half_extents_m = [0.03, 0.06, 0.03];
    world.step(&[person(EYES, TABLE), plank, block([1.2, 0.0, 0.03])]);
    let said = |percept: &str| {
        let of = |beliefs: Vec<Belief>| -> Vec<_> {
            beliefs.iter().map(|belief| world.number(belief, percept)).collect()
        };
        (of(world.robots()), of(world.his()))
    };
    assert_eq!(said("near_me"), (vec![Some(1.0), Some(0.0)], vec![Some(0.0), Some(1.0)]));
    assert_eq!(said("long"), (vec![Some(1.0), Some(0.0)], vec![Some(1.0), Some(0.0)]));
}

#[test]
fn a_remembered_object_becomes_near_when_the_partner_walks_there() {
    let mut world = Workspace::perceiving(ranged(), &Perspective::builtin());
    let things = [block([0.3, 0.6, 0.03]), block([1.2, 0.0, 0.03])];
    world.run(SECOND, &[person(EYES, TABLE), things[0], things[1]]);
    let near = |world: &Workspace| -> Vec<_> {
        world.his().iter().map(|belief| world.number(belief, "near_me")).collect()
    };
    assert_eq!(near(&world), [Some(0.0), Some(1.0)]);
    // The partner walks with their back to the table: nothing is perceived again.
    world.run(SECOND, &[person([0.3, 0.9, 0.55], [0.3, 3.0, 0.55])]);
    assert_eq!(near(&world), [Some(1.0), Some(0.0)]);
}
