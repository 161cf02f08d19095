//! Recognised acts, tested with the real processes.

use message::{EventKind, Events, TopicId};
use recording::Frame;
use serde_json::Value;

use crate::harness::run_leo;

/// The acts of a lesson's only demonstration, from its account.
pub(crate) fn acts(lesson: &str) -> Vec<String> {
    let output = run_leo(&["teach", lesson, "--json"]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    let lessons: Value = serde_json::from_str(&output.out).expect("is JSON");
    let acts = lessons.pointer("/0/account/tasks/0/demonstrations/0/actions").and_then(Value::as_array);
    acts.expect("a list").iter().map(|act| act.as_str().expect("a text").to_owned()).collect()
}

#[test]
fn a_placement_names_its_support_and_a_correction_is_another_act() {
    let should = [
        "the teacher: blue square placed on the green square",
        "the teacher: blue square placed on the red square",
        "the teacher: triangle placed on the blue square",
    ];
    assert_eq!(acts("config/lessons/stacking.toml"), should);
}

#[test]
fn a_hand_over_is_reported_with_its_receiver() {
    let should = [
        "the teacher: yellow square moved",
        "the teacher: blue square handed to me",
        "the teacher: red square handed to partner 2",
        "partner 2: red square moved",
    ];
    assert_eq!(acts("config/lessons/giving.toml"), should);
}

#[test]
fn a_figure_is_built_by_placing_things_on_one_another() {
    let should = [
        "the teacher: red square moved",
        "the teacher: red square placed on another red square",
        "the teacher: red square placed on another red square",
        "the teacher: green square moved",
        "the teacher: yellow triangle placed on the green square",
        "the teacher: blue slab moved",
    ];
    assert_eq!(acts("config/lessons/task3.toml"), should);
}

/// The acts of others in a recording, each with the movements reported since the act before. Movements after
/// the last act come last.
pub(crate) fn movements(frames: &[Frame]) -> Vec<(Vec<String>, Option<String>)> {
    let output = frames.iter().filter(|frame| frame.topic == TopicId::Events);
    let output = output.flat_map(|frame| frame.read::<Events>().expect("events of this version").1);
    let mut acts = vec![(Vec::new(), None)];
    for event in output {
        let text = event.text.as_str().to_owned();
        let (since, act) = acts.last_mut().expect("never empty");
        match event.kind() {
            Some(EventKind::MovementSeen) => since.push(text),
            Some(EventKind::ActionSeen) if !text.starts_with("I: ") => {
                *act = Some(text);
                acts.push((Vec::new(), None));
            }
            _ => {}
        }
    }
    acts
}

/// Whether an act matches the predicted purpose of the movement before it.
pub(crate) fn comes_true(movement: &str, act: &str) -> bool {
    let Some((who, what)) = movement.split_once(": putting the ") else { return false };
    let Some(done) = act.strip_prefix(who).and_then(|done| done.strip_prefix(": ")) else { return false };
    if let Some((_, hole)) = what.split_once(" into the ") {
        done.contains(&format!("{hole} filled"))
    } else if let Some((thing, below)) = what.split_once(" onto ") {
        done.contains(&format!("{thing} placed on {below}"))
    } else {
        // The predicted movement leaves open whether it is a hand-over.
        let Some(thing) = what.strip_suffix(" down") else { return false };
        ["moved", "handed to"].iter().any(|act| done.starts_with(&format!("{thing} {act}")))
    }
}
