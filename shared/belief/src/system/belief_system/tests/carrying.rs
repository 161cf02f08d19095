//! Carrying: things that are not observed, and what moves them.

use message::ObservationKind;

use super::*;

/// The instant of a frame at 10 Hz.
fn instant_of(frame: u16) -> Instant {
    ms(u64::from(frame) * 100)
}

fn hand(at: Instant, agent: u16, position_m: [f32; 3]) -> Observation {
    Observation {
        kind: ObservationKind::Hand.raw(),
        partner: agent,
        position_m,
        ..Observation::object(0, at.as_nanos())
    }
}

/// A thing of another size, without a colour.
fn thing(at: Instant, position_m: [f32; 3], half_extents_m: [f32; 3]) -> Observation {
    Observation { half_extents_m, colour_rgb: [f32::NAN; 3], ..block(at, position_m, RED) }
}

/// Along y at 1 m/s from 0.3 s on, at most 1 m.
fn along(frame: u16) -> f32 {
    (f32::from(frame.saturating_sub(3)) / 10.0).min(1.0)
}

fn expected(robot: &Robot, id: u64) -> [f32; 3] {
    let index = robot.ids().iter().position(|other| *other == id).unwrap();
    robot.system.motion(index, robot.system.now()).unwrap().position_m
}

fn assert_at(found_m: [f32; 3], expected_m: [f32; 3]) {
    assert!(quantity::distance(&found_m, &expected_m) < 0.01, "{found_m:?} is not {expected_m:?}");
}

/// A block that is held at 2 cm from a hand, and hidden in it while the hand moves by a metre; then it is put down.
/// Returns the robot after the hand arrived, and after the block was seen again.
fn hidden_in_a_hand(percepts: &Percepts, with_hand: bool) -> (Robot, Robot) {
    let mut robot = Robot::new(percepts);
    for frame in 0..30 {
        let now = instant_of(frame);
        let place = [0.5, along(frame), 0.1];
        let held = Observation { held_by: 1, ..block(now, [place[0], place[1], 0.08], RED) };
        let other = hand(now, 2, [0.45, 0.0, 0.1]);
        let mut seen = vec![other];
        seen.extend(with_hand.then(|| hand(now, 1, place)));
        seen.extend((frame < 3).then_some(held));
        robot.see(now, &seen, true);
    }
    let arrived = robot.clone();
    robot.see(instant_of(30), &[block(instant_of(30), [0.5, 1.0, 0.03], RED)], true);
    (arrived, robot)
}

#[test]
fn what_is_hidden_in_a_hand_moves_with_it() {
    let (arrived, after) = hidden_in_a_hand(&Percepts::builtin(), true);
    assert_eq!((arrived.ids(), after.ids()), (vec![1], vec![1]));
    assert_at(expected(&arrived, 1), [0.5, 1.0, 0.08]);
    // What was perceived of it does not change.
    assert_at(arrived.system.position(0).unwrap(), [0.5, 0.0, 0.08]);
    assert_at(expected(&after, 1), [0.5, 1.0, 0.03]);
}

#[test]
fn without_its_hand_a_held_thing_is_missed() {
    let (arrived, after) = hidden_in_a_hand(&Percepts::builtin(), false);
    assert!(arrived.ids().is_empty());
    assert_eq!(after.ids(), [2]);
    let mut percepts = Percepts::builtin();
    percepts.belief.carrying = None;
    let (arrived, after) = hidden_in_a_hand(&percepts, true);
    assert!(arrived.ids().is_empty());
    assert_eq!(after.ids(), [2]);
}

#[test]
fn a_held_thing_whose_hand_left_is_missed_where_the_hand_was() {
    let (mut robot, _) = hidden_in_a_hand(&Percepts::builtin(), true);
    // The hand, but not its last place, is out of view.
    for frame in 30..50 {
        robot.see(instant_of(frame), &[hand(instant_of(frame), 2, [0.45, 0.0, 0.1])], true);
    }
    assert!(robot.ids().is_empty());
    let (mut robot, _) = hidden_in_a_hand(&Percepts::builtin(), true);
    for frame in 30..50 {
        robot.see(instant_of(frame), &[hand(instant_of(frame), 2, [0.45, 0.0, 0.1])], false);
    }
    assert_eq!(robot.ids(), [1]);
}

#[test]
fn a_container_hides_and_moves_what_is_in_it() {
    let mut robot = Robot::new(&Percepts::builtin());
    let half_m = [0.15, 0.10, 0.10];
    for frame in 0..40 {
        let now = instant_of(frame);
        let container = thing(now, [0.5, along(frame), 0.1], half_m);
        let inside = block(now, [0.58, 0.03, 0.05], RED);
        let seen = [container, inside];
        robot.see(now, &seen[..if frame < 3 { 2 } else { 1 }], true);
    }
    assert_eq!(robot.ids(), [1, 2]);
    assert_at(expected(&robot, 2), [0.58, 1.03, 0.05]);
    let now = instant_of(40);
    let open = [thing(now, [0.5, 1.0, 0.1], half_m), block(now, [0.58, 1.03, 0.05], RED)];
    robot.see(now, &open, true);
    assert_eq!(robot.ids(), [1, 2]);
}

#[test]
fn a_support_moves_what_is_on_it_and_hides_nothing() {
    let tray = |now, frame| thing(now, [0.5, along(frame), 0.01], [0.2, 0.2, 0.01]);
    let mut robot = Robot::new(&Percepts::builtin());
    for (in_view, left) in [(false, vec![1, 2]), (true, vec![1])] {
        for frame in 0..20 {
            let now = instant_of(frame) + Duration::from_secs(if in_view { 10 } else { 0 });
            let seen = [tray(now, frame), block(now, [0.6, 0.1, 0.05], RED)];
            robot.see(now, &seen[..if frame < 3 { 2 } else { 1 }], in_view);
        }
        assert_eq!(robot.ids(), left);
        if !in_view {
            assert_at(expected(&robot, 2), [0.6, 1.1, 0.05]);
        }
        robot = Robot::new(&Percepts::builtin());
    }
}

#[test]
fn a_thing_beside_another_or_as_large_is_not_carried_by_it() {
    for (place, half_m) in [
        // Beside the tray, above it, as large as it, and in what is turned on its side.
        ([0.9, 0.0, 0.05], [0.03; 3]),
        ([0.6, 0.0, 0.15], [0.03; 3]),
        ([0.5, 0.0, 0.03], [0.2, 0.2, 0.01]),
    ] {
        let mut robot = Robot::new(&Percepts::builtin());
        for frame in 0..20 {
            let now = instant_of(frame);
            let tray = thing(now, [0.5, along(frame), 0.01], [0.2, 0.2, 0.01]);
            let other = Observation { half_extents_m: half_m, ..block(now, place, BLUE) };
            let seen = [tray, other];
            robot.see(now, &seen[..if frame < 3 { 2 } else { 1 }], false);
        }
        assert_eq!(robot.ids(), [1, 2]);
        let on_top = half_m[0] > 0.1;
        let expected_m = if on_top { [0.5, 1.0, 0.03] } else { place };
        assert_at(expected(&robot, 2), expected_m);
    }
}

#[test]
fn carried_things_stay_where_they_are_when_the_frame_turns() {
    let (mut robot, _) = hidden_in_a_hand(&Percepts::builtin(), true);
    // A quarter to the left, and back.
    let quarter =
        Pose::<geometry::Base, geometry::Person>::upright(0.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2);
    robot.system.reanchor(&quarter);
    assert_at(expected(&robot, 1), [-1.0, 0.5, 0.08]);
    let now = instant_of(31);
    robot.see(now, &[hand(now, 1, [-1.0, 0.7, 0.1])], true);
    assert_at(expected(&robot, 1), [-1.0, 0.7, 0.08]);
    robot.see(instant_of(32), &[block(instant_of(32), [-1.0, 0.7, 0.08], RED)], true);
    assert_eq!(robot.ids(), [1]);
}

#[test]
fn more_missed_things_than_are_sought_in_a_step_are_all_carried() {
    let mut robot = Robot::new(&Percepts::builtin());
    let places: Vec<_> = (0..12_u8).map(|number| [0.35 + 0.025 * f32::from(number), 0.0, 0.04]).collect();
    for frame in 0..30 {
        let now = instant_of(frame);
        // It stands until all are sought.
        let container = thing(now, [0.5, along(frame.saturating_sub(5)), 0.05], [0.25, 0.1, 0.05]);
        let small = |place: &[f32; 3]| Observation { half_extents_m: [0.01; 3], ..block(now, *place, RED) };
        let mut seen = vec![container];
        seen.extend(places.iter().filter(|_| frame < 3).map(small));
        robot.see(now, &seen, true);
    }
    assert_eq!(robot.ids(), (1..=13).collect::<Vec<_>>());
    for (id, [x, y, z]) in (2..).zip(places) {
        assert_at(expected(&robot, id), [x, y + 1.0, z]);
    }
}

#[test]
fn two_thin_things_on_each_other_do_not_carry_each_other() {
    let card = |now, y, z| thing(now, [0.6, y, z], [0.04, 0.06, 0.001]);
    let mut robot = Robot::new(&Percepts::builtin());
    for frame in 0..3 {
        let (now, y) = (instant_of(frame), f32::from(frame) * 0.01);
        robot.see(now, &[card(now, y, 0.001), card(now, y, 0.003)], true);
    }
    // They slide behind an occluder, and stop at some time.
    for frame in 3..100 {
        let now = instant_of(frame);
        robot.see(now, &[block(now, [1.5, 0.0, 0.03], BLUE)], false);
    }
    for id in robot.ids().into_iter().filter(|id| *id < 3) {
        let [_, y, _] = expected(&robot, id);
        assert!(y.abs() < 0.2, "belief {id} drifts to {y} m");
    }
}

#[test]
fn a_sighting_of_a_slower_source_counts_more_than_the_carrier() {
    let mut robot = Robot::new(&Percepts::builtin());
    let tray = |now: Instant| thing(now, [0.5, 0.0, 0.01], [0.2, 0.2, 0.01]);
    for frame in 0..40 {
        let now = instant_of(frame);
        let along = f32::from(frame) * 0.01;
        // The second source is 60 ms late; the first does not see the block any more.
        let late = Instant::from_nanos(now.as_nanos() - 60_000_000);
        let block = block(now, [0.4, along, 0.05], RED);
        let slow = Observation { source: 1, observed_at_ns: late.as_nanos(), ..block };
        let perceived = [Some(tray(now)), (frame < 3).then_some(block), Some(slow)];
        let perceived: Vec<_> = perceived
            .into_iter()
            .flatten()
            .map(|observation| Perceived {
                observation,
                snapshot: robot.perception.perceive(&observation, &Frame { agent: 0 }),
            })
            .collect();
        let sources = [0, 1].into_iter().map(SourceSet::of).collect();
        robot.system.step(now, &perceived, 0..perceived.len(), sources, |_| true);
    }
    assert_eq!(robot.ids().len(), 2, "the tray and one block");
    let [_, y, _] = expected(&robot, robot.ids()[1]);
    assert!((y - 0.39).abs() < 0.02, "{y}");
}

#[test]
fn a_hand_of_no_confidence_or_of_the_future_moves_nothing() {
    for change in [
        |hand: Observation| Observation { confidence: 0.0, ..hand },
        |hand: Observation| Observation { observed_at_ns: hand.observed_at_ns + 2_000_000_000, ..hand },
    ] {
        let mut robot = Robot::new(&Percepts::builtin());
        for frame in 0..20 {
            let now = instant_of(frame);
            let place = [0.5, along(frame), 0.1];
            let held = Observation { held_by: 1, ..block(now, [0.5, 0.0, 0.08], RED) };
            let hand = hand(now, 1, place);
            let seen = [if frame < 3 { hand } else { change(hand) }, held];
            robot.see(now, &seen[..if frame < 3 { 2 } else { 1 }], false);
        }
        assert_at(expected(&robot, 1), [0.5, 0.0, 0.08]);
    }
}
