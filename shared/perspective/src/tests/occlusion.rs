use clock::Duration;
use message::{Header, Observation, SourceSet};

use super::workspace::{EYES, TABLE, Workspace, block, is_present, person, wall};
use crate::settings::{Field, Perspective};

const SECOND: Duration = Duration::from_secs(1);
/// Behind the wall for the partner.
const HIDDEN: [f32; 3] = [0.4, 0.0, 0.03];
const OPEN: [f32; 3] = [0.9, 0.0, 0.03];
const WALL: [f32; 3] = [0.5, 0.0, 0.125];

#[test]
fn a_block_behind_a_barrier_never_enters_the_partners_beliefs() {
    let mut world = Workspace::new();
    world.run(SECOND * 3, &[wall(WALL), person(EYES, TABLE), block(HIDDEN), block(OPEN)]);
    assert_eq!(world.robots().len(), 2);
    let his = world.his();
    assert_eq!(his.len(), 1);
    assert!((world.his_place(&his[0]).to_array()[0] - 0.9).abs() < 1e-3);
    let head = world.partner.head(Header::at(0));
    assert_eq!((head.perceivable, head.hidden), (1, 1));
    // Control: without the barrier the block is seen.
    let mut open = Workspace::new();
    open.run(SECOND, &[person(EYES, TABLE), block(HIDDEN), block(OPEN)]);
    assert_eq!(open.his().len(), 2);
}

#[test]
fn persons_and_barriers_never_become_beliefs() {
    let mut world = Workspace::new();
    let other = Observation { partner: 2, ..person([0.7, 0.5, 0.3], EYES) };
    world.run(SECOND, &[wall(WALL), person(EYES, TABLE), other]);
    assert_eq!((world.robots().len(), world.his().len()), (0, 0));
}

/// The robot looks aside; the wall and the block behind it are out of view.
fn looking_aside(looks_at_m: [f64; 3]) -> Perspective {
    let mut config = Perspective::builtin();
    config.robot.eye_m = [0.0, 0.0, 0.5].map(|part| part.try_into().unwrap());
    config.robot.looks_at_m = looks_at_m.map(|part| part.try_into().unwrap());
    config.robot.field_of_view =
        Field::Cone { half_angle_deg: 40.0.try_into().unwrap(), range_m: 3.0.try_into().unwrap() };
    config
}

#[test]
fn a_barrier_hides_while_it_is_not_observed_itself() {
    let mut world = Workspace::with(&looking_aside([0.0, 1.0, 0.0]));
    world.run(SECOND, &[wall(WALL), person(EYES, TABLE)]);
    world.run(SECOND * 5, &[person(EYES, TABLE), block(HIDDEN)]);
    assert_eq!((world.robots().len(), world.his().len()), (1, 0));
}

#[test]
fn a_barrier_missing_from_its_observed_place_is_removed() {
    let mut world = Workspace::with(&looking_aside([0.5, 0.0, 0.0]));
    world.run(SECOND, &[wall(WALL), person(EYES, TABLE)]);
    world.step(&[person(EYES, TABLE), block(HIDDEN)]);
    assert_eq!(world.his().len(), 0);
    world.run(SECOND, &[person(EYES, TABLE), block(HIDDEN)]);
    assert_eq!(world.his().len(), 1);
}

#[test]
fn a_barrier_is_missed_by_the_source_that_saw_it() {
    let mut world = Workspace::with(&looking_aside([0.5, 0.0, 0.0]));
    let (simulator, camera) = (SourceSet::of(0), SourceSet::of(1));
    world.run(SECOND, &[Observation { source: 1, ..wall(WALL) }, person(EYES, TABLE)]);
    let without = [person(EYES, TABLE), block(HIDDEN)];
    for _ in 0..600 {
        world.step_looking(simulator, &without);
    }
    assert_eq!((world.robot.perceptual_context().occluders().len(), world.his().len()), (1, 0));
    for _ in 0..100 {
        world.step_looking(camera, &without);
        assert_eq!((world.robot.perceptual_context().occluders().len(), world.his().len()), (1, 0));
    }
    world.step_looking(camera, &without);
    assert_eq!(
        (world.robot.perceptual_context().occluders().len(), world.his().len()),
        (0, 1),
        "half a second"
    );
}

#[test]
fn a_barrier_out_of_view_is_not_culled_at_first_sight() {
    let mut world = Workspace::with(&looking_aside([0.5, 0.0, 0.0]));
    world.run(SECOND, &[wall(WALL), person(EYES, TABLE)]);
    let aside = Observation { partner: 0, ..person([0.06, 0.0, 0.62], [0.0, 2.0, 0.5]) };
    world.run(SECOND * 3, &[aside, person(EYES, TABLE)]);
    let back = Observation { partner: 0, ..person([0.06, 0.0, 0.62], [0.9, 0.0, 0.0]) };
    world.step(&[back, person(EYES, TABLE), block(HIDDEN)]);
    assert_eq!((world.robot.perceptual_context().occluders().len(), world.his().len()), (1, 0));
}

#[test]
fn a_barrier_that_is_pushed_aside_is_one_barrier() {
    let mut world = Workspace::new();
    for millimetre in 0..60_u8 {
        let aside = [0.5, f32::from(millimetre) * 0.01, 0.125];
        world.step(&[wall(aside), person(EYES, TABLE), block(HIDDEN)]);
    }
    assert_eq!(world.robot.perceptual_context().occluders().len(), 1);
    assert_eq!(world.his().len(), 1);
}

#[test]
fn barriers_beyond_the_capacity_replace_the_longest_unseen() {
    let mut config = looking_aside([0.0, -1.0, 0.0]);
    config.occluders.max_count = 2.try_into().unwrap();
    let mut world = Workspace::with(&config);
    world.step(&[wall([0.5, 1.0, 0.125]), person(EYES, TABLE)]);
    world.step(&[wall([0.5, 2.0, 0.125]), person(EYES, TABLE)]);
    world.step(&[wall(WALL), person(EYES, TABLE), block(HIDDEN)]);
    assert_eq!(world.robot.perceptual_context().occluders().len(), 2);
    assert_eq!(world.his().len(), 0);
    assert_eq!(world.overflowed(), 0);
    let three = [wall([0.5, 1.0, 0.125]), wall([0.5, 2.0, 0.125]), wall(WALL), person(EYES, TABLE)];
    world.step(&three);
    assert_eq!(world.robot.perceptual_context().occluders().len(), 2);
    assert_eq!(world.overflowed(), 1, "what hides nothing is counted");
}

#[test]
fn late_agents_and_occluders_count_as_present() {
    let mut world = Workspace::new();
    world.delay = Duration::from_millis(900);
    for _ in 0..600 {
        world.step(&[wall(WALL), person(EYES, TABLE), block(HIDDEN), block(OPEN)]);
        assert!(is_present(&world.partner));
        assert_eq!(world.robot.perceptual_context().occluders().len(), 1);
    }
    assert_eq!((world.robots().len(), world.his().len()), (2, 1));
    world.run(Duration::from_millis(250), &[]);
    assert!(is_present(&world.partner));
    world.step(&[]);
    assert!(!is_present(&world.partner));
}

#[test]
fn a_partner_does_not_miss_what_a_barrier_hides() {
    let mut world = Workspace::new();
    world.run(SECOND, &[person(EYES, TABLE), block(HIDDEN)]);
    world.run(SECOND * 3, &[wall(WALL), person(EYES, TABLE)]);
    assert_eq!((world.robots().len(), world.his().len()), (0, 1));
}

#[test]
fn a_partner_does_not_miss_what_the_robot_cannot_see() {
    let mut world = Workspace::with(&looking_aside([0.5, 0.0, 0.0]));
    world.run(SECOND, &[wall(WALL), person(EYES, TABLE), block(OPEN)]);
    assert_eq!(world.his().len(), 1);
    // The robot's head is turned away: block and wall are unobserved and may still be in place.
    let aside = Observation { partner: 0, ..person([0.06, 0.0, 0.62], [0.0, 2.0, 0.5]) };
    world.run(SECOND * 3, &[aside, person(EYES, TABLE)]);
    assert_eq!((world.robot.beliefs().len(), world.his().len()), (1, 1));
    let back = Observation { partner: 0, ..person([0.06, 0.0, 0.62], [0.9, 0.0, 0.0]) };
    world.run(SECOND * 3, &[back, person(EYES, TABLE)]);
    assert_eq!((world.robot.beliefs().len(), world.his().len()), (0, 0));
    assert!(world.robot.perceptual_context().occluders().is_empty());
}

/// A position of the study's workspace, whose y axis is the robot's x axis, in the base frame.
fn in_base(x: f32, y: f32, z: f32) -> [f32; 3] {
    [y, -x, z]
}

#[test]
fn in_the_first_task_the_teacher_sees_all_squares_but_blue() {
    let squares = [
        [(-0.35, 0.75), (-0.10, 0.85), (0.15, 0.70), (0.38, 0.90), (0.10, 0.40)],
        [(0.35, 0.75), (-0.30, 0.90), (-0.05, 0.72), (0.15, 0.95), (-0.25, 0.42)],
    ];
    let walls = [in_base(0.10, 0.51, 0.125), in_base(-0.25, 0.53, 0.125)];
    for (squares, barrier) in squares.iter().zip(walls) {
        let mut world = Workspace::new();
        let mut things = vec![person(EYES, TABLE), wall(barrier)];
        things.extend(squares.iter().map(|(x, y)| block(in_base(*x, *y, 0.03))));
        world.run(SECOND, &things);
        let blue = squares[4].1;
        let seen: Vec<_> = world.his().iter().map(|belief| world.his_place(belief).to_array()[0]).collect();
        assert_eq!((world.robots().len(), seen.len()), (5, 4));
        assert!(seen.iter().all(|x| (x - f64::from(blue)).abs() > 0.1), "{seen:?}");
    }
}
