//! Conflicts between the robot's own view and the teacher's perspective.

use std::collections::BTreeMap;

use super::paper::{fill_all_holes, task_1, task_2};
use super::{language, learned, object, view};
use crate::{Decision, Example, OnConflict, Task, decide_with, differ};

fn decided(task: &Task, on_conflict: OnConflict) -> Decision {
    let by_perspective: BTreeMap<u16, _> = [0, 1].into_iter().map(|p| (p, learned(task, p))).collect();
    decide_with(&language(), task, &by_perspective, 1, on_conflict)
}

/// Task 1, and a demonstration in which the teacher leaves out a red block that they know of.
fn with_a_slip() -> Task {
    let mut task = task_1();
    let mut views = fill_all_holes(&["green", "yellow", "red", "blue"]);
    for object in views.iter_mut().flat_map(|view| &mut view.after.objects) {
        if object.features["colour"] == "red" {
            object.states.insert("filled".to_owned(), false);
        }
    }
    task.examples.push(Example::shown(1, views));
    task
}

/// Adds the teacher's answer to whether such an object should be filled, too.
fn answer(task: &mut Task, words: &str, yes: bool) {
    let thing = |filled| {
        let thing = object(1, words, [0.0; 3], &[("filled", filled)]);
        vec![crate::Object { position_m: None, ..thing }]
    };
    let views = [0, 1].map(|perspective| view(perspective, thing(false), thing(yes)));
    task.examples.push(Example::shown(1, views.to_vec()));
}

#[test]
fn conflict_is_resolved_by_what_the_teacher_could_not_know() {
    for task in [task_1(), task_2()] {
        assert!(differ(&learned(&task, 0), &learned(&task, 1)));
        assert_eq!(decided(&task, OnConflict::Human), Decision::Followed(1));
        assert_eq!(decided(&task, OnConflict::Own), Decision::Followed(0));
        assert_eq!(decided(&task, OnConflict::Resolve), Decision::Followed(1));
    }
}

#[test]
fn known_counter_example_leaves_the_decision_open_until_answered() {
    let task = with_a_slip();
    assert_eq!(decided(&task, OnConflict::Human), Decision::Followed(1));
    let Decision::Open(question) = decided(&task, OnConflict::Resolve) else {
        panic!("it was chosen silently")
    };
    assert_eq!(question.kind["colour"], "red");
    for (yes, followed) in [(true, 1), (false, 0)] {
        let mut task = task.clone();
        answer(&mut task, "medium red square", yes);
        assert_eq!(decided(&task, OnConflict::Resolve), Decision::Followed(followed), "{yes}");
    }
    // An answer about another kind of object does not count.
    let mut task = task;
    answer(&mut task, "medium green square", true);
    assert_eq!(decided(&task, OnConflict::Resolve), Decision::Open(question));
}

#[test]
fn hidden_object_explains_only_itself() {
    // In each demonstration the teacher leaves out a visible blue block, 6 cm beside the hidden one. So the teacher
    // knows of one of the two.
    let mut task = task_1();
    let seen = || object(50, "medium blue square", [0.24, 0.7, 0.03], &[("filled", false)]);
    for view in task.examples.iter_mut().flat_map(|example| &mut example.views) {
        view.before.objects.push(seen());
        view.after.objects.push(seen());
    }
    let rule = learned(&task_1(), 1).primary().next().unwrap().clone();
    let explanation = crate::explain(&language(), &task, &[0, 1], &rule);
    assert_eq!((explanation.unseen.len(), explanation.unexplained.len()), (1, 1), "{explanation:?}");
}

#[test]
fn equal_views_or_one_without_a_rule_are_no_conflict() {
    let mut agreed = task_1();
    for example in &mut agreed.examples {
        let own = example.views[0].clone();
        example.views[1] = crate::View { perspective: 1, ..own };
    }
    let mut absent = task_1();
    absent.examples.iter_mut().for_each(|example| example.views.truncate(1));
    let mut blind = task_1();
    for view in blind.examples.iter_mut().flat_map(|example| &mut example.views) {
        if view.perspective == 0 {
            view.after = view.before.clone();
        }
    }
    for on_conflict in [OnConflict::Human, OnConflict::Own, OnConflict::Resolve] {
        assert_eq!(decided(&agreed, on_conflict), Decision::Followed(1));
        assert_eq!(decided(&absent, on_conflict), Decision::Followed(0));
        assert_eq!(decided(&blind, on_conflict), Decision::Followed(1));
        assert_eq!(decided(&super::task(Vec::new()), on_conflict), Decision::NoRule);
    }
}

#[test]
fn a_leftover_within_the_counted_number_needs_no_explanation() {
    let thing = |id: u64, words: &str, filled: bool| {
        object(id, words, [0.1 * quantity::number::float(id), 0.7, 0.03], &[("filled", filled)])
    };
    // The first two are alike, and one of them is left out; the last is hidden from the teacher.
    let words = ["medium red square", "medium red square", "medium green square", "medium blue square"];
    let things = |known: usize, done: bool| -> Vec<_> {
        (0..)
            .zip(words)
            .take(known)
            .map(|(id, words)| thing(id, words, done && (id == 0 || id == 2)))
            .collect()
    };
    let views = vec![view(0, things(4, false), things(4, true)), view(1, things(3, false), things(3, true))];
    let task = super::task(vec![views]);
    let all = learned(&task_1(), 1).primary().next().unwrap().clone();
    for selection in [crate::Selection::AllBut(1), crate::Selection::Exactly(2)] {
        let number = crate::Rule { selection, ..all.clone() };
        let explanation = crate::explain(&language(), &task, &[0, 1], &number);
        assert_eq!(explanation.unseen, ["blue square"], "{selection:?}");
        assert!(explanation.is_complete(), "{selection:?}");
    }
    let explanation = crate::explain(&language(), &task, &[0, 1], &all);
    assert_eq!(explanation.unexplained.len(), 1, "of all of them, none may be left");
}
