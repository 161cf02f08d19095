mod arrivals;
mod carrying;
mod culling;
mod functions;
mod tracking;
mod unobserved;

use clock::Duration;
use geometry::Pose;
use message::{Feature, NOBODY, Observation, Perceived, PerceptValue, SourceSet, State};
use perception::{Frame, Perception};
use settings::number::NotNegative;

use super::*;
use crate::percepts::{Component, Distance, Kernel, Measure, NoTermApplies, Range, Region};

const RED: [f32; 3] = [0.80, 0.05, 0.05];
const BLUE: [f32; 3] = [0.05, 0.15, 0.80];

fn ms(millis: u64) -> Instant {
    Instant::from_nanos(1_000_000_000 + millis * 1_000_000)
}

fn block(at: Instant, position_m: [f32; 3], colour_rgb: [f32; 3]) -> Observation {
    let mut block = Observation {
        confidence: 0.9,
        position_m,
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        colour_rgb,
        half_extents_m: [0.03; 3],
        shape: [0.0; 4],
        ..Observation::object(0, at.as_nanos())
    };
    block.set_state(State::Filled, 0.0);
    block
}

/// A system with its perception.
#[derive(Clone)]
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
        self.see_where(now, seen, |_| in_view);
    }

    fn see_where(&mut self, now: Instant, seen: &[Observation], in_view: impl Fn([f32; 3]) -> bool) {
        let perceived: Vec<_> = seen
            .iter()
            .map(|observation| {
                let snapshot = self.perception.perceive(observation, &Frame { agent: 0 });
                Perceived { observation: *observation, snapshot }
            })
            .collect();
        self.system.step(now, &perceived, 0..perceived.len(), SourceSet::of(0), in_view);
        let counts = self.system.counts();
        let len = u64::try_from(self.system.live_len()).unwrap();
        assert_eq!(counts.created - counts.merged - counts.culled - counts.evicted, len);
    }

    fn ids(&self) -> Vec<u64> {
        self.system.beliefs().map(|belief| belief.id).collect()
    }
}

#[test]
fn observations_of_an_unfinished_step_are_dropped_and_counted() {
    let mut robot = Robot::new(&Percepts::builtin());
    robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], true);
    let seen = [block(ms(5), [0.5, 0.002, 0.0], RED), block(ms(5), [0.9, 0.0, 0.0], BLUE)];
    let mut step_builder = robot.system.begin(ms(5));
    for (index, observation) in seen.into_iter().enumerate() {
        let snapshot = robot.perception.perceive(&observation, &Frame { agent: 0 });
        step_builder.add_observation(index, &Perceived { observation, snapshot });
    }
    let _not_finished = step_builder;
    // Another step, with one other thing instead of the two.
    let seen = [block(ms(10), [0.5, 0.004, 0.0], RED)];
    let perceived = seen.map(|observation| Perceived {
        observation,
        snapshot: robot.perception.perceive(&observation, &Frame { agent: 0 }),
    });
    robot.system.step(ms(10), &perceived, 0..1, SourceSet::of(0), |_| true);
    assert_eq!(robot.ids(), [1]);
    assert_eq!(robot.system.beliefs().next().unwrap().observations, 2);
    assert_eq!((robot.system.counts().overflowed, robot.system.counts().created), (2, 2));
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
fn similar_simultaneous_objects_stay_separate_and_merge_only_literally() {
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
fn similar_objects_of_two_sensors_at_one_place_are_merged() {
    let mut robot = Robot::new(&Percepts::builtin());
    let now = ms(0);
    let other_sensor = Observation { source: 1, ..block(now, [0.51, 0.0, 0.0], RED) };
    robot.see(now, &[block(now, [0.5, 0.0, 0.0], RED), other_sensor], true);
    assert_eq!(robot.ids(), [1]);
    assert_eq!(robot.system.beliefs().next().unwrap().observations, 2);
}

#[test]
fn a_source_distance_never_merges_objects_of_two_sources() {
    let mut percepts = Percepts::builtin();
    let colour = percepts.get(percepts.index("colour").unwrap()).unwrap();
    let seen_by = Percept { name: "seen_by".to_owned(), kernel: Kernel::Source, ..colour.clone() };
    percepts.percepts.push(seen_by);
    let percept = percepts.index("seen_by").unwrap();
    let weight = percepts.belief.threshold;
    percepts.belief.distance.push(Distance { percept, measure: Measure::Differs, weight });
    let mut robot = Robot::new(&percepts);
    for step in 0..4 {
        let now = ms(5 * step);
        let of = |source: u16| Observation { source, ..block(now, [0.5, 0.0, 0.0], RED) };
        // Alternately, and then both at once.
        match step {
            0 | 1 => robot.see(now, &[of(u16::try_from(step).unwrap())], false),
            _ => robot.see(now, &[of(0), of(1)], false),
        }
    }
    let believed =
        robot.system.beliefs().map(|belief| (belief.id, belief.observations, belief.symbol(percept)));
    assert_eq!(believed.collect::<Vec<_>>(), [(1, 3, Some(0)), (2, 3, Some(1))]);
}

#[test]
fn objects_of_different_colours_are_different_beliefs() {
    let mut robot = Robot::new(&Percepts::builtin());
    robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], false);
    robot.see(ms(5), &[block(ms(5), [0.5, 0.0, 0.0], BLUE)], false);
    assert_eq!(robot.ids(), [1, 2]);
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
fn an_observation_slightly_ahead_is_stored_at_the_step() {
    let mut robot = Robot::new(&Percepts::builtin());
    robot.see(ms(0), &[block(ms(2), [0.5, 0.0, 0.0], RED)], true);
    assert!(!robot.system.beliefs().next().unwrap().percepts().is_empty());
}

#[test]
fn a_step_back_in_time_is_counted_and_ignored() {
    let mut robot = Robot::new(&Percepts::builtin());
    robot.see(ms(50), &[block(ms(50), [0.5, 0.0, 0.0], RED)], true);
    robot.see(ms(20), &[block(ms(51), [0.5, 0.0, 0.0], RED)], true);
    assert_eq!(robot.system.counts().backwards, 1);
    assert_eq!(robot.system.now(), ms(50));
    assert_eq!(robot.ids(), [1]);
}

#[test]
fn a_full_system_keeps_its_beliefs_and_counts_dropped_observations() {
    let mut robot = Robot::new(&Percepts::builtin());
    let row = |now, count: u16| -> Vec<_> {
        (0..count).map(|index| block(now, [f32::from(index), 0.0, 0.0], RED)).collect()
    };
    robot.see(ms(0), &row(ms(0), 16), false);
    assert_eq!((robot.system.len(), robot.system.counts().overflowed), (16, 0));
    // Sixteen of these match existing beliefs. The others exceed the capacity, and one does not even get a slot.
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
fn individually_stamped_objects_all_become_beliefs() {
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
fn identities_are_numbered_without_gaps() {
    let mut robot = Robot::new(&Percepts::builtin());
    let (here, there) = ([0.5, 0.0, 0.0], [0.5, 0.4, 0.0]);
    robot.see(ms(0), &[block(ms(0), here, RED)], false);
    robot.see(ms(5), &[block(ms(5), here, RED)], false);
    robot.see(ms(10), &[block(ms(10), here, RED), block(ms(10), there, RED)], false);
    assert_eq!(robot.ids(), [1, 2]);
}

#[test]
fn the_holder_is_remembered() {
    let mut robot = Robot::new(&Percepts::builtin());
    let here = [0.5, 0.0, 0.0];
    robot.see(ms(0), &[Observation { held_by: 1, ..block(ms(0), here, RED) }], true);
    assert_eq!(robot.system.beliefs().next().unwrap().held_by, 1);
    robot.see(ms(5), &[block(ms(5), here, RED)], true);
    assert_eq!(robot.system.beliefs().next().unwrap().held_by, NOBODY);
}

#[test]
fn an_observation_without_percepts_creates_no_belief() {
    let mut robot = Robot::new(&Percepts::builtin());
    let doubtful = Observation { confidence: 0.4, ..block(ms(0), [0.5, 0.0, 0.0], RED) };
    robot.see(ms(0), &[doubtful], true);
    assert!(robot.system.is_empty());
}

#[test]
fn unconstrained_beliefs_without_terms_merge_only_literally() {
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
fn a_moved_frame_transforms_remembered_positions_and_turns_left_into_right() {
    let percepts = Percepts::builtin();
    let (left, orientation) = (percepts.index("left").unwrap(), percepts.index("orientation").unwrap());
    let mut robot = Robot::new(&percepts);
    robot.see(ms(0), &[block(ms(0), [0.5, 0.3, 0.1], RED)], false);
    // The new frame is 1 m ahead and looks back.
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
    // In the new frame it is seen at its remembered position.
    robot.see(ms(5), &[block(ms(5), [0.5, -0.3, 0.1], RED)], false);
    assert_eq!(robot.ids(), [1]);
}

/// A position percept and percepts derived from it: ranges, a region, and their children.
fn placed() -> Percepts {
    let mut percepts = Percepts::builtin();
    let history = percepts.get(6).unwrap().history.clone();
    percepts.percepts.truncate(6);
    let soft = NotNegative::try_from(0.5).ok();
    let range = |of, from, to, softness| Kernel::Range(Range { component: of, from, to, softness });
    let (min_m, max_m) = ([f64::NEG_INFINITY, 0.0, f64::NEG_INFINITY], [f64::INFINITY; 3]);
    for (name, parent, kernel) in [
        ("near", "position", range(Component::DistanceM, None, Some(1.0), soft)),
        ("very near", "near", range(Component::Number, Some(0.9), None, None)),
        ("left", "position", Kernel::Region(Region { min_m, max_m })),
        ("near left", "near", Kernel::Region(Region { min_m, max_m })),
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
fn after_a_frame_change_ranges_and_regions_are_evaluated_again() {
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
fn a_range_that_cannot_be_evaluated_after_a_frame_change_is_forgotten() {
    let percepts = placed();
    let near = percepts.index("near").unwrap();
    let mut robot = Robot::new(&percepts);
    robot.see(ms(0), &[block(ms(0), [0.75, 0.0, 0.0], RED)], false);
    let newest = |robot: &Robot| {
        let belief = robot.system.beliefs().next().unwrap();
        belief.percept(near).and_then(Remembered::feature)
    };
    assert_eq!(newest(&robot), Some(Feature::Number(1.0)));
    // Half a metre back, the position is at the middle of the range's fuzzy edge: neither degree passes.
    let x_old_new = Pose::<geometry::Base, geometry::Person>::upright(-0.5, 0.0, 0.0, 0.0);
    robot.system.reanchor(&x_old_new.inverse());
    assert_eq!(newest(&robot), None);
    // After another half metre it is outside.
    robot.system.reanchor(&x_old_new.inverse());
    assert_eq!(newest(&robot), Some(Feature::Number(0.0)));
}

#[test]
fn an_object_that_leaves_a_range_is_remembered_as_outside() {
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
fn a_cloned_belief_system_is_independent_of_the_original() {
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
fn similar_near_objects_keep_their_identities_during_a_carry() {
    let mut robot = Robot::new(&Percepts::builtin());
    let mut seed = 1;
    let home = |index: u16| [0.5, f32::from(index) * 0.09, 0.025];
    for step in 0..600_u16 {
        let now = ms(5 * u64::from(step));
        let seen: Vec<_> = (0..7)
            .map(|index| {
                let mut place = home(index);
                if index == 0 {
                    // Up, over all others within a second, down beyond them, then at rest.
                    let progress = (f32::from(step) / 200.0).min(1.0);
                    place[1] += progress * 0.7;
                    place[2] += 0.6 * progress * (1.0 - progress);
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
