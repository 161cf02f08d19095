//! The tasks of the paper as snapshots, and properties of learning over small random worlds.

mod beyond;
mod brute;
mod conflict;
mod paper;
mod properties;
mod telling;

use std::collections::BTreeMap;

use crate::{
    Example, FeatureWords, Language, Learned, Object, Settings, Snapshot, StateWords, Task, View, learn_with,
};

/// The minimum posterior of a high-likelihood rule, relative to the best posterior.
const SHARE: f64 = 0.01;

fn language() -> Language {
    let feature = |percept, name: &str, values: &[&str]| FeatureWords {
        percept,
        name: name.to_owned(),
        values: values.iter().map(|&value| value.to_owned()).collect(),
    };
    let state = |percept, name: &str| StateWords { percept, name: name.to_owned() };
    Language {
        features: vec![
            feature(3, "size", &["small", "medium", "large"]),
            feature(5, "colour", &["red", "green", "blue", "yellow", "wood"]),
            feature(4, "shape", &["square", "triangle", "long", "bridge", "cylinder", "peg"]),
        ],
        states: vec![state(6, "filled"), state(7, "marked"), state(8, "inserted")],
        position: 0,
        orientation: None,
        extents: None,
        moved_m: 0.03,
    }
}

fn object(id: u64, words: &str, place_m: [f64; 3], states: &[(&str, bool)]) -> Object {
    let mut words = words.split(' ');
    let mut features = BTreeMap::new();
    for name in ["size", "colour", "shape"] {
        features.insert(name.to_owned(), words.next().unwrap().to_owned());
    }
    let states = states.iter().map(|&(name, on)| (name.to_owned(), on)).collect();
    Object { id, features, states, position_m: Some(place_m), ..Object::default() }
}

fn snapshot(objects: Vec<Object>) -> Snapshot {
    Snapshot { objects, frame_orientation_xyzw: [0.0, 0.0, 0.0, 1.0], ..Snapshot::default() }
}

fn view(perspective: u16, before: Vec<Object>, after: Vec<Object>) -> View {
    View { perspective, before: snapshot(before), after: snapshot(after), executables: Vec::new() }
}

fn learned(task: &Task, perspective: u16) -> Learned {
    let views: Vec<View> = task.views(perspective).map(|view| view.attended(0.03)).collect();
    learn(&views.iter().collect::<Vec<_>>())
}

/// Learns as in the paper.
fn learn(views: &[&View]) -> Learned {
    learn_with(&language(), views, &Settings { high_likelihood: SHARE, ..Settings::default() })
}

fn task(examples: Vec<Vec<View>>) -> Task {
    let examples = examples.into_iter().map(|views| Example::shown(1, views)).collect();
    Task { name: "task 1".to_owned(), examples }
}

fn high_likelihood(learned: &Learned) -> Vec<String> {
    let rules = learned.goals.iter().flatten();
    rules.filter(|rule| rule.standing.high_likelihood).map(|rule| rule.name.clone()).collect()
}
