//! Beliefs whose thing is missing are culled, and no others.

use crate::percepts::Cull;

use super::*;

#[test]
fn an_unseen_object_is_culled_only_in_free_view() {
    for (in_view, left) in [(true, 0), (false, 1)] {
        let mut robot = Robot::new(&Percepts::builtin());
        robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], true);
        for step in 1..=120 {
            robot.see(ms(5 * step), &[], in_view);
        }
        assert_eq!(robot.system.len(), 1, "600 ms are not longer than 600 ms");
        robot.see(ms(605), &[], in_view);
        assert_eq!(robot.system.len(), left);
        assert_eq!(robot.system.counts().culled, 1 - u64::try_from(left).unwrap());
    }
}

/// A robot that culls a belief whose position was empty for 600 ms.
fn patient() -> Robot {
    let mut percepts = Percepts::builtin();
    percepts.belief.cull = vec![Cull::PlaceEmptyFor(Duration::from_millis(600))];
    let mut robot = Robot::new(&percepts);
    robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], true);
    robot
}

/// Steps of 5 ms without observations, in view or not; returns when the belief was culled.
fn culled_at(robot: &mut Robot, from_ms: u64, in_view: impl Fn(u64) -> bool) -> Option<u64> {
    (from_ms..from_ms + 2000).step_by(5).find(|at| {
        robot.see(ms(*at), &[], in_view(*at));
        robot.system.is_empty()
    })
}

#[test]
fn a_belief_long_out_of_view_is_culled_as_configured() {
    let mut robot = Robot::new(&Percepts::builtin());
    robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], true);
    assert_eq!(culled_at(&mut robot, 5, |_| false), None);
    assert_eq!(culled_at(&mut robot, 3000, |_| true), Some(3000));

    let mut robot = patient();
    assert_eq!(culled_at(&mut robot, 5, |_| false), None);
    // The detector misses it in one image, after which it is detected as before.
    robot.see(ms(3000), &[], true);
    robot.see(ms(3005), &[block(ms(3005), [0.5, 0.0, 0.0], RED)], true);
    assert_eq!(robot.ids(), [1]);
    assert_eq!(culled_at(&mut robot, 3010, |_| true), Some(3610), "empty from 3010 on");
}

#[test]
fn a_hidden_or_unobserved_place_is_found_empty_again() {
    assert_eq!(culled_at(&mut patient(), 5, |at| at != 500), Some(505 + 600), "somebody stood before it");
    assert_eq!(culled_at(&mut patient(), 5, |at| at < 500), None);
    let mut robot = patient();
    for at in (5..500).step_by(5) {
        robot.see(ms(at), &[], true);
    }
    robot.system.look_anew(ms(5000));
    assert_eq!(culled_at(&mut robot, 5000, |_| true), Some(5600), "he was away");
}

#[test]
fn a_source_with_late_frames_does_not_lose_its_beliefs() {
    for cull in [Percepts::builtin().belief.cull, vec![Cull::PlaceEmptyFor(Duration::from_millis(600))]] {
        let mut configured = Percepts::builtin();
        configured.belief.cull = cull;
        let mut robot = Robot::new(&configured);
        // An image is taken every 100 ms, and processed 900 ms later.
        for at in (1000..4000).step_by(5) {
            if at % 100 == 0 {
                robot.see(ms(at), &[block(ms(at - 900), [0.5, 0.0, 0.0], RED)], true);
            } else {
                robot.system.step(ms(at), &[], 0..0, SourceSet::EMPTY, |_| true);
            }
            assert_eq!(robot.ids(), [1], "{at}");
        }
        // Only images find the position empty.
        for at in (4000..=4600).step_by(100) {
            assert_eq!(robot.ids(), [1], "{at}");
            robot.system.step(ms(at), &[], 0..0, SourceSet::of(0), |_| true);
        }
        assert!(robot.system.is_empty());
    }
}

#[test]
fn a_dead_source_causes_no_misses_after_an_empty_place() {
    let mut robot = patient();
    robot.see(ms(5), &[], true);
    for at in (10..5000).step_by(5) {
        robot.system.step(ms(at), &[], 0..0, SourceSet::of(1), |_| true);
    }
    assert_eq!(robot.ids(), [1]);
    assert_eq!(culled_at(&mut robot, 5000, |_| true), Some(5000), "its next picture finds it empty still");
}

#[test]
fn only_sources_that_saw_an_object_can_miss_it() {
    let there = [0.5, 0.0, 0.0];
    for (looks, left) in [(3, 0), (7, 0), (5, 1)] {
        let mut robot = Robot::new(&Percepts::builtin());
        for step in 0..10 {
            let source = if step < 5 { 3 } else { 7 };
            let seen = Observation { source, ..block(ms(5 * step), there, RED) };
            robot.see(ms(5 * step), &[seen], true);
        }
        assert_eq!(robot.ids(), [1]);
        for at in (50..=650).step_by(5) {
            robot.system.step(ms(at), &[], 0..0, SourceSet::of(looks), |_| true);
        }
        assert_eq!(robot.system.len(), left, "source {looks}");
    }
}

#[test]
fn without_culling_functions_no_belief_is_culled() {
    let mut percepts = Percepts::builtin();
    percepts.belief.cull.clear();
    let mut robot = Robot::new(&percepts);
    robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], true);
    robot.see(ms(100_000), &[], true);
    assert_eq!(robot.system.len(), 1);
}

#[test]
fn confidence_decays_and_may_cull() {
    let mut percepts = Percepts::builtin();
    let position = percepts.index("position").unwrap();
    percepts.belief.cull = vec![Cull::ConfidenceBelow { percept: position, floor: 0.5 }];
    let mut robot = Robot::new(&percepts);
    robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], true);
    let confidence = |robot: &Robot, instant| {
        robot.system.write(0, instant).unwrap().percept(position).unwrap().confidence
    };
    assert!((confidence(&robot, ms(0)) - 0.9).abs() < 1e-6);
    let expected = 0.9 * (-0.2_f32 * 2.0).exp();
    assert!((confidence(&robot, ms(2000)) - expected).abs() < 1e-6);
    robot.see(ms(2900), &[], true);
    assert_eq!(robot.system.len(), 1);
    robot.see(ms(2950), &[], true);
    assert_eq!(robot.system.len(), 0);
}
