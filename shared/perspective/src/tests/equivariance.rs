//! Equivariance: the beliefs in an agent's frame do not depend on where the world is or how it is turned.

use std::sync::LazyLock;

use belief::percepts::{Component, Kernel, Percept, Percepts, Range};
use clock::Duration;
use geometry::Pose;
use message::{Belief, Feature, Observation, Remembered, SourceSet, State};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use quantity::number::single;

use super::minds::{Minds, carried, head};
use super::workspace::{EYES, Workspace, block, person, wall};
use crate::settings::Perspective;

/// Tolerance in metres and as a share of one: observations are in single precision, and the worlds are metres
/// apart.
const ROUNDING: f64 = 2e-5;

/// The built-in percepts, one of them replaced by a soft range of the distance to the agent.
static PERCEPTS: LazyLock<Percepts> = LazyLock::new(|| {
    let mut percepts = Percepts::builtin();
    let inserted = usize::from(percepts.index("inserted").unwrap());
    let kernel = Kernel::Range(Range {
        component: Component::DistanceM,
        from: None,
        to: Some(0.4),
        softness: Some(1.5.try_into().unwrap()),
    });
    let parent = percepts.index("position");
    let given_up = percepts.percepts[inserted].clone();
    let role = belief::percepts::Role::Neither;
    percepts.percepts[inserted] = Percept { name: "near_me".to_owned(), parent, role, kernel, ..given_up };
    percepts
});
static CONFIG: LazyLock<Perspective> = LazyLock::new(Perspective::builtin);

/// A block: position, velocity in metres per step, orientation and fill level.
#[derive(Clone, Debug)]
struct Moving {
    from: [f32; 2],
    per_step: [f32; 2],
    turn_rad: f64,
    filled: f32,
    blue: bool,
}

/// The partner's position and gaze for some steps, and the length of a step.
#[derive(Clone, Debug)]
struct Phase {
    stands: [f64; 2],
    looks: [f64; 2],
    steps: u8,
    step: Duration,
}

/// A world in which things are moved, pushed behind a wall and left out of sight.
#[derive(Clone, Debug)]
struct World {
    blocks: Vec<Moving>,
    wall: [f32; 2],
    wall_per_step: [f32; 2],
    phases: Vec<Phase>,
    /// Rigid motion of the whole world: along x and y, and a turn about the vertical.
    by: [f64; 3],
}

fn world() -> impl Strategy<Value = World> {
    let per_step = || prop::array::uniform2(-0.01..0.01_f32);
    let block =
        (prop::array::uniform2(-0.6..0.6_f32), per_step(), -3.0..3.0_f64, 0.0..1.0_f32, any::<bool>());
    let block = block.prop_map(|([x, y], per_step, turn_rad, filled, blue)| Moving {
        from: [x + 0.7, y],
        per_step,
        turn_rad,
        filled,
        blue,
    });
    let time = prop::sample::select(vec![5, 100, 350]).prop_map(Duration::from_millis);
    let phase = (prop::array::uniform2(-0.4..0.4_f64), [0.3..1.0_f64, -0.8..0.8_f64], 1..4_u8, time);
    let phase = phase.prop_map(|([x, y], looks, steps, step)| Phase {
        stands: [EYES[0] + x, EYES[1] + y],
        looks,
        steps,
        step,
    });
    let wall = ([0.3..0.9_f32, -0.3..0.3_f32], per_step());
    let by = prop::array::uniform3(-3.0..3.0_f64);
    (prop::collection::vec(block, 1..5), wall, prop::collection::vec(phase, 1..4), by).prop_map(
        |(blocks, (wall, wall_per_step), phases, by)| World { blocks, wall, wall_per_step, phases, by },
    )
}

impl World {
    /// The observations of each step, and the time since the step before.
    fn steps(&self) -> impl Iterator<Item = (Duration, Vec<Observation>)> {
        let phases = self.phases.iter().flat_map(|phase| (0..phase.steps).map(move |_| phase));
        (0_u8..).zip(phases).map(|(number, phase)| {
            let moved = |from: [f32; 2], per_step: [f32; 2]| {
                let along = |axis: usize| from[axis] + f32::from(number) * per_step[axis];
                [along(0), along(1)]
            };
            let ([stands_x, stands_y], [x, y]) = (phase.stands, phase.looks);
            let mine = head(person([0.06, 0.0, 0.62], [0.8, 0.0, 0.0]));
            let mut things = vec![person([stands_x, stands_y, EYES[2]], [x, y, 0.0]), mine];
            let [x, y] = moved(self.wall, self.wall_per_step);
            things.push(wall([x, y, 0.125]));
            things.extend(self.blocks.iter().map(|thing| {
                let [x, y] = moved(thing.from, thing.per_step);
                let turned = Pose::<geometry::Base, geometry::Thing>::upright(0.0, 0.0, 0.0, thing.turn_rad);
                let mut seen = Observation {
                    orientation_xyzw: turned.orientation_xyzw().map(single),
                    ..block([x, y, 0.03])
                };
                if thing.blue {
                    seen.colour_rgb = [0.05, 0.15, 0.80];
                }
                seen.set_state(State::Filled, thing.filled);
                seen
            }));
            (phase.step, things)
        })
    }

    fn carried(&self) -> Pose<geometry::Base, geometry::Base> {
        let [x, y, turn_rad] = self.by;
        Pose::upright(x, y, 0.0, turn_rad)
    }
}

fn is_near(one: f32, other: f32) -> bool {
    (f64::from(one) - f64::from(other)).abs() < ROUNDING
}

/// Whether two features are equal up to rounding; q and −q are the same orientation.
fn agree(one: Option<Feature>, other: Option<Feature>) -> bool {
    match (one, other) {
        (Some(Feature::Number(a)), Some(Feature::Number(b))) => is_near(a, b),
        (Some(Feature::Vector(a)), Some(Feature::Vector(b))) => {
            a.iter().zip(&b).all(|(a, b)| is_near(*a, *b))
        }
        (Some(Feature::Orientation(a)), Some(Feature::Orientation(b))) => {
            let as_it_is = a.iter().zip(&b).all(|(a, b)| is_near(*a, *b));
            as_it_is || a.iter().zip(&b).all(|(a, b)| is_near(*a, -*b))
        }
        (one, other) => one == other,
    }
}

/// Whether two remembered evaluations (m, c, d) of a percept are equal up to rounding.
fn same(one: &Remembered, other: &Remembered) -> bool {
    (one.percept, one.sampled_at_ns) == (other.percept, other.sampled_at_ns)
        && is_near(one.matching, other.matching)
        && is_near(one.confidence, other.confidence)
        && agree(one.feature(), other.feature())
}

/// Checks that two beliefs are equal up to rounding in every percept; returns the number of percepts.
fn compare(one: &Belief, other: &Belief) -> Result<usize, TestCaseError> {
    let about = |belief: &Belief| {
        let Belief { id, born_at_ns, perceived_at_ns, observations, held_by, owner, .. } = *belief;
        (id, born_at_ns, perceived_at_ns, observations, held_by, owner, belief.percepts().len())
    };
    prop_assert_eq!(about(one), about(other));
    for (one, other) in one.percepts().iter().zip(other.percepts()) {
        prop_assert!(same(one, other), "{one:?} {:?} and {other:?} {:?}", one.feature(), other.feature());
    }
    Ok(one.percepts().len())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, rng_seed: RngSeed::Fixed(9), ..ProptestConfig::default() })]

    #[test]
    fn a_partners_beliefs_are_equivariant(world in world()) {
        let (mut here, mut there) =
            (Workspace::perceiving(PERCEPTS.clone(), &CONFIG), Workspace::perceiving(PERCEPTS.clone(), &CONFIG));
        for (time, things) in world.steps() {
            here.step_after(time, SourceSet::of(0), &things);
            there.step_after(time, SourceSet::of(0), &carried(&things, &world.carried()));
            let (here_his, there_his) = (here.his(), there.his());
            prop_assert_eq!(here_his.len(), there_his.len());
            for (one, other) in here_his.iter().zip(&there_his) {
                compare(one, other)?;
            }
        }
    }

    #[test]
    fn nested_beliefs_in_their_frames_are_independent_of_the_world_pose(world in world()) {
        let minds = || Minds::perceiving(PERCEPTS.clone(), &CONFIG, 1, 3);
        let (mut here, mut there) = (minds(), minds());
        for (time, things) in world.steps() {
            here.step_after(time, SourceSet::of(0), &things);
            there.step_after(time, SourceSet::of(0), &carried(&things, &world.carried()));
            for path in [&[1][..], &[1, 0], &[1, 0, 1]] {
                let (ones, others) = (here.beliefs(path), there.beliefs(path));
                prop_assert_eq!(ones.len(), others.len(), "{:?}", path);
                for (one, other) in ones.iter().zip(&others) {
                    compare(one, other)?;
                }
            }
        }
    }
}
