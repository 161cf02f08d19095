use std::path::Path;

use message::{State, UNOBSERVED};
use proptest::prelude::*;
use serde::Deserialize;

use super::percepts::Definition;
use super::*;

const ROBOT: Frame = Frame { agent: 0 };

const BUILTIN: &str = include_str!("../percepts.toml");

/// The part of `percepts.toml` that the Perception System reads.
#[derive(Deserialize)]
struct File {
    threshold: f64,
    percept: Vec<RawPercept>,
}

#[derive(Deserialize)]
struct RawPercept {
    name: String,
    parent: Option<String>,
    kernel: percepts::Kernel,
}

#[derive(Clone, Debug)]
struct Percepts {
    threshold: f64,
    percepts: Vec<(String, Option<u16>, percepts::Kernel)>,
}

impl Percepts {
    fn parse(text: &str) -> Self {
        let file: File = settings::parse(text, Path::new("test.toml")).unwrap();
        let mut percepts = Self { threshold: file.threshold, percepts: Vec::new() };
        for RawPercept { name, parent, kernel } in file.percept {
            let parent = parent.map(|parent| percepts.index(&parent).unwrap());
            let above = parent.map(|parent| &percepts.percepts[usize::from(parent)]);
            kernel.check(above.map(|(name, _, kernel)| (name.as_str(), kernel))).unwrap();
            percepts.percepts.push((name, parent, kernel));
        }
        percepts
    }

    fn builtin() -> Self {
        Self::parse(BUILTIN)
    }

    fn index(&self, name: &str) -> Option<u16> {
        self.percepts.iter().position(|(known, ..)| known == name)?.try_into().ok()
    }
}

impl<'a> From<&'a Percepts> for PerceptSet<'a> {
    fn from(percepts: &'a Percepts) -> Self {
        let define =
            |(name, parent, kernel): &'a (String, _, _)| Definition { name, parent: *parent, kernel };
        Self { threshold: percepts.threshold, percepts: percepts.percepts.iter().map(define).collect() }
    }
}

fn percepts(text: &str) -> Percepts {
    Percepts::parse(&format!("threshold = 0.5\n{text}"))
}

fn percept(name: &str, rest: &str) -> String {
    format!("[[percept]]\nname = \"{name}\"\n{rest}\n")
}

fn cube() -> Observation {
    Observation { half_extents_m: [0.03; 3], ..Observation::object(1, 5) }
}

struct Always(Evaluation);

impl Classify for Always {
    fn classify(&self, _given: &ClassifierInput<'_>) -> Evaluation {
        self.0
    }
}

fn with_plugins(evaluation: Evaluation) -> Perception {
    let own: Own = vec![("mine".to_owned(), Arc::new(Always(evaluation)))];
    Perception::with_plugins(&percepts(&percept("p", "kernel = { plugin = \"mine\" }")), &own).unwrap()
}

#[test]
fn match_times_confidence_equal_to_the_threshold_does_not_pass() {
    let half = Evaluation { matching: 1.0, confidence: 0.5, feature: Feature::None };
    assert!(with_plugins(half).perceive(&cube(), &ROBOT).values().is_empty());
    let more = Evaluation { confidence: 0.501, ..half };
    assert_eq!(with_plugins(more).perceive(&cube(), &ROBOT).values().len(), 1);
}

/// A snapshot rebuilt from `known`, which is untrusted.
fn rebuilt(perception: &Perception, observation: &Observation, known: &Snapshot, frame: &Frame) -> Snapshot {
    let mut snapshot = Snapshot::default();
    perception.rebuild(&ClassifierInput::new(observation, *frame), known.values(), &mut snapshot);
    snapshot
}

#[test]
fn the_source_is_one_symbol_in_every_perspective() {
    let perception = Perception::new(&percepts(&percept("seen_by", "kernel = \"source\""))).unwrap();
    let seen = Observation { source: 7, ..cube() };
    let known = perception.perceive(&seen, &ROBOT);
    assert_eq!(known.value(0).and_then(PerceptValue::feature), Some(Feature::Symbol(7)));
    // The percept does not depend on the frame, so it is not re-evaluated.
    let elsewhere = Observation { source: 8, ..seen };
    assert_eq!(rebuilt(&perception, &elsewhere, &known, &Frame { agent: 1 }), known);
}

#[test]
fn a_plugin_percept_with_invalid_values_matches_no_object() {
    let sure = Evaluation::certain(Feature::None);
    for lie in [
        Evaluation { matching: f32::NAN, ..sure },
        Evaluation { matching: 1.5, ..sure },
        Evaluation { confidence: -1.0, matching: -1.0, ..sure },
        Evaluation { feature: Feature::Number(f32::NAN), ..sure },
        Evaluation { feature: Feature::Vector([f32::INFINITY, 0.0, 0.0]), ..sure },
    ] {
        assert!(with_plugins(lie).perceive(&cube(), &ROBOT).values().is_empty(), "{lie:?}");
    }
}

#[test]
fn a_plugin_percept_that_the_program_lacks_is_named() {
    let refused = Perception::new(&percepts(&percept("p", "kernel = { plugin = \"mine\" }"))).err().unwrap();
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
fn only_an_existing_empty_hole_is_perceived() {
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
fn a_region_is_in_the_frame_of_the_observation() {
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
    for (number, (_, _, kernel)) in (0..).zip(&percepts.percepts) {
        let percepts::Kernel::Nearest(nearest) = kernel else { continue };
        for (symbol, prototype) in (0..).zip(&nearest.prototypes) {
            let mut thing = Observation { confidence: 0.51, ..cube() };
            let at: Vec<f32> = prototype.at.iter().map(|part| single(*part)).collect();
            match nearest.space {
                percepts::Space::Shape => thing.shape = at.try_into().unwrap(),
                percepts::Space::Colour => thing.colour_rgb = at.try_into().unwrap(),
                percepts::Space::EdgeM => thing.half_extents_m = [at[0] / 2.0; 3],
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

/// The observation without one of its attributes.
fn without(mut seen: Observation, attribute: &str) -> Observation {
    match attribute {
        "orientation" => seen.orientation_xyzw = [UNOBSERVED; 4],
        "extents" => seen.half_extents_m = [UNOBSERVED; 3],
        "colour" => seen.colour_rgb = [UNOBSERVED; 3],
        "shape" => seen.shape = [UNOBSERVED; 4],
        other => panic!("{other} is no attribute"),
    }
    seen
}

#[test]
fn an_unobserved_attribute_has_no_percept_and_changes_no_other() {
    let percepts = Percepts::builtin();
    let perception = Perception::new(&percepts).unwrap();
    let complete = Observation {
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        colour_rgb: [0.8, 0.05, 0.05],
        shape: [0.0; 4],
        ..cube()
    };
    let all = perception.perceive(&complete, &ROBOT);
    for (attribute, of_it) in [
        ("orientation", &["orientation"][..]),
        ("extents", &["extents", "size"]),
        ("colour", &["colour"]),
        ("shape", &["shape"]),
    ] {
        let snapshot = perception.perceive(&without(complete, attribute), &ROBOT);
        let is_of_it =
            |value: &&PerceptValue| of_it.iter().any(|name| percepts.index(name) == Some(value.percept));
        let (gone, others): (Vec<&PerceptValue>, Vec<&PerceptValue>) =
            all.values().iter().partition(is_of_it);
        assert_eq!(gone.len(), of_it.len(), "{attribute}");
        assert_eq!(snapshot.values().iter().collect::<Vec<_>>(), others, "{attribute}");
    }
}

#[test]
fn a_child_of_an_unobserved_attribute_has_no_percept() {
    let text = percept("extents", "kernel = \"extents\"")
        + &percept("size", NEAREST_EDGE)
        + &percept(
            "long",
            "parent = \"extents\"\nkernel = { range = { component = \"longest_m\", from = 0.1 } }",
        )
        + &percept("red", NEAREST_RED)
        + &percept("position", "parent = \"extents\"\nkernel = \"position\"");
    let red = Observation { colour_rgb: [1.0, 0.0, 0.0], half_extents_m: [0.016; 3], ..cube() };
    let children = ["size", "long", "red", "position"];
    assert!(children.iter().all(|child| said(&text, &red, child).is_some()));
    let seen = without(red, "extents");
    assert!(children.iter().all(|child| said(&text, &seen, child).is_none()));
    // A parent that only gates a percept does not stand in for the attribute that the percept reads.
    let seen = without(red, "colour");
    assert_eq!((said(&text, &seen, "red"), said(&text, &seen, "size").is_some()), (None, true));
}

proptest! {
    #[test]
    fn every_perceived_value_is_above_the_threshold_and_in_order(
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

/// A plug-in whose confidence and feature depend on the frame and the position.
struct Near;

impl Classify for Near {
    fn classify(&self, input: &ClassifierInput<'_>) -> Evaluation {
        let [x, y, _] = input.observation.position_m;
        let degree = (1.0 - x.hypot(y) / 2.0).clamp(0.0, 1.0);
        Evaluation {
            confidence: degree,
            ..Evaluation::certain(Feature::Number(f32::from(input.frame.agent)))
        }
    }
}

/// A plug-in that derives a position beside the thing, or, as a child, returns its parent's evaluation.
struct Told;

impl Classify for Told {
    fn classify(&self, input: &ClassifierInput<'_>) -> Evaluation {
        let [x, y, z] = input.observation.position_m;
        input.parent.unwrap_or(Evaluation {
            confidence: 0.9,
            ..Evaluation::certain(Feature::Vector([x, y + 0.5, z]))
        })
    }
}

const KERNELS: [&str; 11] = [
    "{ plugin = \"told\" }",
    "\"position\"",
    "\"orientation\"",
    "\"extents\"",
    "\"source\"",
    "{ state = \"filled\" }",
    "{ region = { min_m = [0.0, -1.0, -1.0], max_m = [1.0, 1.0, 1.0] } }",
    "{ plugin = \"near\" }",
    "{ nearest = { space = \"edge_m\", scale = 0.1, prototypes = [{ name = \"a\", at = [0.03] }, { name = \"b\", at = [0.1] }] } }",
    "{ nearest = { space = \"colour\", scale = 1.0, prototypes = [{ name = \"a\", at = [0.8, 0.0, 0.0] }, { name = \"b\", at = [0.0, 0.0, 0.8] }] } }",
    "{ nearest = { space = \"shape\", scale = 1.0, prototypes = [{ name = \"a\", at = [0.0, 0.0, 0.0, 0.0] }] } }",
];

/// A range over the feature that a percept with this kernel derives, if there is one.
fn range_of(kernel: &str) -> Option<&'static str> {
    match kernel {
        "\"position\"" => Some("{ range = { component = \"distance_m\", to = 1.0, softness = 1.0 } }"),
        "\"extents\"" => Some("{ range = { component = \"longest_m\", from = 0.1, softness = 0.05 } }"),
        "\"orientation\"" | "\"source\"" => None,
        own if own.contains("told") => Some("{ range = { component = \"y_m\", from = 0.0, to = 1.0 } }"),
        nearest if nearest.contains("nearest") => None,
        _number => Some("{ range = { component = \"number\", from = 0.6, softness = 0.4 } }"),
    }
}

/// A random percept set: each percept has any kernel, and any earlier percept or none as its parent; some are ranges.
fn tree() -> impl Strategy<Value = Percepts> {
    let node = (0..KERNELS.len(), any::<prop::sample::Index>(), any::<bool>());
    prop::collection::vec(node, 1..=12).prop_map(|nodes| {
        let mut kernels: Vec<&str> = Vec::new();
        let mut text = String::new();
        for (number, (kernel, parent, is_range)) in nodes.iter().enumerate() {
            let parent = parent.index(number + 1);
            let above = kernels.get(parent).copied();
            let range = above.filter(|_| *is_range).and_then(range_of);
            let kernel = range.unwrap_or(KERNELS[*kernel]);
            let parent = above.map(|_| format!("parent = \"p{parent}\"\n")).unwrap_or_default();
            text += &percept(&format!("p{number}"), &format!("{parent}kernel = {kernel}"));
            kernels.push(kernel);
        }
        percepts(&text)
    })
}

fn perceiving(percepts: &Percepts) -> Perception {
    let own: Own = vec![("near".to_owned(), Arc::new(Near)), ("told".to_owned(), Arc::new(Told))];
    Perception::with_plugins(percepts, &own).unwrap()
}

fn thing() -> impl Strategy<Value = Observation> {
    let states = prop_oneof![Just(f32::NAN), 0.0..=1.0_f32];
    let attributes = prop::sample::subsequence(vec!["orientation", "extents", "colour", "shape"], 0..=4);
    (
        prop::array::uniform3(-2.0..2.0_f32),
        prop::array::uniform3(0.0..0.1_f32),
        prop::array::uniform3(0.0..=1.0_f32),
        prop::array::uniform4(0.0..=1.0_f32),
        states,
        0.4..=1.0_f32,
        attributes,
    )
        .prop_map(|(position_m, half_extents_m, colour_rgb, shape, filled, confidence, unobserved)| {
            let orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
            let seen = Observation { position_m, orientation_xyzw, half_extents_m, ..cube() };
            let mut thing = Observation { colour_rgb, shape, confidence, ..seen };
            thing.set_state(State::Filled, filled);
            unobserved.into_iter().fold(thing, without)
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
    fn reperceiving_in_another_frame_equals_perceiving_anew(
        tree in tree(), mine in thing(), his_m in prop::array::uniform3(-2.0..2.0_f32), agent in 0..3_u16,
    ) {
        let perception = perceiving(&tree);
        let known = perception.perceive(&mine, &ROBOT);
        // An orientation that was not observed stays unobserved in another frame.
        let orientation_xyzw = mine.orientation().map_or(mine.orientation_xyzw, |_| [0.6, 0.0, 0.0, 0.8]);
        let his = Observation { position_m: his_m, orientation_xyzw, ..mine };
        let frame = Frame { agent };
        let anew = perception.perceive(&his, &frame);
        prop_assert_eq!(rebuilt(&perception, &his, &known, &frame), anew);
        let mut in_place = known;
        perception.reperceive(&his, &frame, &mut in_place);
        prop_assert_eq!(in_place.values(), anew.values());
    }

    #[test]
    fn reperceiving_an_invalid_snapshot_gives_an_ordered_snapshot(
        tree in tree(), his in thing(), known in nonsense(),
    ) {
        let perception = perceiving(&tree);
        let snapshot = rebuilt(&perception, &his, &known, &ROBOT);
        let honest = perception.perceive(&his, &ROBOT);
        prop_assert!(snapshot.values().is_sorted_by(|a, b| a.percept < b.percept));
        for value in snapshot.values() {
            prop_assert!(f64::from(value.matching) * f64::from(value.confidence) > 0.5);
            prop_assert!(value.matching <= 1.0 && value.confidence <= 1.0 && value.feature().is_some());
            let percept = &perception.percepts[usize::from(value.percept)];
            // Percepts that depend on the frame are re-evaluated, whatever the known snapshot contains.
            if percept.is_frame_dependent && percept.parent.is_none() {
                prop_assert_eq!(honest.value(value.percept), Some(value));
            }
            prop_assert!(percept.parent.is_none_or(|parent| snapshot.value(parent).is_some()));
        }
    }
}

#[test]
fn percepts_independent_of_the_frame_are_copied_without_evaluation() {
    let perception = Perception::new(&percepts(&percept("extents", "kernel = \"extents\""))).unwrap();
    let mut known = Snapshot::default();
    let alleged = PerceptValue::new(0, 1.0, 0.75, Feature::Vector([9.0; 3]));
    assert!(known.push(alleged));
    assert_eq!(rebuilt(&perception, &cube(), &known, &ROBOT).values(), [alleged]);
    assert!(rebuilt(&perception, &cube(), &Snapshot::default(), &ROBOT).values().is_empty());
}

/// The evaluation of a thing by the named percept of a set with plug-ins.
fn said(text: &str, thing: &Observation, name: &str) -> Option<(f32, f32, Feature)> {
    let percepts = percepts(text);
    let snapshot = perceiving(&percepts).perceive(thing, &ROBOT);
    let value = snapshot.value(percepts.index(name).unwrap())?;
    Some((value.matching, value.confidence, value.feature().unwrap()))
}

#[test]
fn a_range_without_softness_is_inside_or_outside() {
    let text = percept("position", "kernel = \"position\"")
        + &percept(
            "raised",
            "parent = \"position\"\nkernel = { range = { component = \"z_m\", from = 0.5, softness = 0.25 } }",
        );
    let at =
        |z| said(&text, &Observation { position_m: [0.0, 0.0, z], confidence: 0.75, ..cube() }, "raised");
    assert_eq!(at(0.5), Some((1.0, 0.75, Feature::Number(1.0))));
    assert_eq!(at(0.4375), Some((0.75, 0.75, Feature::Number(0.75))));
    // A match of one half, times 0.75.
    assert_eq!(at(0.375), None);
    assert_eq!(at(0.3125), Some((0.75, 0.75, Feature::Number(0.25))));
    assert_eq!(at(0.25), Some((1.0, 0.75, Feature::Number(0.0))));
    assert_eq!(at(-9.0), Some((1.0, 0.75, Feature::Number(0.0))));
}

#[test]
fn ranges_apply_to_whole_sides_and_to_state_degrees() {
    let text = percept("extents", "kernel = \"extents\"")
        + &percept("filled", "kernel = { state = \"filled\" }")
        + &percept(
            "long",
            "parent = \"extents\"\nkernel = { range = { component = \"longest_m\", from = 0.1 } }",
        )
        + &percept(
            "full",
            "parent = \"filled\"\nkernel = { range = { component = \"number\", from = 0.75 } }",
        );
    let mut block = Observation { half_extents_m: [0.03, 0.05, 0.03], ..cube() };
    assert_eq!(said(&text, &block, "long").unwrap().2, Feature::Number(1.0));
    assert_eq!(said(&text, &cube(), "long").unwrap().2, Feature::Number(0.0));
    assert_eq!(said(&text, &block, "full"), None);
    for (degree, full) in [(0.75, 1.0), (0.5, 0.0)] {
        block.set_state(State::Filled, degree);
        assert_eq!(said(&text, &block, "full").unwrap().2, Feature::Number(full));
    }
}

#[test]
fn children_of_regions_and_ranges_are_evaluated_only_inside() {
    for kernel in [
        "{ range = { component = \"distance_m\", to = 0.5 } }",
        "{ region = { min_m = [-0.5, -0.5, -0.5], max_m = [0.5, 0.5, 0.5] } }",
    ] {
        let text = percept("position", "kernel = \"position\"")
            + &percept("near", &format!("parent = \"position\"\nkernel = {kernel}"))
            + &percept("extents", "parent = \"near\"\nkernel = \"extents\"");
        let at = |x, name| said(&text, &Observation { position_m: [x, 0.0, 0.0], ..cube() }, name);
        assert!(at(0.4, "extents").is_some());
        // A thing outside is perceived as outside, and the children are not evaluated.
        assert_eq!(at(0.6, "near").unwrap().2, Feature::Number(0.0));
        assert_eq!(at(0.6, "extents"), None);
    }
}

#[test]
fn a_plugin_child_reads_the_value_extracted_by_its_parent() {
    let text = percept("extents", "kernel = \"extents\"") + &percept("size", NEAREST_EDGE);
    let text = text + &percept("told", "parent = \"size\"\nkernel = { plugin = \"told\" }");
    let thing = Observation { half_extents_m: [0.016; 3], confidence: 0.9, ..cube() };
    let size = said(&text, &thing, "size").unwrap();
    assert!(size.0 < 1.0 && size.1 < 0.9, "{size:?}");
    let told = said(&text, &thing, "told").unwrap();
    // The parent's confidence includes that of the observation, which is multiplied into every percept's once more.
    assert_eq!(told, (size.0, size.1 * 0.9, size.2));
}

const NEAREST_EDGE: &str = "parent = \"extents\"\nkernel = { nearest = { space = \"edge_m\", scale = 0.1, prototypes = \
    [{ name = \"a\", at = [0.03] }, { name = \"b\", at = [0.1] }] } }";

#[test]
fn children_read_the_value_and_confidence_of_a_plugin_percept() {
    // The position half a metre to the left of the thing, with a confidence of 0.9.
    let text = percept("beside", "kernel = { plugin = \"told\" }")
        + &percept(
            "left",
            "parent = \"beside\"\nkernel = { region = { min_m = [-9.0, 0.0, -9.0], max_m = [9.0, 9.0, 9.0] } }",
        )
        + &percept("right", "parent = \"beside\"\nkernel = { range = { component = \"y_m\", to = 0.0 } }")
        + &percept("edge", &NEAREST_EDGE.replace("extents", "beside"))
        + &percept("red", &NEAREST_RED.replace("extents", "beside"));
    let at = |position_m, name| {
        let colour_rgb = [0.0, 1.0, 0.0];
        said(&text, &Observation { position_m, colour_rgb, confidence: 0.8, ..cube() }, name)
    };
    let sure = 0.8 * 0.9;
    assert_eq!(at([0.0, -0.25, 0.0], "left"), Some((1.0, sure, Feature::Number(1.0))));
    assert_eq!(at([0.0, -0.25, 0.0], "right"), Some((1.0, sure, Feature::Number(0.0))));
    assert_eq!(at([0.0, -0.75, 0.0], "left"), Some((1.0, sure, Feature::Number(0.0))));
    assert_eq!(at([0.0, -0.75, 0.0], "right"), Some((1.0, sure, Feature::Number(1.0))));
    // As half extents, [0.05, 0.05, 0.05] is a cube of 0.1; as a colour, [1, 0, 0] is red.
    let (_, _, edge) = at([0.05, -0.45, 0.05], "edge").unwrap();
    assert_eq!(edge, Feature::Symbol(1));
    assert_eq!(at([1.0, -0.5, 0.0], "red"), Some((1.0, sure, Feature::Symbol(0))));
}

const NEAREST_RED: &str = "parent = \"extents\"\nkernel = { nearest = { space = \"colour\", scale = 0.5, prototypes = \
    [{ name = \"a\", at = [1.0, 0.0, 0.0] }] } }";

#[test]
fn children_of_a_plugin_without_a_vector_read_the_observation() {
    let text = percept("number", "kernel = { plugin = \"near\" }")
        + &percept(
            "left",
            "parent = \"number\"\nkernel = { region = { min_m = [-9.0, 0.0, -9.0], max_m = [9.0, 9.0, 9.0] } }",
        )
        + &percept("high", "parent = \"number\"\nkernel = { range = { component = \"z_m\", from = 0.0 } }");
    let thing = Observation { position_m: [0.0, 0.25, 0.0], confidence: 0.8, ..cube() };
    assert_eq!(said(&text, &thing, "left"), Some((1.0, 0.8, Feature::Number(1.0))));
    assert_eq!(said(&text, &thing, "high"), None, "a number has no z");
}
