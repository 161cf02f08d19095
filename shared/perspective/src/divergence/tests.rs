use std::collections::BTreeSet;
use std::sync::LazyLock;

use belief::percepts::{Component, Kernel, Percept, Percepts, Range};
use geometry::{Base, Person, Pose, Position};
use message::{Aspect, Belief, BeliefHead, Difference, Feature, Header, NOBODY, Remembered};
use proptest::prelude::*;
use quantity::number::single;

use super::{Divergence, PerspectiveBeliefs};

const CAPACITY: usize = 32;
/// Length of a test tick; three ticks exceed `MOMENT`.
const TICK_NS: u64 = 200_000_000;
static PERCEPTS: LazyLock<Percepts> = LazyLock::new(Percepts::builtin);

/// A thing of a test: position in the base frame, appearance, and its ticks.
#[derive(Clone, Copy, Debug)]
struct Known {
    place_m: [f64; 3],
    colour: u16,
    on: f32,
    born_at: u64,
    perceived_at: u64,
}

/// A perspective of a test.
#[derive(Clone, Debug)]
struct Mind {
    head: BeliefHead,
    beliefs: Vec<Belief>,
}

impl Mind {
    /// Creates beliefs numbered from `first_id`, in their own frame.
    fn new(at: u64, x_base_person: &Pose<Base, Person>, first_id: u64, things: &[Known]) -> Self {
        let mut head = BeliefHead::of(1, Header::at(at * TICK_NS));
        head.frame_position_m = x_base_person.position_m();
        head.frame_orientation_xyzw = x_base_person.orientation_xyzw();
        let beliefs = (first_id..).zip(things).map(|(id, thing)| thing.believed(id, x_base_person));
        Self { head, beliefs: beliefs.collect() }
    }

    fn side(&self) -> PerspectiveBeliefs<'_> {
        PerspectiveBeliefs { head: &self.head, beliefs: &self.beliefs }
    }
}

impl Known {
    fn believed(&self, id: u64, x_base_person: &Pose<Base, Person>) -> Belief {
        let [x, y, z] = self.place_m;
        let place = (x_base_person.inverse() * Position::new(x, y, z)).to_array();
        let mut belief = Belief::new(id, self.born_at * TICK_NS, self.perceived_at * TICK_NS, 9, NOBODY);
        for (percept, feature) in [
            ("position", Feature::Vector(place.map(single))),
            ("shape", Feature::Symbol(0)),
            ("colour", Feature::Symbol(self.colour)),
            ("on", Feature::Number(self.on)),
            // Indexical: differs between the perspectives.
            ("left", Feature::Number(if place[1] > 0.0 { 1.0 } else { 0.0 })),
        ] {
            let number = PERCEPTS.index(percept).unwrap();
            assert!(belief.push(Remembered::new(number, self.perceived_at * TICK_NS, 1.0, 1.0, feature)));
        }
        belief
    }
}

fn red(place_m: [f64; 3], born_at: u64, perceived_at: u64) -> Known {
    Known { place_m, colour: 0, on: 0.0, born_at, perceived_at }
}

/// The robot's frame and that of a partner opposite.
fn frames() -> (Pose<Base, Person>, Pose<Base, Person>) {
    (Pose::identity(), Pose::upright(1.5, 0.0, 0.0, std::f64::consts::PI))
}

/// Compares the robot's beliefs, numbered from 1, with those of a partner opposite, from 101.
fn compare(divergence: &mut Divergence, at: u64, robots: &[Known], his: &[Known]) -> Vec<Difference> {
    let (base, opposite) = frames();
    let (robot, partner) = (Mind::new(at, &base, 1, robots), Mind::new(at, &opposite, 101, his));
    divergence.compare(robot.side(), partner.side()).to_vec()
}

fn new() -> Divergence {
    Divergence::new(&PERCEPTS, CAPACITY)
}

/// The differing beliefs and their percepts.
fn told(differences: &[Difference]) -> Vec<(Option<u64>, Option<u64>, Vec<u16>)> {
    let about = |difference: &Difference| difference.aspects().iter().map(|aspect| aspect.percept).collect();
    differences.iter().map(|difference| (difference.one(), difference.other(), about(difference))).collect()
}

fn position() -> u16 {
    PERCEPTS.index("position").unwrap()
}

prop_compose! {
    fn known()(
        place_m in prop::array::uniform3(-0.6..0.6_f64),
        colour in 0..2_u16,
        on in prop::sample::select(vec![0.0, 1.0_f32]),
        born_at in 1..20_u64,
        lasts in 0..3_u64,
    ) -> Known {
        Known { place_m, colour, on, born_at, perceived_at: born_at + lasts }
    }
}

prop_compose! {
    fn pose()(
        position in prop::array::uniform3(-3.0..3.0_f64),
        angles in prop::array::uniform3(-3.0..3.0_f64),
    ) -> Pose<Base, Person> {
        let [x, y, z] = position;
        let [roll, pitch, yaw] = angles;
        let rotation = nalgebra::UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        Pose::from_isometry(nalgebra::Isometry3::from_parts(nalgebra::Translation3::new(x, y, z), rotation))
    }
}

fn minds() -> impl Strategy<Value = (Vec<Known>, Vec<Known>)> {
    // Both know some of the things, perhaps at another place and in another state.
    let both = prop::collection::vec((known(), -0.2..0.2_f64, any::<bool>()), 0..12);
    (both, prop::collection::vec(known(), 0..5), prop::collection::vec(known(), 0..5)).prop_map(
        |(both, mut robots, mut his)| {
            for (thing, aside, on) in both {
                let [x, y, z] = thing.place_m;
                robots.push(thing);
                his.push(Known { place_m: [x + aside, y, z], on: if on { 1.0 } else { 0.0 }, ..thing });
            }
            (robots, his)
        },
    )
}

/// Reference implementation: all pairs of both rules, the closest first.
fn paired_plainly(began_at: u64, robots: &[Known], his: &[Known]) -> BTreeSet<(u64, u64)> {
    let far = |one: &Known, other: &Known| {
        let squares = one.place_m.iter().zip(&other.place_m).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let mut pairs = BTreeSet::new();
    for by_observation in [true, false] {
        let mut candidates = Vec::new();
        for (i, one) in (1..).zip(robots) {
            for (j, other) in (101..).zip(his) {
                let alike = one.colour == other.colour;
                let may = if by_observation {
                    one.perceived_at == other.perceived_at && far(one, other) < 0.15
                } else {
                    one.born_at > other.perceived_at
                        || other.born_at > one.perceived_at
                        || (one.perceived_at.abs_diff(other.perceived_at) <= 2 && far(one, other) < 0.15)
                        || (one.born_at < began_at && other.born_at < began_at)
                };
                if alike && may {
                    candidates.push((far(one, other), i, j));
                }
            }
        }
        candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, i, j) in candidates {
            if pairs.iter().all(|(one, other)| *one != i && *other != j) {
                pairs.insert((i, j));
            }
        }
    }
    pairs
}

proptest! {
    #[test]
    fn pairing_equals_a_greedy_search_over_all_sorted_pairs((robots, his) in minds(), began in 1..20_u64) {
        let mut divergence = new();
        let _ = compare(&mut divergence, began, &robots, &his);
        let pairs: BTreeSet<_> = divergence.pairs.iter().copied().collect();
        prop_assert_eq!(pairs, paired_plainly(began, &robots, &his));
    }

    #[test]
    fn a_belief_lacking_on_one_side_is_extra_on_the_other(
        instants in prop::collection::vec(minds(), 1..4),
    ) {
        let (mut there, mut back) = (new(), new());
        let (base, opposite) = frames();
        for (at, (robots, his)) in (10..).zip(&instants) {
            let (robot, partner) = (Mind::new(at, &base, 1, robots), Mind::new(at, &opposite, 1, his));
            let there = there.compare(robot.side(), partner.side());
            let back = back.compare(partner.side(), robot.side());
            let mut mirrored: Vec<_> = back
                .iter()
                .map(|difference| {
                    let mut mirrored = Difference::new(difference.other(), difference.one());
                    for aspect in difference.aspects() {
                        let (one, other) = (aspect.other(), aspect.one());
                        assert!(mirrored.push(Aspect::new(aspect.percept, one, other, aspect.distance())));
                    }
                    mirrored
                })
                .collect();
            mirrored.sort_by_key(|difference| (difference.one().is_none(), difference.one(), difference.other()));
            prop_assert_eq!(there, mirrored.as_slice());
        }
    }

    #[test]
    fn equal_beliefs_have_no_divergence(
        columns in prop::collection::btree_set((0..6_u8, 0..6_u8), 0..12),
        looks in prop::collection::vec(known(), 12),
        his in pose(),
    ) {
        // Spaced by 20 cm: things that are closer may be confused.
        let things: Vec<Known> = columns
            .iter()
            .zip(looks)
            .map(|((x, y), look)| Known { place_m: [f64::from(*x) * 0.2, f64::from(*y) * 0.2, 0.03], ..look })
            .collect();
        let mut divergence = new();
        let robot = Mind::new(30, &Pose::identity(), 1, &things);
        let backwards: Vec<Known> = things.iter().rev().copied().collect();
        let partner = Mind::new(30, &his, 7, &backwards);
        prop_assert_eq!(divergence.compare(robot.side(), partner.side()), &[]);
        prop_assert_eq!(divergence.agreed(), things.len());
    }

    #[test]
    fn divergence_is_independent_of_the_base_and_the_frames(
        instants in prop::collection::vec(minds(), 1..3),
        base in pose(),
        his in pose(),
    ) {
        let (mut here, mut there) = (new(), new());
        for (at, (robots, partners)) in (10..).zip(&instants) {
            let expected = compare(&mut here, at, robots, partners);
            let robot = Mind::new(at, &base, 1, robots);
            let partner = Mind::new(at, &his, 101, partners);
            let found = there.compare(robot.side(), partner.side());
            prop_assert_eq!(told(found), told(&expected));
            for (found, expected) in found.iter().zip(&expected) {
                for (found, expected) in found.aspects().iter().zip(expected.aspects()) {
                    let near = found.distance().zip(expected.distance()).is_none_or(|(a, b)| (a - b).abs() < 1e-5);
                    prop_assert!(near, "{found:?} {expected:?}");
                }
            }
        }
    }
}

#[test]
fn an_unseen_move_is_one_object_at_two_places() {
    let mut divergence = new();
    let there = [0.6, 0.0, 0.03];
    let here = [0.6, 0.3, 0.03];
    assert_eq!(compare(&mut divergence, 5, &[red(there, 5, 5)], &[red(there, 5, 5)]), []);
    let differences = compare(&mut divergence, 9, &[red(here, 5, 9)], &[red(there, 5, 5)]);
    assert_eq!(told(&differences), [(Some(1), Some(101), vec![position()])]);
    let [aspect] = differences[0].aspects() else { panic!("{differences:?}") };
    assert!(aspect.distance().is_some_and(|distance| (distance - 0.3).abs() < 1e-6));
    assert_eq!(aspect.one(), Some(Feature::Vector(here.map(single))));
    let Some(Feature::Vector([x, y, _])) = aspect.other() else { panic!("{aspect:?}") };
    assert!((x - 0.6).abs() < 1e-6 && y.abs() < 1e-6, "not in the base frame: {aspect:?}");
    // The partner looks again: they get a new belief and still keep the old one.
    let his = [red(there, 5, 5), red(here, 12, 12)];
    let differences = compare(&mut divergence, 12, &[red(here, 5, 12)], &his);
    assert_eq!(told(&differences), [(None, Some(101), vec![])]);
    assert_eq!(divergence.agreed(), 1);
}

#[test]
fn two_alike_objects_swapped_unseen_are_not_confused() {
    let mut divergence = new();
    let (a, b) = ([0.6, 0.0, 0.03], [0.6, 0.3, 0.03]);
    let first = [red(a, 5, 5), red(b, 5, 5)];
    assert_eq!(compare(&mut divergence, 5, &first, &first), []);
    let differences = compare(&mut divergence, 9, &[red(b, 5, 9), red(a, 5, 9)], &first);
    assert_eq!(
        told(&differences),
        [(Some(1), Some(101), vec![position()]), (Some(2), Some(102), vec![position()])]
    );
}

#[test]
fn a_restarted_belief_is_paired_by_similarity() {
    let mut divergence = new();
    let (a, hidden, c) = ([0.6, 0.0, 0.03], [0.3, 0.4, 0.03], [0.6, 0.5, 0.03]);
    let robots = [red(a, 5, 5), red(hidden, 5, 5)];
    assert_eq!(told(&compare(&mut divergence, 5, &robots, &[red(a, 5, 5)])), [(Some(2), None, vec![])]);
    // The robot lost the first thing and found a similar one elsewhere.
    let (base, opposite) = frames();
    let mut robot = Mind::new(20, &base, 2, &[red(hidden, 5, 20), red(c, 14, 20)]);
    let partner = Mind::new(20, &opposite, 101, &[red(a, 5, 5)]);
    let differences = divergence.compare(robot.side(), partner.side());
    assert_eq!(told(differences), [(Some(2), None, vec![]), (Some(3), Some(101), vec![position()])]);
    // Without it, the partner believes in a thing that is gone.
    robot.beliefs.truncate(1);
    let differences = divergence.compare(robot.side(), partner.side());
    assert_eq!(told(differences), [(Some(2), None, vec![]), (None, Some(101), vec![])]);
}

#[test]
fn a_touched_object_is_one_with_its_earlier_sighting() {
    let place = [0.6, 0.0, 0.03];
    let aside = [0.6, 0.3, 0.03];
    for (his, moments_before, is_one) in [(place, 2, true), (place, 3, false), (aside, 1, false)] {
        let mut divergence = new();
        let _ = compare(&mut divergence, 3, &[red(place, 2, 3)], &[]);
        for now in [10, 11, 12] {
            // The partner's belief began later; the robot holds the thing and perceives it more often.
            let differences =
                compare(&mut divergence, now, &[red(place, 2, now)], &[red(his, 7, now - moments_before)]);
            let two = [(Some(1), None, vec![]), (None, Some(101), vec![])];
            assert_eq!(told(&differences), if is_one { &[][..] } else { &two }, "{his:?} {now}");
        }
    }
}

#[test]
fn a_percept_known_to_one_side_only_is_a_difference() {
    let on = PERCEPTS.index("on").unwrap();
    let thing = red([0.6, 0.0, 0.03], 5, 5);
    let (base, opposite) = frames();
    let robot = Mind::new(5, &base, 1, &[thing]);
    let mut partner = Mind::new(5, &opposite, 101, &[thing]);
    let mut without = Belief::new(101, 5 * TICK_NS, 5 * TICK_NS, 9, NOBODY);
    for remembered in partner.beliefs[0].percepts().iter().filter(|remembered| remembered.percept != on) {
        assert!(without.push(*remembered));
    }
    partner.beliefs[0] = without;
    let mut divergence = new();
    let [difference] = divergence.compare(robot.side(), partner.side()) else { panic!("nothing differs") };
    let [aspect] = difference.aspects() else { panic!("{difference:?}") };
    let expected = (on, Some(Feature::Number(0.0)), None, None);
    assert_eq!((aspect.percept, aspect.one(), aspect.other(), aspect.distance()), expected);
}

#[test]
fn a_head_with_a_false_frame_is_harmless() {
    let thing = red([0.6, 0.0, 0.03], 5, 5);
    let mut robot = Mind::new(5, &Pose::identity(), 1, &[thing]);
    let lying = robot.clone();
    robot.head.frame_position_m = [f64::NAN; 3];
    let mut divergence = new();
    // Beliefs without a valid position pair with none.
    let differences = divergence.compare(robot.side(), lying.side());
    assert_eq!(told(differences), [(Some(1), None, vec![]), (None, Some(1), vec![])]);
}

#[test]
fn a_pile_of_similar_objects_is_paired_over_several_steps() {
    // All at one place and alike: every pair is equally close.
    let pile: Vec<Known> = (0..200).map(|_| red([0.6, 0.0, 0.03], 5, 5)).collect();
    let mut divergence = Divergence::new(&PERCEPTS, pile.len());
    let mut agreed = vec![];
    while agreed.last() != Some(&pile.len()) {
        let before = agreed.last().copied().unwrap_or(0);
        let _ = compare(&mut divergence, 5, &pile, &pile);
        assert!(divergence.agreed() > before, "{agreed:?}");
        agreed.push(divergence.agreed());
    }
    // The budget per instant bounds the step time.
    assert!(agreed.len() > 1, "{agreed:?}");
}

#[test]
fn absolute_percepts_are_compared_and_viewer_dependent_ones_are_not() {
    let mut percepts = Percepts::builtin();
    let state = percepts.percepts[8].clone();
    percepts.percepts.truncate(6);
    let range = |of| Kernel::Range(Range { component: of, from: None, to: Some(0.5), softness: None });
    for (name, parent, kernel) in [
        ("near", "position", range(Component::DistanceM)),
        ("short", "extents", range(Component::LongestM)),
        ("very short", "short", range(Component::Number)),
        ("very near", "near", range(Component::Number)),
        ("not near", "very near", range(Component::Number)),
    ] {
        let parent = percepts.index(parent);
        percepts.percepts.push(Percept { name: name.to_owned(), parent, kernel, ..state.clone() });
    }
    let believes = |id, degree| {
        let mut belief = Belief::new(id, 1, 9, 9, NOBODY);
        assert!(belief.push(Remembered::new(0, 9, 1.0, 1.0, Feature::Vector([0.0; 3]))));
        for number in 6..11 {
            assert!(belief.push(Remembered::new(number, 9, 1.0, 1.0, Feature::Number(degree))));
        }
        let mut head = BeliefHead::of(1, Header::at(9));
        head.frame_orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
        Mind { head, beliefs: vec![belief] }
    };
    let (one, other) = (believes(1, 1.0), believes(101, 0.0));
    let mut divergence = Divergence::new(&percepts, CAPACITY);
    let told = told(divergence.compare(one.side(), other.side()));
    assert_eq!(told, [(Some(1), Some(101), vec![7, 8])]);
}
