use std::sync::LazyLock;

use belief::percepts::Percepts;
use clock::Duration;
use geometry::Pose;
use message::{Header, Modality, NOBODY, Observation, SourceSet};
use perception::Perception;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use scene::{Cone, Samples, Sight};

use super::minds::{CAPACITY, Minds, believed, head};
use super::workspace::{AWAY, EYES, STEP, TABLE, block, button, is_present, person, wall};
use crate::settings::Perspective;
use crate::{Partner, PerceptualContext};

const SECOND: Duration = Duration::from_secs(1);
/// Straight at the robot's face; the button is out of view.
const UP: [f64; 3] = [0.06, 0.0, 2.6];

#[test]
fn an_unshared_sighting_stays_out_of_the_partners_nested_perspective() {
    let mut minds = Minds::new(1, 3);
    let on = |minds: &Minds| {
        [&[][..], &[1], &[1, 0], &[1, 0, 1]].map(|path| minds.on(path).map(|degree| degree > 0.5))
    };
    let (yes, no) = (Some(true), Some(false));
    minds.run(SECOND, &[person(EYES, TABLE), button(0.0)]);
    assert_eq!(on(&minds), [no, no, no, no]);
    // The button is switched on behind the partner's back. The robot sees this and that the partner does not.
    minds.run(SECOND, &[person(EYES, AWAY), button(0.0)]);
    minds.run(SECOND, &[person(EYES, AWAY), button(1.0)]);
    assert_eq!(on(&minds), [yes, no, no, no]);
    assert!(!is_present(minds.at(&[1, 0])), "he cannot see whether I look");
    // The partner sees the robot looking, but not at what: their belief is unchanged.
    minds.run(SECOND, &[person(EYES, UP), button(1.0)]);
    assert!(is_present(minds.at(&[1, 0])));
    assert_eq!(on(&minds), [yes, no, no, no]);
    // The partner looks at the button and sees that the robot does too.
    minds.run(SECOND, &[person(EYES, TABLE), button(1.0)]);
    assert_eq!(on(&minds), [yes, yes, yes, yes]);
}

#[test]
fn a_partner_sees_that_a_wall_hides_an_object_from_the_robot() {
    let mut minds = Minds::new(1, 2);
    // The robot's configured field of view is unlimited; in the partner's model a wall stands before the
    // robot's eyes.
    let before_me = wall([0.3, 0.0, 0.4]);
    minds.run(SECOND, &[person(EYES, TABLE), before_me, button(1.0)]);
    assert_eq!((minds.on(&[]), minds.on(&[1]), minds.on(&[1, 0])), (Some(1.0), Some(1.0), None));
    minds.run(SECOND, &[person(EYES, TABLE), button(1.0)]);
    assert_eq!(minds.on(&[1, 0]), Some(1.0));
}

#[test]
fn an_observation_too_far_from_a_partner_is_refused() {
    let mut config = Perspective::builtin();
    config.sight.range_m = 1e4.try_into().unwrap();
    let mut minds = Minds::with(&config, 1, 1);
    let far = [block([-600.0, 0.0, 0.03]), block([0.5, 0.0, 0.03])];
    let [there, here] = [[600.0, 0.0, 0.5], [-600.0, 0.0, 0.5]];
    minds.step_looking(SourceSet::ALL, &[&[person(there, here)], &far[..]].concat());
    assert_eq!((minds.beliefs(&[]).len(), minds.beliefs(&[1]).len()), (2, 1));
    let refused = [minds.robot.head(Header::default()), minds.at(&[1]).head(Header::default())];
    assert_eq!(refused.map(|head| head.refused), [0, 1]);
}

#[test]
fn walls_beyond_a_partners_capacity_are_counted() {
    let mut config = Perspective::builtin();
    config.occluders.max_count = 1.try_into().unwrap();
    let mut minds = Minds::with(&config, 1, 2);
    let overflowed = |minds: &Minds| minds.at(&[1]).head(Header::default()).overflowed;
    let before_him = wall([0.9, 0.2, 0.1]);
    minds.run(STEP, &[person(EYES, TABLE), before_him]);
    assert_eq!(overflowed(&minds), 0);
    minds.run(STEP, &[person(EYES, TABLE), before_him, wall([0.9, -0.2, 0.1])]);
    assert_eq!(minds.perceptual_context(&[1]).occluders().len(), 1);
    assert_eq!(overflowed(&minds), 1);
}

#[test]
fn a_wall_unseen_by_a_partner_never_occludes_in_its_nested_perspective() {
    let mut config = Perspective::builtin();
    config.sight.cone_half_angle_deg = 25.0.try_into().unwrap();
    config.sight.absent_after_ms = 10_000.0.try_into().unwrap();
    let mut minds = Minds::with(&config, 1, 2);
    minds.run(SECOND, &[person(EYES, UP)]);
    minds.run(SECOND, &[person(EYES, [0.06, 0.0, 0.62])]);
    // The partner looks down at a near thing; the robot's face and the wall are out of their narrow view.
    let near_him = Observation { position_m: [1.2, 0.0, 0.03], ..button(1.0) };
    let before_me = wall([0.3, 0.0, 0.45]);
    let scene = [person(EYES, [1.2, 0.0, 0.03]), before_me, near_him];
    minds.run(SECOND, &scene);
    let my_eye = minds.perceptual_context(&[1]).eye(0, minds.now).unwrap();
    let cone = Cone::new(config.sight.cone_half_angle_deg.radians(), 5.0).unwrap();
    let hidden = Sight::new(my_eye, cone, minds.robot.perceptual_context().occluders());
    let place = Pose::upright(1.2, 0.0, 0.03, 0.0);
    assert!(hidden.visible_share(&place, [0.03; 3], Samples::Corners) < 0.1, "the wall is not in my way");
    assert_eq!(
        (minds.perceptual_context(&[]).occluders().len(), minds.perceptual_context(&[1]).occluders().len()),
        (1, 0)
    );
    assert_eq!((minds.on(&[1]), minds.on(&[1, 0])), (Some(1.0), Some(1.0)));
    // Had the partner seen the wall, their model of the robot would not see the thing.
    let mut knowing = Minds::with(&config, 1, 2);
    knowing.run(SECOND, &[person(EYES, [0.06, 0.0, 0.62]), before_me]);
    knowing.run(SECOND, &scene);
    assert_eq!(knowing.perceptual_context(&[1]).occluders().len(), 1);
    assert_eq!((knowing.on(&[1]), knowing.on(&[1, 0])), (Some(1.0), None));
}

#[test]
fn a_partner_forgets_a_removed_wall_only_when_looking() {
    let mut minds = Minds::new(1, 2);
    let before_me = wall([0.3, 0.0, 0.4]);
    minds.run(SECOND, &[person(EYES, TABLE), before_me, button(1.0)]);
    minds.run(SECOND * 3, &[person(EYES, AWAY), button(1.0)]);
    let walls = |minds: &Minds, path| minds.perceptual_context(path).occluders().len();
    assert_eq!((walls(&minds, &[]), walls(&minds, &[1])), (0, 1));
    minds.run(SECOND, &[person(EYES, TABLE), button(1.0)]);
    assert_eq!(walls(&minds, &[1]), 0);
}

#[test]
fn a_remembered_wall_stays_in_the_nested_perspective() {
    let mut minds = Minds::new(1, 3);
    let aside = wall([0.7, -0.6, 0.125]);
    minds.run(SECOND, &[person(EYES, TABLE), aside]);
    let walls = |minds: &Minds, path| minds.perceptual_context(path).occluders().len();
    assert_eq!((walls(&minds, &[1]), walls(&minds, &[1, 0])), (1, 1));
    // The partner looks only at the robot; the remembered wall is still in the robot's view.
    minds.run(SECOND * 2, &[person(EYES, UP), aside]);
    assert!(is_present(minds.at(&[1, 0])));
    assert_eq!((walls(&minds, &[1]), walls(&minds, &[1, 0])), (1, 1));
}

#[test]
fn a_partner_attributes_handled_and_audible_objects_to_the_robot() {
    let mut minds = Minds::new(1, 2);
    // Beside the robot: out of the robot's view and in the partner's.
    let beside = Observation { position_m: [0.0, 0.9, 0.03], ..button(1.0) };
    minds.run(SECOND, &[person(EYES, [0.3, 0.3, 0.2]), beside]);
    assert_eq!((minds.on(&[1]), minds.on(&[1, 0])), (Some(1.0), None));
    let held = Observation { held_by: 0, ..beside };
    minds.run(SECOND, &[person(EYES, [0.3, 0.3, 0.2]), held]);
    assert_eq!(minds.on(&[1, 0]), Some(1.0));
    let mut listening = Minds::new(1, 2);
    let sound = Observation { modality: Modality::Hearing.raw(), held_by: NOBODY, ..beside };
    listening.run(SECOND, &[person(EYES, UP), wall([0.5, 0.3, 0.12]), sound]);
    assert_eq!((listening.on(&[1]), listening.on(&[1, 0])), (Some(1.0), Some(1.0)));
    let mut away = Minds::new(1, 2);
    away.run(SECOND, &[person(EYES, AWAY), sound]);
    assert_eq!((away.on(&[1]), away.on(&[1, 0])), (Some(1.0), None), "he does not see that I am there");
}

#[test]
fn nested_beliefs_freeze_while_their_partner_is_absent() {
    let mut minds = Minds::new(1, 4);
    minds.run(SECOND, &[person(EYES, TABLE), button(0.0)]);
    minds.run(SECOND, &[button(0.0)]);
    let deeper: [&[u16]; 3] = [&[1, 0], &[1, 0, 1], &[1, 0, 1, 0]];
    let frozen = deeper.map(|path| minds.beliefs(path));
    minds.run(SECOND * 5, &[button(1.0)]);
    assert_eq!(minds.on(&[]), Some(1.0));
    assert_eq!(deeper.map(|path| minds.beliefs(path)), frozen);
    assert!(frozen.iter().all(|beliefs| beliefs.len() == 1));
    assert!(deeper.iter().all(|path| !is_present(minds.at(path))));
}

#[test]
fn the_pose_of_the_robots_head_is_the_latest_observed() {
    let mut minds = Minds::new(1, 2);
    let beside = Observation { position_m: [0.0, 0.9, 0.03], ..button(1.0) };
    let turned = head(person([0.06, 0.0, 0.62], [0.0, 0.9, 0.03]));
    minds.run(SECOND, &[person(EYES, [0.3, 0.3, 0.2]), turned, beside]);
    assert_eq!(minds.on(&[1, 0]), Some(1.0));
    let eye = minds.robot.head(Header::at(0)).eye().unwrap();
    assert!(eye.difference(&minds.perceptual_context(&[1]).eye(0, minds.now).unwrap()).1 < 1e-6);
}

/// The scene for some steps: gaze of partner and robot (`None` if absent), moving blocks, and walls.
#[derive(Clone, Debug)]
struct Moment {
    his: Option<[f64; 2]>,
    mine: Option<[f64; 2]>,
    blocks: Vec<([f32; 2], [f32; 2])>,
    walls: Vec<[f32; 2]>,
    active_sources: SourceSet,
    steps: u8,
    step: Duration,
}

fn moment() -> impl Strategy<Value = Moment> {
    let gaze = || prop::option::weighted(0.85, [-0.5..1.8_f64, -1.0..1.0_f64]);
    let place = || [0.1..1.2_f32, -0.6..0.6_f32];
    let blocks = prop::collection::vec((place(), prop::array::uniform2(-0.02..0.02_f32)), 0..5);
    let walls = prop::collection::vec(place(), 0..3);
    // Mostly one or two sources deliver a frame, sometimes none.
    let active_sources = prop::collection::vec((0..2_u16).prop_map(SourceSet::of), 0..4);
    // Long enough to reach culling, the absence timeout and the removal of a wall.
    let time = prop::sample::select(vec![5, 100, 350]).prop_map(Duration::from_millis);
    (gaze(), gaze(), blocks, walls, active_sources, 1..4_u8, time).prop_map(
        |(his, mine, blocks, walls, active_sources, steps, step)| Moment {
            his,
            mine,
            blocks,
            walls,
            active_sources: active_sources.into_iter().collect(),
            steps,
            step,
        },
    )
}

impl Moment {
    fn things(&self, step: u8) -> Vec<Observation> {
        let his = self.his.map(|[x, y]| person(EYES, [x, y, 0.0]));
        let mine = self.mine.map(|[x, y]| head(person([0.06, 0.0, 0.62], [x + 0.3, y, 0.0])));
        let second = Observation { partner: 2, ..person([0.7, 1.3, 0.5], [0.6, 0.0, 0.1]) };
        let gone = f32::from(step);
        let blocks = self.blocks.iter().map(|([x, y], [per_step_x, per_step_y])| {
            block([x + gone * per_step_x, y + gone * per_step_y, 0.03])
        });
        let walls = self.walls.iter().map(|[x, y]| wall([*x, *y, 0.125]));
        // Two sources with alternating things.
        let of = |(number, thing): (u16, _)| Observation { source: number % 2, ..thing };
        let (blocks, walls) = ((0..).zip(blocks).map(of), (0..).zip(walls).map(of));
        his.into_iter().chain(mine).chain([second]).chain(walls).chain(blocks).collect()
    }
}

static PERCEPTS: LazyLock<Percepts> = LazyLock::new(Percepts::builtin);
static CONFIG: LazyLock<Perspective> = LazyLock::new(Perspective::builtin);

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2_000,
        max_global_rejects: 20_000,
        rng_seed: RngSeed::Fixed(18),
        ..ProptestConfig::default()
    })]

    /// A perspective of depth n is n applications of depth 1. Each needs only what an agent perceives:
    /// observations, eyes, and where the agent would notice an absence. A partner built from just that must
    /// have beliefs bit-identical to those of the nested one.
    #[test]
    fn nesting_equals_a_perspective_on_the_parents_observations(
        moments in prop::collection::vec(moment(), 1..4),
    ) {
        let config = &*CONFIG;
        let mut minds = Minds::perceiving(PERCEPTS.clone(), config, 2, 3);
        let perception = Perception::new(&minds.percepts).unwrap();
        let cone = Cone::new(config.sight.cone_half_angle_deg.radians(), config.sight.range_m.get()).unwrap();
        let mut alone: Vec<(Vec<u16>, PerceptualContext, Partner)> = minds
            .all
            .iter()
            .map(|(nested, _)| nested.path.agents().unwrap().to_vec())
            .filter(|path| path.len() > 1)
            .map(|path| {
                let observer = path[path.len() - 2];
                let partner =
                    Partner::new(path[path.len() - 1], perception.clone(), &minds.percepts, config, CAPACITY);
                (path, PerceptualContext::new(observer, config, 2, CAPACITY), partner.unwrap())
            })
            .collect();
        prop_assert_eq!(alone.len(), 12);
        let mut compared = 0;
        for moment in &moments {
            for step in 0..moment.steps {
                let entries = minds.step_after(moment.step, moment.active_sources, &moment.things(step));
                for (path, perceptual_context, partner) in &mut alone {
                    let parent = minds.perceptual_context(&path[..path.len() - 1]);
                    let grandparent = minds.perceptual_context(&path[..path.len() - 2]);
                    match parent.eye(parent.agent(), minds.now) {
                        None => perceptual_context.set_absent(),
                        Some(eye) => {
                            let kept = entries.iter().zip(parent.perceives()).filter(|(_, kept)| **kept);
                            let kept: Vec<_> = kept.map(|(entry, _)| *entry).collect();
                            perceptual_context.record_frame(minds.now, moment.active_sources, &kept, kept.iter().map(|_| true));
                            perceptual_context.set_own_eye(eye);
                            let sight = Sight::new(eye, cone, grandparent.occluders());
                            for (agent, other) in grandparent.eyes(minds.now) {
                                if sight.sees(&other.x_base_eye.origin()) {
                                    perceptual_context.update_agent(agent, other);
                                }
                            }
                            perceptual_context.forget(
                                minds.now,
                                |place, half| sight.visible_share(place, half, Samples::Surface) > 0.0,
                                |place| grandparent.has_occluder_at(place),
                            );
                            partner.step(minds.now, &kept, perceptual_context, |place| {
                                minds.survey(&path[..path.len() - 1], place)
                            });
                        }
                    }
                    let nested = minds.at(path);
                    if parent.eye(parent.agent(), minds.now).is_some() {
                        prop_assert_eq!(is_present(partner), is_present(nested), "{:?}", path);
                    }
                    prop_assert_eq!(partner.frame(), nested.frame(), "{:?}", path);
                    prop_assert_eq!(believed(partner), believed(nested), "{:?}", path);
                    compared += believed(nested).len();
                }
            }
        }
        // Most worlds have beliefs at depth 2 and 3.
        prop_assume!(compared > 0);
    }
}
