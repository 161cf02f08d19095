use std::path::Path;

use clock::{Duration, Instant};
use config::lesson::Lesson;
use geometry::Pose;
use message::{NOBODY, Observation, ObservationKind, SceneObject, State, TeacherAct, TeacherActKind, Text};

use crate::{Hand, World};

const NO_HANDS: [Option<Hand>; 2] = [None, None];

/// Task 1 with another table and no noise: a square, a pair of pegs and a marker, and a script.
fn lesson(script: &str) -> Lesson {
    let text = include_str!("../../../config/lessons/task1.toml");
    let (head, _) = text.split_once("[[demonstration]]").unwrap();
    let head = head.replace("position_sd_m = 0.003", "position_sd_m = 0.0");
    let table = r#"
        [kind.marker]
        role = "marker"
        shape = [0.0, 1.0, 1.0, 0.0]
        half_extents_m = [0.015, 0.015, 0.005]
        hole = false
        markable = false
        [kind.slab]
        role = "block"
        shape = [0.0, 1.0, 0.0, 0.0]
        half_extents_m = [0.06, 0.04, 0.01]
        hole = false
        markable = true
        [[demonstration]]
        objects = [
          { name = "block", kind = "square", colour = "red", position_m = [0.0, 0.40], heading_deg = 30.0 },
          { name = "peg", kind = "peg", colour = "wood", position_m = [0.10, 0.40], heading_deg = 0.0 },
          { name = "other", kind = "peg", colour = "wood", position_m = [0.25, 0.40], heading_deg = 0.0 },
          { name = "marker", kind = "marker", colour = "blue", position_m = [0.0, 0.60], heading_deg = 0.0 },
          { name = "slab", kind = "slab", colour = "blue", position_m = [0.3, 0.60], heading_deg = 0.0 },
        ]
        occluders = []
        territory = []
        script = [{ at_s = 0.0, who = 1, say = "x" }, "#;
    Lesson::parse(&format!("{head}{table}{script}]"), Path::new("test.toml")).unwrap()
}

/// An instant of the script, in milliseconds since its beginning; the table is laid at 300.
fn at(ms: u64) -> Instant {
    Instant::from_nanos(5_000_000_000) + Duration::from_millis(ms)
}

/// A world of that lesson in which the objects have been laid.
fn laid(script: &str) -> World {
    let mut world = World::new(&lesson(script), 1);
    world.step(at(0), NO_HANDS);
    world.step(at(300), NO_HANDS);
    assert_eq!(world.scene().count(), 6);
    world
}

fn truth(world: &World, name: &str) -> SceneObject {
    world.scene().find(|object| object.name.as_str() == name).unwrap()
}

fn state(object: &SceneObject, state: State) -> f32 {
    object.states[usize::from(state.raw())]
}

fn is(number: f32, other: f32) -> bool {
    (number - other).abs() < f32::EPSILON
}

/// Distance in metres between an object's centre and a place.
fn off(object: &SceneObject, place_m: [f64; 3]) -> f64 {
    object.position_m.iter().zip(place_m).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// A right hand at a place of the world, fingers straight down.
fn hand(position_m: [f64; 3], closure_rad: f64) -> [Option<Hand>; 2] {
    let [x, y, z] = position_m;
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let x_world_hand =
        Pose::<geometry::World, geometry::Hand>::from_parts([x, y, z], [0.0, half, 0.0, half]).unwrap();
    let x_world_base =
        Pose::<geometry::World, geometry::Base>::upright(0.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2);
    [None, Some(Hand { pose: x_world_base.inverse() * x_world_hand, closure_rad })]
}

/// Grasps the peg at (0.10, 0.40), moves its centre to a place in straight lines, and releases it; in steps of 5 ms
/// from `from_ms` on. Returns the instant after a second of rest, in ms.
fn take_and_let_go(world: &mut World, from_ms: u64, place_m: [f64; 3]) -> u64 {
    let mut ms = from_ms;
    let mut go = |from: [f64; 3], to: [f64; 3], closure_rad: f64, steps: u32| {
        for step in 1..=steps {
            let share = f64::from(step) / f64::from(steps);
            let now = [0, 1, 2].map(|axis| from[axis] + (to[axis] - from[axis]) * share);
            ms += 5;
            world.step(at(ms), hand(now, closure_rad));
        }
    };
    let peg = [0.10, 0.40, 0.025];
    let above_peg = [0.10, 0.40, 0.22];
    let above_place = [place_m[0], place_m[1], 0.22];
    go(above_peg, above_peg, 0.1, 5);
    go(above_peg, peg, 0.1, 50);
    go(peg, peg, 1.2, 20);
    go(peg, above_peg, 1.2, 50);
    go(above_peg, above_place, 1.2, 50);
    go(above_place, place_m, 1.2, 50);
    go(place_m, place_m, 0.1, 40);
    go(place_m, above_place, 0.1, 160);
    ms
}

#[test]
fn the_same_seed_gives_the_same_run_and_another_seed_another_one() {
    let run = |seed| -> Vec<String> {
        let mut world = World::new(&Lesson::builtin(), seed);
        (0..1000)
            .map(|step| {
                world.step(at(step * 20), NO_HANDS);
                let said: Vec<_> = world.utterances().collect();
                format!("{:?} {said:?}", world.observations().collect::<Vec<Observation>>())
            })
            .collect()
    };
    let first = run(1);
    assert!(first.iter().any(|frame| frame.len() > 1000));
    assert_eq!(first, run(1));
    assert_ne!(first, run(2));
}

#[test]
fn the_lesson_is_played_as_it_is_written() {
    let lesson = Lesson::builtin();
    let mut world = World::new(&lesson, lesson.seed);
    let mut said = Vec::new();
    let mut filled = Vec::new();
    let (mut empty_ms, mut uncovered, mut farthest) = (0, 0, 0.0_f64);
    let mut before: Vec<SceneObject> = Vec::new();
    for ms in (0..30_000).step_by(5) {
        world.step(at(ms), NO_HANDS);
        let scene: Vec<SceneObject> = world.scene().collect();
        let of = |kind: ObservationKind| scene.iter().filter(move |object| object.kind == kind.raw());
        let objects = of(ObservationKind::Object).count();
        empty_ms += if objects == 0 { 5 } else { 0 };
        let is_hidden = of(ObservationKind::Occluder).count() == 1;
        uncovered += u32::from(objects > 0 && !is_hidden && said.len() < 4);
        if before.len() == scene.len() {
            let moved = before.iter().zip(&scene).map(|(a, b)| off(a, b.position_m));
            farthest = farthest.max(moved.fold(0.0, f64::max));
        }
        for utterance in world.utterances() {
            assert_eq!(utterance.speaker, 1);
            filled.push(
                of(ObservationKind::Object).filter(|thing| is(state(thing, State::Filled), 1.0)).count(),
            );
            said.push(utterance.text.as_str().to_owned());
        }
        before = scene;
        if world.is_finished() {
            break;
        }
    }
    let demonstration = ["Leo, I can teach you to do task 1", "Task 1 is done"];
    assert_eq!(said, [&demonstration[..], &demonstration, &["Leo, do task 1"]].concat());
    assert_eq!(filled, [0, 4, 0, 4, 0]);
    assert!(world.is_finished());
    assert_eq!(uncovered, 0, "the wall came after the objects");
    assert!((3_500..5_000).contains(&empty_ms), "{empty_ms} ms");
    assert!(0.003 < farthest && farthest < 0.02, "something moved {farthest} m in 5 ms");
}

#[test]
fn a_moved_thing_is_held_by_the_teacher_until_it_is_there() {
    let mut world = laid(r#"{ at_s = 1.0, who = 1, move = "peg", into = "block", duration_s = 1.0 }"#);
    world.step(at(1_299), NO_HANDS);
    assert_eq!(truth(&world, "peg").held_by, NOBODY);
    world.step(at(1_800), NO_HANDS);
    let peg = truth(&world, "peg");
    assert_eq!((peg.held_by, is(state(&peg, State::Inserted), 0.0)), (1, true));
    assert!(peg.position_m[2] > 0.15);
    assert!(is(state(&truth(&world, "block"), State::Filled), 0.0));
    world.step(at(2_300), NO_HANDS);
    let peg = truth(&world, "peg");
    assert_eq!((peg.held_by, is(state(&peg, State::Inserted), 1.0)), (NOBODY, true));
    assert!(off(&peg, [0.0, 0.40, 0.06]) < 1e-9);
    assert!(is(state(&truth(&world, "block"), State::Filled), 1.0));
    assert!(state(&peg, State::Filled).is_nan() && state(&truth(&world, "block"), State::Inserted).is_nan());
}

#[test]
fn the_step_length_does_not_change_the_events() {
    let script = r#"{ at_s = 1.0, who = 1, move = "peg", into = "block", duration_s = 1.0 },
        { at_s = 2.0, who = 1, move = "block", to_m = [0.2, 0.7], duration_s = 0.5 },
        { at_s = 3.0, who = 1, move = "marker", onto = "slab", duration_s = 0.5 }"#;
    let end = |step_ms: u64| {
        let mut world = laid(script);
        let mut ms = 300;
        while ms < 4_000 {
            ms += step_ms;
            world.step(at(ms), NO_HANDS);
        }
        assert!(world.is_finished());
        world
    };
    for step_ms in [5, 185, 3_700] {
        let world = end(step_ms);
        assert!(off(&truth(&world, "peg"), [0.2, 0.7, 0.06]) < 1e-9, "the peg stays in its block");
        assert!(is(state(&truth(&world, "slab"), State::Marked), 1.0));
    }
}

#[test]
fn a_hand_grasps_a_peg_and_fills_a_hole() {
    let mut world = laid("");
    // Half of it in the hole, a centimetre off the axis.
    let ms = take_and_let_go(&mut world, 400, [0.01, 0.40, 0.06]);
    let peg = truth(&world, "peg");
    assert!(is(state(&peg, State::Inserted), 1.0));
    assert!(is(state(&truth(&world, "block"), State::Filled), 1.0));
    assert!(off(&peg, [0.0, 0.40, 0.06]) < 1e-9, "{:?}", peg.position_m);
    assert_eq!(peg.held_by, NOBODY);
    world.step(at(ms + 5), hand([0.0, 0.40, 0.06], 0.1));
    world.step(at(ms + 10), hand([0.0, 0.40, 0.06], 1.0));
    assert_eq!(truth(&world, "peg").held_by, NOBODY, "a peg in a hole is not taken out");
}

#[test]
fn a_hole_is_reserved_for_the_peg_that_a_teacher_holds() {
    let mut world = laid("");
    let act = |world: &mut World, ms, kind, how: &dyn Fn(&mut TeacherAct)| {
        let mut act = TeacherAct::new(kind, 1);
        how(&mut act);
        world.act(at(ms), &act, 64).unwrap();
        for step in 1..=100 {
            world.step(at(ms + 5 * step), NO_HANDS);
        }
    };
    let take = |act: &mut TeacherAct| act.text = Text::new("other");
    act(&mut world, 400, TeacherActKind::Take, &take);
    act(&mut world, 1000, TeacherActKind::Put, &|act| act.position_m = [0.0, 0.40, 0.2]);
    act(&mut world, 2000, TeacherActKind::Take, &take);
    let ms = take_and_let_go(&mut world, 3000, [0.0, 0.40, 0.06]);
    let inserted = |world: &World, name| state(&truth(world, name), State::Inserted);
    assert!(is(inserted(&world, "peg"), 0.0), "it stands on the block");
    act(&mut world, ms + 100, TeacherActKind::Cancel, &|_| {});
    assert!(is(inserted(&world, "other"), 1.0));
    assert!(is(inserted(&world, "peg"), 0.0));
}

#[test]
fn a_peg_let_go_deep_in_a_hole_stays_there() {
    let mut world = laid("");
    take_and_let_go(&mut world, 400, [0.0, 0.40, 0.045]);
    let peg = truth(&world, "peg");
    assert!(is(state(&peg, State::Inserted), 1.0));
    assert!(off(&peg, [0.0, 0.40, 0.045]) < 1e-9, "{:?}", peg.position_m);
}

#[test]
fn a_hand_opened_away_from_a_hole_drops_the_peg() {
    for (place_m, rests_m) in [
        ([0.15, 0.50, 0.20], [0.15, 0.50, 0.025]),   // over the table
        ([0.15, 0.50, 0.025], [0.15, 0.50, 0.025]),  // on the table
        ([0.027, 0.40, 0.06], [0.027, 0.40, 0.085]), // too far beside the hole: on the block
        ([0.0, 0.40, 0.09], [0.0, 0.40, 0.085]),     // over the hole and not in it
    ] {
        let mut world = laid("");
        take_and_let_go(&mut world, 400, place_m);
        let peg = truth(&world, "peg");
        assert!(off(&peg, rests_m) < 1e-6, "{:?}, not {rests_m:?}", peg.position_m);
        let [x, y, ..] = peg.orientation_xyzw;
        assert!(x.abs() < 1e-9 && y.abs() < 1e-9, "it stands upright");
        assert!(is(state(&peg, State::Inserted), 0.0));
        assert!(is(state(&truth(&world, "block"), State::Filled), 0.0));
        assert_eq!(peg.held_by, NOBODY);
    }
}

#[test]
fn a_dropped_peg_falls_and_does_not_jump() {
    let mut world = laid("");
    let peg = [0.10, 0.40, 0.025];
    world.step(at(400), hand(peg, 0.1));
    world.step(at(405), hand(peg, 1.0));
    for step in 0..50_u32 {
        let up = f64::from(step) * 0.004;
        world.step(at(410 + u64::from(step) * 5), hand([0.10, 0.40, 0.025 + up], 1.0));
        assert_eq!(truth(&world, "peg").held_by, 0);
    }
    let mut heights = vec![truth(&world, "peg").position_m[2]];
    for step in 0..60 {
        world.step(at(700 + step * 5), hand([0.10, 0.40, 0.221], 0.1));
        heights.push(truth(&world, "peg").position_m[2]);
    }
    assert!(heights[0] > 0.2);
    assert!((heights[60] - 0.025).abs() < 1e-9);
    assert!(heights.windows(2).all(|pair| pair[0] >= pair[1] && pair[0] - pair[1] < 0.012), "{heights:?}");
}

#[test]
fn a_hand_closed_beside_a_peg_grasps_nothing() {
    let mut world = laid("");
    world.step(at(400), hand([0.135, 0.40, 0.025], 0.1));
    world.step(at(405), hand([0.135, 0.40, 0.025], 1.0));
    world.step(at(410), hand([0.10, 0.40, 0.025], 1.0));
    world.step(at(415), hand([0.10, 0.40, 0.100], 1.0));
    assert!(off(&truth(&world, "peg"), [0.10, 0.40, 0.025]) < 1e-12);
    let mut world = laid("");
    world.step(at(400), hand([0.10, 0.40, 0.025], 1.0));
    world.step(at(405), hand([0.10, 0.40, 0.100], 1.0));
    assert!(off(&truth(&world, "peg"), [0.10, 0.40, 0.025]) < 1e-12);
}

#[test]
fn a_hand_without_readings_keeps_its_grasp() {
    let mut world = laid("");
    world.step(at(400), hand([0.10, 0.40, 0.025], 0.1));
    world.step(at(405), hand([0.10, 0.40, 0.025], 1.0));
    world.step(at(410), hand([0.10, 0.40, 0.100], 1.0));
    let [_, lost] = hand([0.10, 0.40, 0.200], f64::NAN);
    for hands in [NO_HANDS, [None, lost]] {
        world.step(at(415), hands);
        assert_eq!(truth(&world, "peg").held_by, 0);
    }
    assert!(off(&truth(&world, "peg"), [0.10, 0.40, 0.200]) < 1e-9, "it moves with the hand");
}

#[test]
fn a_teacher_cannot_take_from_leos_hand_or_fill_twice() {
    let mut world = laid(
        r#"{ at_s = 0.5, who = 1, move = "peg", to_m = [0.3, 0.9], duration_s = 1.0 },
           { at_s = 6.0, who = 1, move = "other", into = "block", duration_s = 1.0 }"#,
    );
    let ms = take_and_let_go(&mut world, 400, [0.0, 0.40, 0.06]);
    assert!(ms < 6_000);
    assert!(is(state(&truth(&world, "peg"), State::Inserted), 1.0));
    world.step(at(9_000), NO_HANDS);
    assert!(off(&truth(&world, "other"), [0.25, 0.40, 0.025]) < 1e-12);
}

#[test]
fn an_absent_teacher_is_not_observed_and_gaze_follows_the_script() {
    let mut world = laid(
        r#"{ at_s = 1.0, who = 1, leave = true }, { at_s = 2.0, who = 1, return = true },
           { at_s = 2.0, who = 1, look_at_m = [0.5, 1.5, 0.55], duration_s = 1.0 }"#,
    );
    let eye = |world: &World| {
        let person = world.observations().find(|seen| seen.kind() == Some(ObservationKind::Person))?;
        let position_m = person.position_m.map(f64::from);
        let orientation_xyzw = person.orientation_xyzw.map(f64::from);
        assert_eq!(person.partner, 1);
        Pose::<geometry::Base, geometry::Eye>::from_parts(position_m, orientation_xyzw)
    };
    let [x, y, z] = eye(&world).unwrap().position_m();
    assert!((x - 1.5).abs() < 1e-6 && y.abs() < 1e-6 && (z - 0.55).abs() < 1e-6, "in the robot's base");
    let heading = eye(&world).unwrap().heading_rad();
    assert!((heading.abs() - std::f64::consts::PI).abs() < 1e-6, "he looks at the robot");
    world.step(at(1_400), NO_HANDS);
    assert_eq!(eye(&world), None);
    world.step(at(2_800), NO_HANDS);
    assert!(eye(&world).is_some());
    world.step(at(3_300), NO_HANDS);
    assert!((eye(&world).unwrap().heading_rad() + std::f64::consts::FRAC_PI_2).abs() < 1e-6, "to his left");
}

#[test]
fn a_walking_teacher_keeps_looking_at_the_same_point() {
    let world_at = |ms| {
        let mut world = laid(r#"{ at_s = 1.0, who = 1, eyes_to_m = [1.5, 0.0, 0.55], duration_s = 1.0 }"#);
        world.step(at(ms), NO_HANDS);
        let person = world.observations().find(|seen| seen.kind() == Some(ObservationKind::Person)).unwrap();
        person.position_m
    };
    // The robot at the origin faces the world's y axis, so world x is to its right.
    let (before, midway, after) = (world_at(900), world_at(1_800), world_at(3_000));
    assert!((before[0] - 1.5).abs() < 1e-6 && before[1].abs() < 1e-6, "{before:?}");
    assert!(midway[1] < -0.1 && midway[1] > -1.4, "{midway:?}");
    assert!(after[0].abs() < 1e-6 && (after[1] + 1.5).abs() < 1e-6, "{after:?}");
}

#[test]
fn the_noise_has_the_deviation_that_the_lesson_states() {
    let lesson = Lesson::builtin();
    let mut world = World::new(&lesson, 3);
    let (mut sum, mut squares, mut count) = (0.0, 0.0, 0_u32);
    for step in 0..2_000 {
        // Nothing moves yet: the table is laid at 0.3 s and the first move is 1.5 s later.
        world.step(at(300) + Duration::from_micros(500) * step, NO_HANDS);
        let base = world.x_base_world;
        for (seen, truth) in world.observations().zip(world.scene()) {
            let [x, y, z] = truth.position_m;
            let true_m = (base * geometry::Position::new(x, y, z)).to_array();
            for (seen, truth) in seen.position_m.into_iter().zip(true_m) {
                let error = f64::from(seen) - truth;
                sum += error;
                squares += error * error;
                count += 1;
            }
            assert!(seen.is_sound() && is(seen.confidence, 0.9));
        }
    }
    assert!(count > 20_000);
    let mean = sum / f64::from(count);
    let sigma_m = (squares / f64::from(count) - mean * mean).sqrt();
    assert!((sigma_m - 0.003).abs() < 0.0001 && mean.abs() < 0.0001, "{sigma_m} {mean}");
}

#[test]
fn time_that_runs_backwards_moves_nothing() {
    let mut world = laid(r#"{ at_s = 1.0, who = 1, move = "peg", into = "block", duration_s = 1.0 }"#);
    world.step(at(1_800), NO_HANDS);
    let there = truth(&world, "peg").position_m;
    world.step(at(1_000), NO_HANDS);
    assert!(off(&truth(&world, "peg"), there) < 1e-12);
    assert_eq!(world.observations().next().map(|seen| seen.observed_at_ns), Some(at(1_800).as_nanos()));
}
