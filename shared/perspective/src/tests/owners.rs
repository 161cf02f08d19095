use belief::percepts::Percepts;
use clock::Duration;
use geometry::{Base, Pose, Position};
use message::{Belief, NOBODY, Observation};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::workspace::{EYES, TABLE, Workspace, block, person, wall};
use crate::settings::{Ownership, OwnershipRule, Perspective};
use crate::{MAX_TERRITORY_BELIEFS, OwnershipClaim, OwnershipEstimator};

const ROBOT: [f64; 2] = [0.0, 0.0];
const TEACHER: [f64; 2] = [1.5, 0.0];

fn ownership(rule: OwnershipRule) -> Ownership {
    Ownership { rule, ..Perspective::builtin().ownership }
}

fn claims(places: &[[f64; 2]]) -> impl Iterator<Item = OwnershipClaim> {
    (1..).zip(places).map(|(id, [x, y])| OwnershipClaim {
        id,
        place: Position::new(*x, *y, 0.03),
        held_by: NOBODY,
    })
}

fn agents(places: [[f64; 2]; 2]) -> impl Iterator<Item = (u16, Position<Base>)> + Clone {
    (0..).zip(places.map(|[x, y]| Position::new(x, y, 0.6)))
}

fn by_territory(places: &[[f64; 2]]) -> Vec<u16> {
    let mut owners = OwnershipEstimator::new(&ownership(OwnershipRule::Territory), 64);
    owners.update(claims(places), agents([ROBOT, TEACHER]));
    owners.all().to_vec()
}

#[test]
fn in_the_second_task_each_table_side_belongs_to_its_agent() {
    // Six things in front of the teacher and six in front of the robot, as in the study.
    let his = [[1.00, -0.3], [1.10, -0.2], [1.05, -0.05], [1.00, 0.05], [1.10, 0.15], [1.05, 0.3]];
    let mine = [[0.35, -0.3], [0.42, -0.2], [0.38, -0.05], [0.35, 0.1], [0.40, 0.2], [0.42, 0.3]];
    let owners = by_territory(&[his, mine].concat());
    assert_eq!(owners, [[1; 6], [0; 6]].concat());
}

#[test]
fn objects_without_separate_groups_have_no_owner() {
    // The gap is 1.4 times the longest link.
    assert_eq!(by_territory(&[[0.3, 0.0], [0.4, 0.0], [0.54, 0.0], [0.64, 0.0]]), [NOBODY; 4]);
    assert_eq!(by_territory(&[[0.3, 0.0], [0.4, 0.0], [1.3, 0.0], [1.4, 0.0]]), [0, 0, 1, 1]);
    // A single thing is no territory.
    assert_eq!(by_territory(&[[0.3, 0.0], [0.4, 0.0], [1.4, 0.0]]), [NOBODY; 3]);
    // Both groups are nearer to the robot.
    assert_eq!(by_territory(&[[0.2, 0.3], [0.2, 0.4], [0.2, -0.3], [0.2, -0.4]]), [NOBODY; 4]);
    // One group is equally near to both agents.
    assert_eq!(by_territory(&[[0.7, 0.0], [0.8, 0.0], [1.3, 0.0], [1.4, 0.0]]), [NOBODY; 4]);
    assert_eq!(by_territory(&[[0.5, 0.0]; 6]), [NOBODY; 6]);
    assert_eq!(by_territory(&[]), [NOBODY; 0]);
}

#[test]
fn an_object_belongs_to_its_last_holder() {
    let mut owners = OwnershipEstimator::new(&ownership(OwnershipRule::Possession), 4);
    let mut update = |held: &[(u64, u16)]| {
        let claim = |(id, held_by): &(u64, u16)| OwnershipClaim {
            id: *id,
            place: Position::new(0.0, 0.0, 0.0),
            held_by: *held_by,
        };
        owners.update(held.iter().map(claim), agents([ROBOT, TEACHER]));
        owners.all().to_vec()
    };
    assert_eq!(update(&[(1, NOBODY), (2, 1), (5, 0)]), [NOBODY, 1, 0]);
    assert_eq!(update(&[(1, NOBODY), (2, NOBODY), (5, NOBODY)]), [NOBODY, 1, 0]);
    assert_eq!(update(&[(2, 0), (5, NOBODY), (7, NOBODY)]), [0, 0, NOBODY]);
    // A thing that was forgotten and seen again has a new identity.
    assert_eq!(update(&[(2, NOBODY)]), [0]);
    assert_eq!(update(&[(2, NOBODY), (5, NOBODY)]), [0, NOBODY]);
}

/// A configured region around x = 1 m belongs to the teacher.
fn told(rule: OwnershipRule) -> Perspective {
    let region = "[{ owner = 1, from_m = [0.8, -1.0], to_m = [1.2, 1.0] }]";
    let text = include_str!("../../perspective.toml").replace("regions = []", &format!("regions = {region}"));
    let config: Perspective = settings::parse(&text, "p.toml".as_ref()).unwrap();
    Perspective { ownership: Ownership { rule, ..config.ownership }, ..config }
}

#[test]
fn configured_owners_hold_and_other_objects_have_no_owner() {
    for (by, expected) in [(OwnershipRule::Regions, 1), (OwnershipRule::None, NOBODY)] {
        let mut owners = OwnershipEstimator::new(&told(by).ownership, 4);
        owners.update(claims(&[[1.0, 0.0], [0.4, 0.0]]), agents([ROBOT, TEACHER]));
        assert_eq!((owners.owner(0), owners.owner(1), owners.owner(9)), (expected, NOBODY, NOBODY));
    }
}

/// Regions are in the base frame, the partner's beliefs in the partner's.
#[test]
fn configured_and_held_ownership_holds_in_every_perspective() {
    let near = block([0.35, 0.1, 0.03]);
    let held = Observation { held_by: 1, ..block([0.40, 0.3, 0.03]) };
    let far = block([1.0, 0.1, 0.03]);
    let all = [person(EYES, TABLE), near, held, far];
    for (by, expected) in
        [(OwnershipRule::Regions, [NOBODY, NOBODY, 1]), (OwnershipRule::Possession, [NOBODY, 1, NOBODY])]
    {
        let mut world = Workspace::with(&told(by));
        world.step(&all);
        let owners = |beliefs: Vec<Belief>| beliefs.iter().map(|belief| belief.owner).collect::<Vec<_>>();
        assert_eq!(owners(world.robots()), expected, "{by:?}");
        assert_eq!(owners(world.his()), expected, "{by:?}");
    }
}

#[test]
fn ownership_in_each_perspective_uses_only_its_known_agents() {
    let mut config = Perspective::builtin();
    config.ownership = ownership(OwnershipRule::Territory);
    let mut world = Workspace::with(&config);
    let mine = [[0.35, 0.1], [0.40, 0.2]].map(|[x, y]| block([x, y, 0.03]));
    let his = [[1.0, 0.1], [1.05, 0.2]].map(|[x, y]| block([x, y, 0.03]));
    let all = [&[person(EYES, TABLE)], &mine[..], &his[..]].concat();
    world.step(&all);
    let owners = |beliefs: Vec<Belief>| beliefs.iter().map(|belief| belief.owner).collect::<Vec<_>>();
    assert_eq!(owners(world.robots()), [0, 0, 1, 1]);
    assert_eq!(owners(world.his()), [0, 0, 1, 1]);
    // A wall hides the robot's things from the partner, whose beliefs form one group.
    let mut hidden = Workspace::with(&config);
    hidden.step(&[&all[..], &[wall([0.6, 0.15, 0.2])]].concat());
    assert_eq!((owners(hidden.robots()), owners(hidden.his())), (vec![0, 0, 1, 1], vec![NOBODY; 2]));
    // While the partner is away, the robot knows no other agent as an owner.
    world.run(Duration::from_secs(1), &all[1..]);
    assert_eq!((owners(world.robots()), owners(world.his())), (vec![NOBODY; 4], vec![0, 0, 1, 1]));
    config.ownership = ownership(OwnershipRule::None);
    let mut unasked = Workspace::with(&config);
    unasked.step(&all);
    assert_eq!(owners(unasked.robots()), [NOBODY; 4]);
}

#[test]
fn until_the_next_estimate_owners_stay_and_new_objects_have_none() {
    let mut config = Perspective::builtin();
    config.ownership = ownership(OwnershipRule::Territory);
    let mut world = Workspace::with(&config);
    let things = [[0.35, 0.1], [0.40, 0.2], [0.45, 0.0], [1.0, 0.1], [1.05, 0.2], [0.30, 0.0]];
    // They are certain, so a new one is announced at once.
    let blocks = things.map(|[x, y]| Observation { confidence: 1.0, ..block([x, y, 0.03]) });
    let owners = |beliefs: Vec<Belief>| beliefs.iter().map(|belief| belief.owner).collect::<Vec<_>>();
    let see = |some: &[Observation]| [&[person(EYES, TABLE)], some].concat();
    world.run(Duration::from_millis(300), &see(&blocks[..5]));
    assert_eq!((owners(world.robots()), owners(world.his())), (vec![0, 0, 0, 1, 1], vec![0, 0, 0, 1, 1]));
    // The robot updates in the step of the arrival, a partner in the next one.
    world.step(&see(&blocks));
    let (judged, waits) = (vec![0, 0, 0, 1, 1, 0], vec![0, 0, 0, 1, 1, NOBODY]);
    assert_eq!((owners(world.robots()), owners(world.his())), (judged.clone(), waits));
    world.step(&see(&blocks));
    assert_eq!(owners(world.his()), judged);
    // When the oldest belief is culled, all indices shift; the owners must not.
    let mut steps = 0;
    while world.his().len() == 6 {
        world.step(&see(&blocks[1..]));
        steps += 1;
        assert!(steps < 1_000, "it is not culled");
    }
    assert_eq!(owners(world.his()), [0, 0, 1, 1, 0]);
}

/// Blocks in `rows` by `columns`, starting at a row at `x`.
fn grid(x: f32, [rows, columns]: [u8; 2], pitch_m: f32) -> impl Iterator<Item = Observation> {
    (0..rows * columns).map(move |index| {
        let [row, column] = [index / columns, index % columns].map(f32::from);
        Observation { confidence: 1.0, ..block([x + pitch_m * row, pitch_m * column - 0.2, 0.03]) }
    })
}

#[test]
fn many_objects_are_compared_over_several_steps() {
    let mut config = Perspective::builtin();
    config.ownership = ownership(OwnershipRule::Territory);
    let mut world = Workspace::with_room(Percepts::builtin(), &config, 64);
    let group = |x: f32| grid(x, [4, 5], 0.1);
    let blocks: Vec<_> = group(0.2)
        .chain(group(0.85))
        .chain([Observation { confidence: 1.0, ..block([0.1, 0.0, 0.03]) }])
        .collect();
    let owners = |beliefs: Vec<Belief>| beliefs.iter().map(|belief| belief.owner).collect::<Vec<_>>();
    let see = |some: &[Observation]| [&[person(EYES, TABLE)], some].concat();
    // The first step collects the claims; each later step adds sixteen links.
    let whose = [[0; 20], [1; 20]].concat();
    for expected in [&[NOBODY; 40][..], &[NOBODY; 40], &[NOBODY; 40], &whose[..]] {
        world.step(&see(&blocks[..40]));
        assert_eq!(owners(world.robots()), expected);
        assert_eq!(owners(world.his()), expected);
    }
    // A thing arrives.
    let with = |owner: u16| [&whose[..], &[owner]].concat();
    for expected in [NOBODY, NOBODY, NOBODY, 0] {
        world.step(&see(&blocks));
        assert_eq!(owners(world.robots()), with(expected));
    }
    // The oldest thing goes before the update completes.
    while world.robots().len() > 40 {
        world.step(&see(&blocks[1..]));
    }
    for _ in 0..4 {
        assert_eq!(owners(world.robots()), with(0)[1..]);
        world.step(&see(&blocks[1..]));
    }
    // The tree is unchanged, but no other agent is known any more.
    world.run(Duration::from_secs(1), &blocks[1..]);
    assert_eq!(owners(world.robots()), [NOBODY; 40]);
}

#[test]
fn territories_of_many_objects_are_computed_within_eight_further_steps() {
    let mut config = Perspective::builtin();
    config.ownership = ownership(OwnershipRule::Territory);
    let mut world = Workspace::with_room(Percepts::builtin(), &config, 256);
    let group = |x: f32| grid(x, [12, 10], 0.05);
    let all: Vec<_> = [person(EYES, TABLE)].into_iter().chain(group(0.1)).chain(group(0.9)).collect();
    for _ in 0..8 {
        world.step(&all);
        assert!(world.robots().iter().all(|belief| belief.owner == NOBODY));
    }
    world.step(&all);
    let owners: Vec<_> = world.robots().iter().map(|belief| belief.owner).collect();
    assert_eq!(owners, [[0; 120], [1; 120]].concat());
}

#[test]
fn too_many_objects_have_no_owners() {
    let mut owners = OwnershipEstimator::new(&ownership(OwnershipRule::Territory), 2 * MAX_TERRITORY_BELIEFS);
    for (count, expected) in [(MAX_TERRITORY_BELIEFS, [0, 1]), (MAX_TERRITORY_BELIEFS + 1, [NOBODY; 2])] {
        let places: Vec<_> =
            (0..count).map(|index| if index < 128 { [0.2, 0.0] } else { [1.3, 0.0] }).collect();
        owners.update(claims(&places), agents([ROBOT, TEACHER]));
        assert_eq!([owners.owner(0), owners.owner(count - 1)], expected, "{count}");
    }
}

#[test]
fn an_object_without_a_position_prevents_territories() {
    let mut owners = OwnershipEstimator::new(&ownership(OwnershipRule::Territory), 64);
    let places = [[0.3, 0.0], [0.4, 0.0], [1.3, 0.0], [1.4, 0.0], [f64::NAN, 0.0]];
    owners.update(claims(&places[..4]), agents([ROBOT, TEACHER]));
    assert_eq!(owners.all(), [0, 0, 1, 1]);
    owners.update(claims(&places), agents([ROBOT, TEACHER]));
    assert_eq!(owners.all(), [NOBODY; 5]);
}

#[test]
fn a_cloned_ownership_estimator_gives_the_same_owners() {
    let places = [[0.3, 0.0], [0.4, 0.0], [1.3, 0.0], [1.4, 0.0], [1.4, 0.1]];
    let mut copy = OwnershipEstimator::new(&ownership(OwnershipRule::Territory), 4).clone();
    copy.update(claims(&places), agents([ROBOT, TEACHER]));
    assert_eq!(copy.all(), [0, 0, 1, 1], "the fifth is beyond the capacity");
    assert_eq!(copy.owner(4), NOBODY);
}

/// Reference: merges the two nearest clusters until two are left; `None` if less than a nanometre decides.
fn by_merging(places: &[Position<Base>], agents: &[(u16, Position<Base>)]) -> Option<Vec<u16>> {
    let shared = vec![NOBODY; places.len()];
    let mut clusters: Vec<Vec<usize>> = (0..places.len()).map(|index| vec![index]).collect();
    let nearest = |clusters: &[Vec<usize>]| {
        let apart = |a: &[usize], b: &[usize]| {
            let pairs = a.iter().flat_map(|one| b.iter().map(|other| places[*one].distance(&places[*other])));
            pairs.fold(f64::INFINITY, f64::min)
        };
        let pairs = (0..clusters.len()).flat_map(|one| (0..one).map(move |other| (one, other)));
        let apart = pairs.map(|(one, other)| (apart(&clusters[one], &clusters[other]), one, other));
        apart.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut widest = 0.0_f64;
    while clusters.len() > 2 {
        let (length, one, other) = nearest(&clusters)?;
        widest = widest.max(length);
        let merged = clusters.remove(one);
        clusters[other].extend(merged);
    }
    let Some((gap, ..)) = nearest(&clusters) else { return Some(shared) };
    if (gap - 1.5 * widest).abs() < 1e-9 || (gap - widest).abs() < 1e-9 {
        return None;
    }
    if gap < 1.5 * widest || clusters.iter().any(|cluster| cluster.len() < 2) {
        return Some(shared);
    }
    let mut whose = Vec::new();
    for cluster in &clusters {
        let count = f64::from(u8::try_from(cluster.len()).unwrap());
        let sum = cluster.iter().fold([0.0; 2], |[x, y], index| {
            let [dx, dy, _] = places[*index].to_array();
            [x + dx, y + dy]
        });
        let away = |(agent, place): &(u16, Position<Base>)| {
            let [x, y, _] = place.to_array();
            ((x - sum[0] / count).hypot(y - sum[1] / count), *agent)
        };
        let mut away: Vec<_> = agents.iter().map(away).collect();
        away.sort_by(|a, b| a.0.total_cmp(&b.0));
        if away[1].0 - away[0].0 < 1e-9 {
            return None;
        }
        whose.push(away[0].1);
    }
    if whose[0] == whose[1] {
        return Some(shared);
    }
    let mut owners = shared;
    for (cluster, agent) in clusters.iter().zip(whose) {
        for index in cluster {
            owners[*index] = agent;
        }
    }
    Some(owners)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, rng_seed: RngSeed::Fixed(28), ..ProptestConfig::default() })]

    #[test]
    fn territories_are_those_of_single_linkage_in_every_frame_and_every_order(
        near in prop::collection::vec((-0.15..0.15_f64, -0.3..0.3_f64, 0.0..0.2_f64), 0..8),
        far in prop::collection::vec((-0.15..0.15_f64, -0.3..0.3_f64, 0.0..0.2_f64), 0..8),
        apart in (0.1..0.6_f64, 0.6..1.4_f64),
        third in prop::option::of((-1.0..2.0_f64, -1.0..1.0_f64)),
        by in (-3.0..3.0_f64, -3.0..3.0_f64, -3.0..3.0_f64),
        turn in any::<prop::sample::Index>(),
    ) {
        let at = |x: f64, (dx, y, z): &(f64, f64, f64)| Position::<Base>::new(x + dx, *y, *z);
        let places: Vec<_> =
            near.iter().map(|thing| at(apart.0, thing)).chain(far.iter().map(|thing| at(apart.1, thing))).collect();
        let mut known = vec![(0, Position::new(0.0, 0.0, 0.6)), (1, Position::new(1.5, 0.0, 0.55))];
        known.extend(third.map(|(x, y)| (2, Position::new(x, y, 0.5))));
        let claims = |places: &[Position<Base>]| -> Vec<OwnershipClaim> {
            (1..).zip(places).map(|(id, place)| OwnershipClaim { id, place: *place, held_by: NOBODY }).collect()
        };
        let mut owners = OwnershipEstimator::new(&ownership(OwnershipRule::Territory), 16);
        owners.update(claims(&places), known.iter().copied());
        let here = owners.all().to_vec();
        let Some(expected) = by_merging(&places, &known) else { return Ok(()) };
        prop_assert_eq!(&here, &expected);

        let x_there_here = Pose::<Base, Base>::upright(by.0, by.1, 0.3, by.2);
        let mut moved: Vec<_> = places.iter().map(|place| x_there_here * *place).collect();
        let known: Vec<_> = known.iter().map(|(agent, place)| (*agent, x_there_here * *place)).collect();
        let by = if moved.is_empty() { 0 } else { turn.index(moved.len()) };
        moved.rotate_left(by);
        owners.update(claims(&moved), known);
        let mut there = owners.all().to_vec();
        there.rotate_right(by);
        prop_assert_eq!(here, there);
    }

    /// An estimator with history compares all pairs only after a large motion. It must agree with a new one.
    #[test]
    fn territories_follow_objects_over_any_distance(
        places in prop::collection::vec((-0.15..0.15_f64, -0.3..0.3_f64), 2..8),
        apart in (0.1..0.6_f64, 0.6..1.4_f64),
        steps in prop::collection::vec((
            prop_oneof![Just(0.001), Just(0.01), Just(0.05), Just(0.3)],
            prop::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64), 8),
            prop_oneof![9 => Just(None), 1 => any::<prop::sample::Index>().prop_map(Some)],
        ), 1..12),
    ) {
        let mut things: Vec<_> = (1_u64..).zip(&places).map(|(id, (dx, y))| {
            let x = if id.is_multiple_of(2) { apart.0 } else { apart.1 };
            (id, [x + dx, *y])
        }).collect();
        let mut owners = OwnershipEstimator::new(&ownership(OwnershipRule::Territory), 16);
        for (by_m, ways, gone) in steps {
            for ((_, [x, y]), (dx, dy)) in things.iter_mut().zip(ways) {
                (*x, *y) = (*x + by_m * dx, *y + by_m * dy);
            }
            if let Some(gone) = gone.filter(|_| things.len() > 2) {
                // The thing returns under a new identity.
                let (_, place) = things.remove(gone.index(things.len()));
                let id = things.iter().map(|(id, _)| id + 1).max().unwrap_or(1);
                things.push((id, place));
            }
            let claims = || things.iter().map(|(id, [x, y])| {
                OwnershipClaim { id: *id, place: Position::new(*x, *y, 0.03), held_by: NOBODY }
            });
            owners.update(claims(), agents([ROBOT, TEACHER]));
            let mut stranger = OwnershipEstimator::new(&ownership(OwnershipRule::Territory), 16);
            stranger.update(claims(), agents([ROBOT, TEACHER]));
            prop_assert_eq!(owners.all(), stranger.all());
        }
    }
}
