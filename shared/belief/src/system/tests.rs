use std::sync::Arc;

use config::number::NotNegative;
use config::percepts::{Component, Cull, History, Measure, NoTermApplies, Range, Region};
use geometry::Pose;
use message::{NOBODY, Observation, SourceSet, State};
use perception::{Frame, Perception};

use super::*;

const RED: [f32; 3] = [0.80, 0.05, 0.05];
const BLUE: [f32; 3] = [0.05, 0.15, 0.80];

fn ms(millis: u64) -> Instant {
    Instant::from_nanos(1_000_000_000 + millis * 1_000_000)
}

fn block(at: Instant, position_m: [f32; 3], colour_rgb: [f32; 3]) -> Observation {
    let mut block = Observation {
        confidence: 0.9,
        position_m,
        colour_rgb,
        half_extents_m: [0.03; 3],
        ..Observation::object(0, at.as_nanos())
    };
    block.set_state(State::Filled, 0.0);
    block
}

/// A system with its perception.
struct Robot {
    perception: Perception,
    system: BeliefSystem,
}

impl Robot {
    fn new(percepts: &Percepts) -> Self {
        Self {
            perception: Perception::new(percepts).unwrap(),
            system: BeliefSystem::new(percepts, 16).unwrap(),
        }
    }

    fn see(&mut self, now: Instant, seen: &[Observation], in_view: bool) {
        let perceived: Vec<_> = seen
            .iter()
            .map(|observation| {
                let snapshot = self.perception.perceive(observation, &Frame { agent: 0 });
                Perceived { observation: *observation, snapshot }
            })
            .collect();
        self.system.step(now, &perceived, 0..perceived.len(), SourceSet::of(0), |_| in_view);
        let counts = self.system.counts();
        let len = u64::try_from(self.system.len()).unwrap();
        assert_eq!(counts.created - counts.merged - counts.culled - counts.evicted, len);
    }

    fn ids(&self) -> Vec<u64> {
        self.system.beliefs().map(|belief| belief.id).collect()
    }
}

#[test]
fn a_thing_that_moves_keeps_its_identity() {
    let mut robot = Robot::new(&Percepts::builtin());
    let mut x = 0.0;
    for step in 0..200 {
        x += 0.004;
        robot.see(ms(5 * step), &[block(ms(5 * step), [0.5, x, 0.0], RED)], true);
    }
    assert_eq!(robot.ids(), [1]);
    let belief = robot.system.beliefs().next().unwrap();
    assert_eq!(belief.observations, 200);
    assert_eq!(belief.born_at_ns, ms(0).as_nanos());
    let y = robot.system.position(0).unwrap()[1];
    assert!((y - 0.796).abs() < 1e-4, "the low-pass lags by one step of 4 mm: {y}");
}

#[test]
fn two_alike_that_are_seen_at_once_stay_two_and_literally_merge() {
    let mut percepts = Percepts::builtin();
    for cannot_link in [true, false] {
        percepts.belief.cannot_link_same_source_instant = cannot_link;
        let mut robot = Robot::new(&percepts);
        for step in 0..3 {
            let now = ms(5 * step);
            let tower: Vec<_> =
                [0.03, 0.09, 0.15, 0.21, 0.27, 0.33].map(|z| block(now, [0.5, 0.0, z], RED)).into();
            robot.see(now, &tower, true);
        }
        assert_eq!(robot.system.len() == 6, cannot_link, "{}", robot.system.len());
    }
}

#[test]
fn alike_at_one_place_for_two_sensors_are_one() {
    let mut robot = Robot::new(&Percepts::builtin());
    let now = ms(0);
    let other_sensor = Observation { source: 1, ..block(now, [0.51, 0.0, 0.0], RED) };
    robot.see(now, &[block(now, [0.5, 0.0, 0.0], RED), other_sensor], true);
    assert_eq!(robot.ids(), [1]);
    assert_eq!(robot.system.beliefs().next().unwrap().observations, 2);
}

#[test]
fn another_colour_is_another_thing() {
    let mut robot = Robot::new(&Percepts::builtin());
    robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], false);
    robot.see(ms(5), &[block(ms(5), [0.5, 0.0, 0.0], BLUE)], false);
    assert_eq!(robot.ids(), [1, 2]);
}

#[test]
fn an_unseen_thing_is_culled_where_the_view_is_free_and_kept_where_it_is_not() {
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

/// A robot that gives up what it has found missing for 600 ms.
fn patient() -> Robot {
    let mut percepts = Percepts::builtin();
    percepts.belief.cull = vec![Cull::PlaceEmptyFor(Duration::from_millis(600))];
    let mut robot = Robot::new(&percepts);
    robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], true);
    robot
}

/// Steps of 5 ms with nothing to be seen, in view or not; when the belief was given up.
fn culled_at(robot: &mut Robot, from_ms: u64, in_view: impl Fn(u64) -> bool) -> Option<u64> {
    (from_ms..from_ms + 2000).step_by(5).find(|at| {
        robot.see(ms(*at), &[], in_view(*at));
        robot.system.is_empty()
    })
}

#[test]
fn what_was_long_out_of_view_is_given_up_at_the_first_glance_or_not_as_configured() {
    let mut robot = Robot::new(&Percepts::builtin());
    robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], true);
    assert_eq!(culled_at(&mut robot, 5, |_| false), None);
    assert_eq!(culled_at(&mut robot, 3000, |_| true), Some(3000));

    let mut robot = patient();
    assert_eq!(culled_at(&mut robot, 5, |_| false), None);
    // A detector that misses it in one picture, after which it is there as before.
    robot.see(ms(3000), &[], true);
    robot.see(ms(3005), &[block(ms(3005), [0.5, 0.0, 0.0], RED)], true);
    assert_eq!(robot.ids(), [1]);
    assert_eq!(culled_at(&mut robot, 3010, |_| true), Some(3610), "empty from 3010 on");
}

#[test]
fn a_place_is_found_empty_anew_after_it_was_hidden_or_nobody_looked() {
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
fn a_source_that_is_slow_to_understand_does_not_lose_what_it_sees() {
    for cull in [Percepts::builtin().belief.cull, vec![Cull::PlaceEmptyFor(Duration::from_millis(600))]] {
        let mut configured = Percepts::builtin();
        configured.belief.cull = cull;
        let mut robot = Robot::new(&configured);
        // A picture is taken every 100 ms, and understood 900 ms later.
        for at in (1000..4000).step_by(5) {
            if at % 100 == 0 {
                robot.see(ms(at), &[block(ms(at - 900), [0.5, 0.0, 0.0], RED)], true);
            } else {
                robot.system.step(ms(at), &[], 0..0, SourceSet::EMPTY, |_| true);
            }
            assert_eq!(robot.ids(), [1], "{at}");
        }
        // It is found empty by pictures alone.
        for at in (4000..=4600).step_by(100) {
            assert_eq!(robot.ids(), [1], "{at}");
            robot.system.step(ms(at), &[], 0..0, SourceSet::of(0), |_| true);
        }
        assert!(robot.system.is_empty());
    }
}

#[test]
fn a_source_that_died_misses_nothing_though_it_found_a_place_empty_at_last() {
    let mut robot = patient();
    robot.see(ms(5), &[], true);
    for at in (10..5000).step_by(5) {
        robot.system.step(ms(at), &[], 0..0, SourceSet::of(1), |_| true);
    }
    assert_eq!(robot.ids(), [1]);
    assert_eq!(culled_at(&mut robot, 5000, |_| true), Some(5000), "its next picture finds it empty still");
}

#[test]
fn all_who_ever_saw_a_thing_can_miss_it_and_nobody_else() {
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
fn without_culling_functions_nothing_is_culled() {
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

#[test]
fn unsound_and_repeated_observations_are_refused_and_counted() {
    let mut robot = Robot::new(&Percepts::builtin());
    let seen = block(ms(5), [0.5, 0.0, 0.0], RED);
    robot.see(ms(5), &[seen, Observation { confidence: f32::NAN, ..seen }], true);
    robot.see(ms(10), &[seen], true);
    robot.see(ms(15), &[block(ms(4), [0.5, 0.0, 0.0], RED)], true);
    robot.see(ms(20), &[block(ms(1100), [0.5, 0.0, 0.0], RED)], true);
    let counts = robot.system.counts();
    assert_eq!((counts.unsound, counts.ahead, counts.stale, counts.created), (1, 1, 2, 1));
    assert_eq!(robot.system.beliefs().next().unwrap().observations, 1);
}

#[test]
fn an_observation_a_little_ahead_of_the_step_is_remembered_at_the_step() {
    let mut robot = Robot::new(&Percepts::builtin());
    robot.see(ms(0), &[block(ms(2), [0.5, 0.0, 0.0], RED)], true);
    assert!(!robot.system.beliefs().next().unwrap().percepts().is_empty());
}

#[test]
fn time_that_goes_backwards_is_counted_and_does_no_harm() {
    let mut robot = Robot::new(&Percepts::builtin());
    robot.see(ms(50), &[block(ms(50), [0.5, 0.0, 0.0], RED)], true);
    robot.see(ms(20), &[block(ms(51), [0.5, 0.0, 0.0], RED)], true);
    assert_eq!(robot.system.counts().backwards, 1);
    assert_eq!(robot.system.now(), ms(50));
    assert_eq!(robot.ids(), [1]);
}

#[test]
fn a_full_system_keeps_what_it_knows_and_counts_what_it_drops() {
    let mut robot = Robot::new(&Percepts::builtin());
    let row = |now, count: u16| -> Vec<_> {
        (0..count).map(|index| block(now, [f32::from(index), 0.0, 0.0], RED)).collect()
    };
    robot.see(ms(0), &row(ms(0), 16), false);
    assert_eq!((robot.system.len(), robot.system.counts().overflowed), (16, 0));
    // Sixteen of these are known; of the others none finds room, and one not even a slot.
    robot.see(ms(5), &row(ms(5), 17), false);
    assert_eq!((robot.system.len(), robot.system.counts().overflowed), (16, 1));
    let mut far = row(ms(10), 3);
    far.iter_mut().for_each(|block| block.position_m[1] = 9.0);
    robot.see(ms(10), &far, false);
    assert_eq!((robot.system.len(), robot.system.counts().overflowed), (16, 4));
    assert_eq!(robot.ids(), (1..=16).collect::<Vec<_>>());
    assert_eq!(robot.system.counts().evicted, 3);
}

#[test]
fn things_that_are_each_stamped_by_themselves_are_all_believed() {
    let mut robot = Robot::new(&Percepts::builtin());
    robot.system = BeliefSystem::new(&Percepts::builtin(), 200).unwrap();
    for step in 1..=3_u64 {
        let at = |thing: u16| Instant::from_nanos(ms(5 * step).as_nanos() - 1000 + u64::from(thing));
        let row = (0..200).map(|thing| block(at(thing), [0.5, 0.2 * f32::from(thing), 0.0], RED));
        robot.see(ms(5 * step), &row.collect::<Vec<_>>(), true);
        assert_eq!(robot.system.len(), 200);
        assert_eq!(robot.system.counts().overflowed, 0);
    }
    assert!(robot.system.beliefs().all(|belief| belief.observations == 3));
}

#[test]
fn identities_have_no_gaps() {
    let mut robot = Robot::new(&Percepts::builtin());
    let (here, there) = ([0.5, 0.0, 0.0], [0.5, 0.4, 0.0]);
    robot.see(ms(0), &[block(ms(0), here, RED)], false);
    robot.see(ms(5), &[block(ms(5), here, RED)], false);
    robot.see(ms(10), &[block(ms(10), here, RED), block(ms(10), there, RED)], false);
    assert_eq!(robot.ids(), [1, 2]);
}

#[test]
fn the_one_who_holds_it_is_remembered() {
    let mut robot = Robot::new(&Percepts::builtin());
    let here = [0.5, 0.0, 0.0];
    robot.see(ms(0), &[Observation { held_by: 1, ..block(ms(0), here, RED) }], true);
    assert_eq!(robot.system.beliefs().next().unwrap().held_by, 1);
    robot.see(ms(5), &[block(ms(5), here, RED)], true);
    assert_eq!(robot.system.beliefs().next().unwrap().held_by, NOBODY);
}

#[test]
fn nothing_perceived_is_nothing_believed() {
    let mut robot = Robot::new(&Percepts::builtin());
    let doubtful = Observation { confidence: 0.4, ..block(ms(0), [0.5, 0.0, 0.0], RED) };
    robot.see(ms(0), &[doubtful], true);
    assert!(robot.system.is_empty());
}

#[test]
fn strangers_that_no_term_compares_merge_only_literally() {
    let mut percepts = Percepts::builtin();
    percepts.belief.distance.clear();
    for (no_term_applies, expected) in [(NoTermApplies::Infinite, 2), (NoTermApplies::Zero, 1)] {
        percepts.belief.no_term_applies = no_term_applies;
        let mut robot = Robot::new(&percepts);
        robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], false);
        robot.see(ms(5), &[block(ms(5), [2.5, 0.0, 0.0], BLUE)], false);
        assert_eq!(robot.system.len(), expected);
    }
}

#[test]
fn a_moved_frame_moves_what_is_remembered_and_turns_left_into_right() {
    let percepts = Percepts::builtin();
    let (left, orientation) = (percepts.index("left").unwrap(), percepts.index("orientation").unwrap());
    let mut robot = Robot::new(&percepts);
    robot.see(ms(0), &[block(ms(0), [0.5, 0.3, 0.1], RED)], false);
    // The new frame stands 1 m ahead and looks back.
    let x_old_new = Pose::<geometry::Base, geometry::Person>::upright(1.0, 0.0, 0.0, std::f64::consts::PI);
    robot.system.reanchor(&x_old_new.inverse());
    let [x, y, z] = robot.system.position(0).unwrap();
    assert!((x - 0.5).abs() < 1e-6 && (y + 0.3).abs() < 1e-6 && (z - 0.1).abs() < 1e-6, "{x} {y} {z}");
    let belief = robot.system.beliefs().next().unwrap();
    assert_eq!(belief.percept(left).unwrap().feature(), Some(Feature::Number(0.0)));
    let Some(Feature::Orientation([qx, qy, qz, qw])) = belief.percept(orientation).unwrap().feature() else {
        panic!("an orientation is remembered")
    };
    assert!(qx.abs() + qy.abs() + qw.abs() < 1e-6 && (qz.abs() - 1.0).abs() < 1e-6);
    // In the new frame it is seen where it is remembered.
    robot.see(ms(5), &[block(ms(5), [0.5, -0.3, 0.1], RED)], false);
    assert_eq!(robot.ids(), [1]);
}

/// A percept of position, and percepts that come from it: ranges, a region, and what is below those.
fn placed() -> Percepts {
    let mut percepts = Percepts::builtin();
    let history = percepts.get(6).unwrap().history.clone();
    percepts.percepts.truncate(6);
    let soft = NotNegative::try_from(0.5).ok();
    let range = |of, from, to, softness| Kernel::Range(Range { of, from, to, softness });
    let (minimum_m, maximum_m) = ([f64::NEG_INFINITY, 0.0, f64::NEG_INFINITY], [f64::INFINITY; 3]);
    for (name, parent, kernel) in [
        ("near", "position", range(Component::DistanceM, None, Some(1.0), soft)),
        ("very near", "near", range(Component::Number, Some(0.9), None, None)),
        ("left", "position", Kernel::Region(Region { minimum_m, maximum_m })),
        ("near left", "near", Kernel::Region(Region { minimum_m, maximum_m })),
        ("far ahead", "left", range(Component::Number, Some(0.5), None, None)),
        ("long", "extents", range(Component::LongestM, Some(0.1), None, None)),
    ] {
        let parent = percepts.index(parent);
        let percept = percepts.get(0).unwrap().clone();
        let (name, history) = (name.to_owned(), history.clone());
        percepts.percepts.push(Percept { name, parent, kernel, history, ..percept });
    }
    percepts
}

#[test]
fn after_a_moved_frame_ranges_and_regions_say_what_they_would_of_what_is_seen_there() {
    let percepts = placed();
    let said = |robot: &Robot| -> Vec<Option<(f32, f32, Feature)>> {
        let belief = robot.system.beliefs().next().unwrap();
        let said = (6..12).map(|number| {
            let remembered = belief.percept(number)?;
            Some((remembered.matching, remembered.confidence, remembered.feature()?))
        });
        said.collect()
    };
    let mut different = 0;
    for (x, y) in [(0.5, 0.25), (1.3, -0.3), (2.5, 0.5), (-0.75, -0.25), (-1.0, 0.7), (1.25, 0.0)] {
        for (ahead, heading) in [(1.0, std::f64::consts::PI), (0.5, 1.0), (-2.0, -0.5), (0.25, 0.0)] {
            let mut robot = Robot::new(&percepts);
            let seen = block(ms(0), [x, y, 0.0], RED);
            robot.see(ms(0), &[seen], false);
            let before = said(&robot);
            let x_new_old =
                Pose::<geometry::Base, geometry::Person>::upright(ahead, 0.0, 0.0, heading).inverse();
            robot.system.reanchor(&x_new_old);
            let mut anew = Robot::new(&percepts);
            let position_m = robot.system.position(0).unwrap();
            anew.see(ms(0), &[Observation { position_m, ..seen }], false);
            assert_eq!(said(&robot), said(&anew), "({x}, {y}) from {ahead} m ahead, turned by {heading}");
            different += usize::from(said(&robot) != before);
        }
    }
    assert!(different > 12, "{different} of 24 frames make a difference");
}

#[test]
fn what_a_range_cannot_tell_in_a_moved_frame_is_not_remembered() {
    let percepts = placed();
    let near = percepts.index("near").unwrap();
    let mut robot = Robot::new(&percepts);
    robot.see(ms(0), &[block(ms(0), [0.75, 0.0, 0.0], RED)], false);
    let newest = |robot: &Robot| {
        let belief = robot.system.beliefs().next().unwrap();
        belief.percept(near).and_then(Remembered::feature)
    };
    assert_eq!(newest(&robot), Some(Feature::Number(1.0)));
    // Half a metre back, it is half way out of range: neither answer passes.
    let x_old_new = Pose::<geometry::Base, geometry::Person>::upright(-0.5, 0.0, 0.0, 0.0);
    robot.system.reanchor(&x_old_new.inverse());
    assert_eq!(newest(&robot), None);
    // One more, and it is outside.
    robot.system.reanchor(&x_old_new.inverse());
    assert_eq!(newest(&robot), Some(Feature::Number(0.0)));
}

#[test]
fn what_leaves_a_range_is_remembered_as_outside() {
    let percepts = placed();
    let near = percepts.index("near").unwrap();
    let mut robot = Robot::new(&percepts);
    let mut x = 0.9;
    for step in 0..20 {
        robot.see(ms(5 * step), &[block(ms(5 * step), [x, 0.0, 0.0], RED)], false);
        x += 0.04;
    }
    assert_eq!(robot.ids(), [1]);
    let belief = robot.system.beliefs().next().unwrap();
    assert_eq!(belief.percept(near).unwrap().feature(), Some(Feature::Number(0.0)));
    let then = robot.system.write(0, ms(0)).unwrap();
    assert_eq!(then.percept(near).unwrap().feature(), Some(Feature::Number(1.0)));
}

#[test]
fn a_snapshot_goes_its_own_way() {
    let mut robot = Robot::new(&Percepts::builtin());
    robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], true);
    let snapshot = robot.system.clone();
    robot.see(ms(5), &[block(ms(5), [0.6, 0.0, 0.0], RED)], true);
    assert_eq!(snapshot.position(0), Some([0.5, 0.0, 0.0]));
    assert_eq!(snapshot.beliefs().next().unwrap().observations, 1);
    assert_ne!(robot.system.position(0), snapshot.position(0));
}

#[test]
fn a_capacity_out_of_range_is_refused() {
    let percepts = Percepts::builtin();
    assert!(BeliefSystem::new(&percepts, 0).is_err() && BeliefSystem::new(&percepts, 1_000_001).is_err());
}

/// Noise of a few millimetres, the same in every run.
fn wobble(seed: &mut u32) -> f32 {
    *seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    // The sum of a few uniform numbers is nearly normal; this one has a deviation of 3 mm.
    let parts = seed.to_le_bytes().map(|byte| f32::from(byte) / 255.0 - 0.5);
    parts.iter().sum::<f32>() * 0.0052
}

#[test]
fn alike_things_close_together_keep_their_identities_while_one_is_carried_over_them() {
    let mut robot = Robot::new(&Percepts::builtin());
    let mut seed = 1;
    let home = |index: u16| [0.5, f32::from(index) * 0.09, 0.025];
    for step in 0..600_u16 {
        let now = ms(5 * u64::from(step));
        let seen: Vec<_> = (0..7)
            .map(|index| {
                let mut place = home(index);
                if index == 0 {
                    // Up, over all others in a second, down beyond them, then at rest.
                    let way = (f32::from(step) / 200.0).min(1.0);
                    place[1] += way * 0.7;
                    place[2] += 0.6 * way * (1.0 - way);
                }
                block(now, place.map(|part| part + wobble(&mut seed)), RED)
            })
            .collect();
        robot.see(now, &seen, true);
        assert_eq!(robot.ids(), [1, 2, 3, 4, 5, 6, 7]);
    }
    for index in 1..7 {
        let [x, y, _] = robot.system.position(usize::from(index)).unwrap();
        let [home_x, home_y, _] = home(index);
        assert!((x - home_x).abs() < 0.01 && (y - home_y).abs() < 0.01, "{index} is at {x} {y}");
    }
    assert!((robot.system.position(0).unwrap()[1] - 0.7).abs() < 0.01);
}

/// A history of the program's own: the highest number there ever was.
struct Highest;

impl own::History for Highest {
    fn samples(&self) -> usize {
        1
    }

    fn take(&self, kept: &mut crate::Samples<'_>, sample: &Sample) {
        let number = |sample: &Sample| match sample.feature {
            Feature::Number(number) => number,
            Feature::None | Feature::Symbol(_) | Feature::Vector(_) | Feature::Orientation(_) => {
                f32::NEG_INFINITY
            }
        };
        if kept.as_slice().first().is_none_or(|highest| number(highest) < number(sample)) {
            kept.clear();
            assert!(kept.push(*sample) && !kept.push(*sample), "there is room for one");
        }
    }

    fn at(&self, kept: &[Sample], instant: Instant) -> Option<Sample> {
        kept.first().copied().filter(|sample| sample.at <= instant)
    }
}

/// A history that says what cannot be.
struct Nonsense;

impl own::History for Nonsense {
    fn samples(&self) -> usize {
        2
    }

    fn take(&self, kept: &mut crate::Samples<'_>, sample: &Sample) {
        kept.push(Sample { confidence: 7.0, ..*sample });
    }

    fn at(&self, kept: &[Sample], _instant: Instant) -> Option<Sample> {
        kept.first().copied()
    }
}

/// A culling function of the program's own: what nobody holds, was seen once, and is in view.
struct Fleeting;

impl own::Cull for Fleeting {
    fn agrees(&self, belief: &Doubtful<'_>) -> bool {
        let is_filled = belief.percept(Percepts::builtin().index("filled").unwrap());
        assert!(is_filled.is_some_and(|filled| filled.confidence <= 0.9));
        assert!(belief.place_m().is_some() && belief.born_at() <= belief.perceived_at());
        belief.held_by() == NOBODY
            && belief.observations() == 1
            && belief.now() > belief.perceived_at()
            && belief.is_in_view() == Some(true)
    }
}

fn functions() -> Functions {
    let mut functions = Functions::default();
    functions.culls.push(("fleeting".to_owned(), Arc::new(Fleeting)));
    functions.histories.push(("highest".to_owned(), Arc::new(Highest)));
    functions.histories.push(("nonsense".to_owned(), Arc::new(Nonsense)));
    functions
}

#[test]
fn a_culling_function_of_the_programs_own_has_its_say_among_the_others() {
    let mut percepts = Percepts::builtin();
    percepts.belief.cull = vec![Cull::Own("fleeting".to_owned())];
    let mut robot = Robot::new(&Percepts::builtin());
    robot.system = BeliefSystem::with_own(&percepts, &functions(), 16).unwrap();
    let (often, once) = ([0.5, 0.0, 0.0], [0.5, 0.5, 0.0]);
    robot.see(ms(0), &[block(ms(0), often, RED), block(ms(0), once, RED)], true);
    assert_eq!(robot.ids(), [1, 2]);
    robot.see(ms(5), &[block(ms(5), often, RED)], false);
    assert_eq!(robot.ids(), [1, 2], "out of view");
    robot.see(ms(10), &[], true);
    assert_eq!(robot.ids(), [1]);
}

#[test]
fn a_history_of_the_programs_own_says_what_is_remembered() {
    let mut percepts = Percepts::builtin();
    let (filled, marked) = (percepts.index("filled").unwrap(), percepts.index("marked").unwrap());
    percepts.percepts[usize::from(filled)].history = History::Own("highest".to_owned());
    percepts.percepts[usize::from(marked)].history = History::Own("nonsense".to_owned());
    let mut robot = Robot::new(&Percepts::builtin());
    robot.system = BeliefSystem::with_own(&percepts, &functions(), 16).unwrap();
    for (step, degree) in [0.25, 1.0, 0.5].into_iter().enumerate() {
        let now = ms(5 * u64::try_from(step).unwrap());
        let mut seen = block(now, [0.5, 0.0, 0.0], RED);
        seen.set_state(State::Filled, degree);
        seen.set_state(State::Marked, 1.0);
        robot.see(now, &[seen], true);
    }
    let belief = robot.system.beliefs().next().unwrap();
    let remembered = belief.percept(filled).unwrap();
    assert_eq!(remembered.feature(), Some(Feature::Number(1.0)));
    assert_eq!(remembered.sampled_at_ns, ms(5).as_nanos());
    // Its confidence has decayed since.
    assert!(remembered.confidence < 0.9 && remembered.confidence > 0.89);
    assert!(belief.percept(marked).is_none(), "nonsense is nothing");
    // Before its first sample there is nothing, and of a row used again nothing is left.
    assert!(robot.system.write(0, ms(0)).unwrap().percept(filled).is_none());
    for step in 0..200 {
        robot.see(ms(1000 + 5 * step), &[], true);
    }
    assert!(robot.ids().is_empty());
    robot.see(ms(3000), &[block(ms(3000), [0.5, 0.0, 0.0], RED)], true);
    let belief = robot.system.beliefs().next().unwrap();
    assert_eq!(belief.percept(filled).unwrap().feature(), Some(Feature::Number(0.0)));
}

#[test]
fn a_function_that_the_program_lacks_is_named() {
    let name = || "mine".to_owned();
    let said = |change: fn(&mut Percepts, String)| {
        let mut percepts = Percepts::builtin();
        change(&mut percepts, name());
        BeliefSystem::with_own(&percepts, &functions(), 16).unwrap_err().to_string()
    };
    let distance = said(|percepts, name| percepts.belief.distance[0].measure = Measure::Own(name));
    assert_eq!(
        distance,
        "the configuration wants the program's own distance `mine`, which this program lacks"
    );
    assert!(
        said(|percepts, name| percepts.belief.cull.push(Cull::Own(name))).contains("culling function `mine`")
    );
    assert!(
        said(|percepts, name| percepts.percepts[0].history = History::Own(name)).contains("history `mine`")
    );
}
