use std::path::Path;

use message::State;
use proptest::prelude::*;

use super::*;

const ROBOT: Frame = Frame { agent: 0 };

fn percepts(text: &str) -> Percepts {
    let belief = "[belief]\nthreshold = 0.1\nnormalised = false\ncannot_link_same_source_instant = true\n\
                  no_term_applies = \"zero\"\n";
    Percepts::parse(&format!("threshold = 0.5\n{text}{belief}"), Path::new("test.toml")).unwrap()
}

fn percept(name: &str, rest: &str) -> String {
    format!(
        "[[percept]]\nname = \"{name}\"\nrole = \"neither\"\ndecay_per_s = 0.0\n\
         history = {{ lossless = {{ samples = 4, when_full = \"forget_oldest\" }} }}\n{rest}\n"
    )
}

fn cube() -> Observation {
    Observation { half_extents_m: [0.03; 3], ..Observation::object(1, 5) }
}

struct Always(Evaluation);

impl Classify for Always {
    fn classify(&self, _observation: &Observation, _frame: &Frame) -> Evaluation {
        self.0
    }
}

fn with_own(evaluation: Evaluation) -> Perception {
    let own: Own = vec![("mine".to_owned(), Arc::new(Always(evaluation)))];
    Perception::with_own(&percepts(&percept("p", "kernel = { own = \"mine\" }")), &own).unwrap()
}

#[test]
fn match_times_confidence_equal_to_the_threshold_does_not_pass() {
    let half = Evaluation { matching: 1.0, confidence: 0.5, feature: Feature::None };
    assert!(with_own(half).perceive(&cube(), &ROBOT).values().is_empty());
    let more = Evaluation { confidence: 0.501, ..half };
    assert_eq!(with_own(more).perceive(&cube(), &ROBOT).values().len(), 1);
}

#[test]
fn an_own_percept_that_lies_matches_nothing() {
    let sure = Evaluation::certain(Feature::None);
    for lie in [
        Evaluation { matching: f32::NAN, ..sure },
        Evaluation { matching: 1.5, ..sure },
        Evaluation { confidence: -1.0, matching: -1.0, ..sure },
        Evaluation { feature: Feature::Number(f32::NAN), ..sure },
        Evaluation { feature: Feature::Vector([f32::INFINITY, 0.0, 0.0]), ..sure },
    ] {
        assert!(with_own(lie).perceive(&cube(), &ROBOT).values().is_empty(), "{lie:?}");
    }
}

#[test]
fn an_own_percept_that_the_program_lacks_is_named() {
    let refused = Perception::new(&percepts(&percept("p", "kernel = { own = \"mine\" }"))).err().unwrap();
    assert!(refused.to_string().contains("`mine`"), "{refused}");
}

#[test]
fn a_child_is_evaluated_only_where_its_parent_passed() {
    let text = percept("filled", "kernel = { state = \"filled\" }")
        + &percept("place", "parent = \"filled\"\nkernel = \"position\"");
    let perception = Perception::new(&percepts(&text)).unwrap();
    assert!(perception.perceive(&cube(), &ROBOT).values().is_empty());
    let mut block = cube();
    block.set_state(State::Filled, 0.0);
    assert_eq!(perception.perceive(&block, &ROBOT).values().len(), 2);
}

#[test]
fn an_empty_hole_is_perceived_and_a_hole_that_does_not_exist_is_not() {
    let percepts = Percepts::builtin();
    let filled = percepts.index("filled").unwrap();
    let perception = Perception::new(&percepts).unwrap();
    assert_eq!(perception.perceive(&cube(), &ROBOT).value(filled), None);
    let mut block = cube();
    block.set_state(State::Filled, 0.0);
    let value = *perception.perceive(&block, &ROBOT).value(filled).unwrap();
    assert_eq!(value.feature(), Some(Feature::Number(0.0)));
}

#[test]
fn an_unsound_observation_is_not_perceived() {
    let perception = Perception::new(&Percepts::builtin()).unwrap();
    let broken = Observation { position_m: [f32::NAN; 3], ..cube() };
    assert!(perception.perceive(&broken, &ROBOT).values().is_empty());
    assert!(!perception.perceive(&cube(), &ROBOT).values().is_empty());
}

#[test]
fn a_region_speaks_of_the_frame_the_observation_is_in() {
    let percepts = Percepts::builtin();
    let left = percepts.index("left").unwrap();
    let perception = Perception::new(&percepts).unwrap();
    let degree = |y| {
        let seen = Observation { position_m: [0.5, y, 0.0], ..cube() };
        perception.perceive(&seen, &ROBOT).value(left).unwrap().feature()
    };
    assert_eq!(degree(0.2), Some(Feature::Number(1.0)));
    assert_eq!(degree(-0.2), Some(Feature::Number(0.0)));
}

#[test]
fn every_prototype_is_its_own_symbol_at_every_confidence_above_the_threshold() {
    let percepts = Percepts::builtin();
    let perception = Perception::new(&percepts).unwrap();
    let mut seen = 0;
    for (number, percept) in (0..).zip(&percepts.percepts) {
        let config::percepts::Kernel::Nearest(nearest) = &percept.kernel else { continue };
        for (symbol, prototype) in (0..).zip(&nearest.prototypes) {
            let mut thing = Observation { confidence: 0.51, ..cube() };
            let at: Vec<f32> = prototype.at.iter().map(|part| single(*part)).collect();
            match nearest.of {
                config::percepts::Space::Shape => thing.shape = at.try_into().unwrap(),
                config::percepts::Space::Colour => thing.colour_rgb = at.try_into().unwrap(),
                config::percepts::Space::EdgeM => thing.half_extents_m = [at[0] / 2.0; 3],
            }
            let value = *perception.perceive(&thing, &ROBOT).value(number).unwrap();
            assert_eq!(value.feature(), Some(Feature::Symbol(symbol)), "{}", prototype.name);
            seen += 1;
        }
    }
    assert_eq!(seen, 18);
}

fn single(value: f64) -> f32 {
    quantity::number::single(value)
}

proptest! {
    #[test]
    fn whatever_passes_is_above_the_threshold_and_in_order(
        confidence in 0.0..=1.0_f32,
        colour in prop::array::uniform3(0.0..=1.0_f32),
        shape in prop::array::uniform4(0.0..=1.0_f32),
        half in prop::array::uniform3(0.0..=0.2_f32),
    ) {
        let perception = Perception::new(&Percepts::builtin()).unwrap();
        let thing = Observation { confidence, colour_rgb: colour, shape, half_extents_m: half, ..cube() };
        let snapshot = perception.perceive(&thing, &ROBOT);
        let numbers: Vec<_> = snapshot.values().iter().map(|value| value.percept).collect();
        prop_assert!(numbers.is_sorted_by(|a, b| a < b));
        for value in snapshot.values() {
            prop_assert!(f64::from(value.matching) * f64::from(value.confidence) > 0.5);
            prop_assert!(value.confidence <= confidence && value.matching <= 1.0);
        }
    }
}

/// The program's own: how sure, and what of, depends on the frame and the place.
struct Near;

impl Classify for Near {
    fn classify(&self, observation: &Observation, frame: &Frame) -> Evaluation {
        let [x, y, _] = observation.position_m;
        let degree = (1.0 - x.hypot(y) / 2.0).clamp(0.0, 1.0);
        Evaluation { confidence: degree, ..Evaluation::certain(Feature::Number(f32::from(frame.agent))) }
    }
}

const KERNELS: [&str; 9] = [
    "\"position\"",
    "\"orientation\"",
    "\"extents\"",
    "{ state = \"filled\" }",
    "{ region = { minimum_m = [0.0, -1.0, -1.0], maximum_m = [1.0, 1.0, 1.0] } }",
    "{ own = \"near\" }",
    "{ nearest = { of = \"edge_m\", scale = 0.1, prototypes = [{ name = \"a\", at = [0.03] }, { name = \"b\", at = [0.1] }] } }",
    "{ nearest = { of = \"colour\", scale = 1.0, prototypes = [{ name = \"a\", at = [0.8, 0.0, 0.0] }, { name = \"b\", at = [0.0, 0.0, 0.8] }] } }",
    "{ nearest = { of = \"shape\", scale = 1.0, prototypes = [{ name = \"a\", at = [0.0, 0.0, 0.0, 0.0] }] } }",
];

/// A random set of percepts, each with any kernel and any earlier percept, or none, for a parent.
fn tree() -> impl Strategy<Value = Percepts> {
    prop::collection::vec((0..KERNELS.len(), any::<prop::sample::Index>()), 1..=12).prop_map(|nodes| {
        let text: String = (0..nodes.len())
            .zip(&nodes)
            .map(|(number, (kernel, parent))| {
                let parent = parent.index(number + 1);
                let parent =
                    if parent < number { format!("parent = \"p{parent}\"\n") } else { String::new() };
                percept(&format!("p{number}"), &format!("{parent}kernel = {}", KERNELS[*kernel]))
            })
            .collect();
        percepts(&text)
    })
}

fn perceiving(percepts: &Percepts) -> Perception {
    Perception::with_own(percepts, &vec![("near".to_owned(), Arc::new(Near))]).unwrap()
}

fn thing() -> impl Strategy<Value = Observation> {
    let states = prop_oneof![Just(f32::NAN), 0.0..=1.0_f32];
    (
        prop::array::uniform3(-2.0..2.0_f32),
        prop::array::uniform3(0.0..0.1_f32),
        prop::array::uniform3(0.0..=1.0_f32),
        prop::array::uniform4(0.0..=1.0_f32),
        states,
        0.4..=1.0_f32,
    )
        .prop_map(|(position_m, half_extents_m, colour_rgb, shape, filled, confidence)| {
            let mut thing =
                Observation { position_m, half_extents_m, colour_rgb, shape, confidence, ..cube() };
            thing.set_state(State::Filled, filled);
            thing
        })
}

fn nonsense() -> impl Strategy<Value = Snapshot> {
    let bits = || any::<u32>().prop_map(f32::from_bits);
    let value = (0..16_u16, prop_oneof![bits(), 0.0..=1.0_f32], prop_oneof![bits(), 0.0..=1.0_f32], bits());
    prop::collection::vec(value, 0..=12).prop_map(|values| {
        let mut snapshot = Snapshot::default();
        for (percept, matching, confidence, number) in values {
            assert!(snapshot.push(PerceptValue::new(percept, matching, confidence, Feature::Number(number))));
        }
        snapshot
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn what_is_perceived_again_is_what_is_perceived(
        tree in tree(), mine in thing(), his_m in prop::array::uniform3(-2.0..2.0_f32), agent in 0..3_u16,
    ) {
        let perception = perceiving(&tree);
        let known = perception.perceive(&mine, &ROBOT);
        let his = Observation { position_m: his_m, orientation_xyzw: [0.6, 0.0, 0.0, 0.8], ..mine };
        let frame = Frame { agent };
        prop_assert_eq!(perception.perceive_again(&his, &known, &frame), perception.perceive(&his, &frame));
    }

    #[test]
    fn nonsense_that_is_perceived_again_comes_out_a_snapshot_in_order(
        tree in tree(), his in thing(), known in nonsense(),
    ) {
        let perception = perceiving(&tree);
        let snapshot = perception.perceive_again(&his, &known, &ROBOT);
        let honest = perception.perceive(&his, &ROBOT);
        prop_assert!(snapshot.values().is_sorted_by(|a, b| a.percept < b.percept));
        for value in snapshot.values() {
            prop_assert!(f64::from(value.matching) * f64::from(value.confidence) > 0.5);
            prop_assert!(value.matching <= 1.0 && value.confidence <= 1.0 && value.feature().is_some());
            let percept = &perception.percepts[usize::from(value.percept)];
            // What sees the frame is evaluated anew, whatever is alleged.
            if percept.is_indexical && percept.parent.is_none() {
                prop_assert_eq!(honest.value(value.percept), Some(value));
            }
            prop_assert!(percept.parent.is_none_or(|parent| snapshot.value(parent).is_some()));
        }
    }
}

#[test]
fn what_does_not_see_the_frame_is_taken_over_and_not_evaluated() {
    let perception = Perception::new(&percepts(&percept("extents", "kernel = \"extents\""))).unwrap();
    let mut known = Snapshot::default();
    let alleged = PerceptValue::new(0, 1.0, 0.75, Feature::Vector([9.0; 3]));
    assert!(known.push(alleged));
    assert_eq!(perception.perceive_again(&cube(), &known, &ROBOT).values(), [alleged]);
    assert!(perception.perceive_again(&cube(), &Snapshot::default(), &ROBOT).values().is_empty());
}
