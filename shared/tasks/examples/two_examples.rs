//! A rule learned from two examples: `cargo run -p leo-tasks --example two_examples`.
//!
//! A teacher marks every red object, first of two colours and then of three. After both examples, the rule is about the
//! colour.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use std::collections::BTreeMap;
use std::error::Error;

use tasks::{FeatureWords, Language, Learning, Object, Settings, Snapshot, StateWords, View};

const COLOURS: [&str; 3] = ["red", "green", "blue"];
const SHAPES: [&str; 2] = ["square", "triangle"];

fn language() -> Language {
    let feature = |percept, name: &str, values: &[&str]| FeatureWords {
        percept,
        name: name.to_owned(),
        values: values.iter().map(|&value| value.to_owned()).collect(),
    };
    Language {
        features: vec![feature(1, "colour", &COLOURS), feature(2, "shape", &SHAPES)],
        states: vec![StateWords { percept: 3, name: "marked".to_owned() }],
        position: 0,
        orientation: None,
        extents: None,
        moved_m: 0.03,
    }
}

/// The robot's view of a demonstration in which the teacher marks the red objects.
fn demonstration(objects: &[(&str, &str)]) -> View {
    let snapshot = |is_after: bool| {
        let objects = (1..).zip(objects).map(|(id, &(colour, shape))| {
            let features = [("colour", colour), ("shape", shape)];
            let is_marked = is_after && colour == "red";
            Object {
                id,
                features: features.map(|(name, value)| (name.to_owned(), value.to_owned())).into(),
                states: BTreeMap::from([("marked".to_owned(), is_marked)]),
                position_m: Some([0.5, 0.1, 0.0]),
                ..Object::default()
            }
        });
        let frame_orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
        Snapshot { objects: objects.collect(), frame_orientation_xyzw, ..Snapshot::default() }
    };
    View { perspective: 0, before: snapshot(false), after: snapshot(true), executables: Vec::new() }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut learning = Learning::new(&language(), &Settings::default());
    let first = [("red", "square"), ("red", "square"), ("blue", "triangle")];
    let second = [("red", "triangle"), ("green", "square"), ("blue", "triangle")];
    for objects in [first, second] {
        learning.add(&demonstration(&objects));
        for rule in learning.learned().primary() {
            let features = &rule.template;
            println!("after {} of 2 examples: {} (by {features:?})", learning.examples(), rule.name);
        }
    }

    let learned = learning.learned();
    let rule = learned.primary().next().ok_or("a rule was learned")?;
    let novel = demonstration(&[("red", "triangle"), ("green", "triangle")]).before;
    let open: Vec<u64> = rule.open(&novel, |_object| false).map(|object| object.id).collect();
    println!("of a red and a green triangle, the rule demands that object {open:?} is marked");
    assert_eq!(open, [1], "the rule is about the red objects");
    Ok(())
}
