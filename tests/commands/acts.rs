//! The acts that Leo tells apart, over the real processes.

use serde_json::Value;

use crate::house::tell;

/// The acts of a lesson's only demonstration, as its account tells them.
pub(crate) fn acts(lesson: &str) -> Vec<String> {
    let told = tell(&["teach", lesson, "--json"]);
    assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{told:?}");
    let lessons: Value = serde_json::from_str(&told.out).expect("is JSON");
    let acts = lessons.pointer("/0/account/tasks/0/demonstrations/0/actions").and_then(Value::as_array);
    acts.expect("a list").iter().map(|act| act.as_str().expect("a text").to_owned()).collect()
}

#[test]
fn what_is_placed_on_something_is_told_with_what_holds_it_and_a_correction_is_another_act() {
    let should = [
        "the teacher: blue square placed on the green square",
        "the teacher: blue square placed on the red square",
        "the teacher: triangle placed on the blue square",
    ];
    assert_eq!(acts("config/lessons/stacking.toml"), should);
}

#[test]
fn what_is_handed_over_is_told_with_who_receives_it() {
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
