//! Tasks 1 and 2 of the study, with the beliefs of the robot from Table 2.

use super::{high_likelihood, language, learned, object, snapshot, task, view};
use crate::{Object, Task, View, decide, explain};
use std::collections::BTreeMap;

/// A demonstration of Task 1: squares with holes, the last one hidden from the teacher by a barrier, and seven
/// pegs. The teacher uses one peg for each visible hole.
pub(super) fn fill_all_holes(colours: &[&str]) -> Vec<View> {
    let at = |index: usize, y: f64| [quantity::number::float_of_count(index).mul_add(0.12, -0.3), y, 0.03];
    let hidden = colours.len() - 1;
    let squares = |filled: bool| {
        (0..).zip(colours).enumerate().map(move |(index, (id, colour))| {
            let words = format!("medium {colour} square");
            object(id, &words, at(index, 0.7), &[("filled", filled && index != hidden)])
        })
    };
    let pegs = |inserted: bool| {
        (0..7_usize).map(move |index| {
            let used = inserted && index < hidden;
            let place = if used { at(index, 0.7) } else { at(index, 0.4) };
            object(100 + u64::try_from(index).unwrap(), "small wood peg", place, &[("inserted", used)])
        })
    };
    let all = |done: bool| squares(done).chain(pegs(done)).collect::<Vec<Object>>();
    let seen = |done: bool| {
        all(done).into_iter().filter(|object| object.id != u64::try_from(hidden).unwrap()).collect::<Vec<_>>()
    };
    vec![view(0, all(false), all(true)), view(1, seen(false), seen(true))]
}

pub(super) fn task_1() -> Task {
    task(vec![
        fill_all_holes(&["red", "green", "yellow", "red", "blue"]),
        fill_all_holes(&["green", "yellow", "red", "yellow", "blue"]),
    ])
}

/// A demonstration of Task 2: the teacher marks their red and green blocks and attends only to their own.
fn mark_red_and_green(his: &[&str], others: &[&str]) -> Vec<View> {
    let blocks = |words: &[&str], from: u64, y: f64, done: bool, mine: bool| {
        (from..)
            .zip(words)
            .map(|(id, words)| {
                let x = quantity::number::float(id).mul_add(0.1, -0.5);
                let marked = done && mine && !words.contains("blue");
                let owner = Some(if mine { 1 } else { 0 });
                Object { owner, ..object(id, words, [x, y, 0.03], &[("marked", marked)]) }
            })
            .collect::<Vec<Object>>()
    };
    let all = |done: bool| [blocks(his, 0, 1.0, done, true), blocks(others, 50, 0.4, done, false)].concat();
    vec![view(0, all(false), all(true)), view(1, all(false), all(true))]
}

pub(super) fn task_2() -> Task {
    let others = [
        "medium red square",
        "small green cylinder",
        "large red cylinder",
        "medium green square",
        "small blue square",
        "medium blue cylinder",
    ];
    task(vec![
        mark_red_and_green(
            &[
                "small red triangle",
                "medium green triangle",
                "large red long",
                "medium green bridge",
                "medium blue square",
                "small blue cylinder",
            ],
            &others,
        ),
        mark_red_and_green(
            &[
                "medium red bridge",
                "large green long",
                "small green triangle",
                "medium red long",
                "small blue cylinder",
                "medium blue square",
            ],
            &others,
        ),
    ])
}

#[test]
fn task_1_is_all_for_the_teacher_and_not_blue_for_leo() {
    let task = task_1();
    assert_eq!(high_likelihood(&learned(&task, 1)), ["all"]);
    assert_eq!(high_likelihood(&learned(&task, 0)), ["all but blue"]);
}

#[test]
fn task_2_depends_on_colour_for_the_teacher_and_shape_for_leo() {
    let task = task_2();
    let theirs = learned(&task, 1);
    assert_eq!(theirs.primary().next().unwrap().name, "all red and green");
    assert_eq!(high_likelihood(&learned(&task, 0)), ["all triangle, long and bridge"]);
}

#[test]
fn pegs_are_means_and_not_goals() {
    for perspective in [0, 1] {
        let learned = learned(&task_1(), perspective);
        assert_eq!(learned.goals.len(), 1);
        assert_eq!(learned.means.len(), 1);
        let kinds: Vec<_> = learned.means[0].kinds.iter().map(|kind| kind["shape"].as_str()).collect();
        assert_eq!(kinds, ["peg"]);
    }
}

#[test]
fn pegs_are_means_even_when_every_peg_was_used() {
    let mut task = task_1();
    for view in task.examples.iter_mut().flat_map(|example| &mut example.views) {
        for snapshot in [&mut view.before, &mut view.after] {
            snapshot.objects.retain(|object| object.id < 104);
        }
    }
    let learned = learned(&task, 1);
    assert_eq!(high_likelihood(&learned), ["all"]);
    assert_eq!(learned.means.len(), 1);
}

#[test]
fn the_teachers_rule_is_followed_and_the_difference_explained() {
    let task = task_1();
    let by_perspective: BTreeMap<u16, _> = [0, 1].into_iter().map(|p| (p, learned(&task, p))).collect();
    assert_eq!(decide(&by_perspective, 1), Some(1));
    assert_eq!(decide(&by_perspective, 2), Some(0), "a teacher who is not simulated has no view");
    let rule = by_perspective[&1].primary().next().unwrap();
    let explanation = explain(&language(), &task, &[0, 1], rule);
    assert!(explanation.is_complete(), "{explanation:?}");
    assert_eq!(
        (explanation.unseen.as_slice(), explanation.of_others),
        (&["blue square".to_owned()][..], false)
    );
}

#[test]
fn each_example_is_explained_by_its_own_teachers_view() {
    let mut task = task_1();
    // Each example has another teacher, to whom the block was hidden while the other one saw it.
    for (example, teacher) in task.examples.iter_mut().zip([1, 2]) {
        let [own, his] = example.views.as_slice() else { unreachable!() };
        let (own, his) = (own.clone(), his.clone());
        let other = View { perspective: 3 - teacher, ..own.clone() };
        let views = vec![own, View { perspective: teacher, ..his }, other];
        *example = crate::Example::shown(teacher, views);
    }
    let of = |views: Vec<&View>| super::learn(&views);
    let taught = of(task.taught(&[0, 1, 2]).collect());
    assert_eq!(high_likelihood(&taught), ["all"]);
    assert_ne!(high_likelihood(&of(task.views(2).collect())), ["all"], "the first showing was not his");
    // If a teacher is not simulated, the robot's view of the demonstration is used.
    let perspectives =
        |simulated: &[u16]| -> Vec<u16> { task.taught(simulated).map(|view| view.perspective).collect() };
    assert_eq!(perspectives(&[0, 1, 2]), [1, 2]);
    assert_eq!(perspectives(&[0, 2]), [0, 2]);
    let rule = taught.primary().next().unwrap();
    let explanation = explain(&language(), &task, &[0, 1, 2], rule);
    assert_eq!(
        (explanation.unseen.as_slice(), explanation.of_others),
        (&["blue square".to_owned()][..], true)
    );
    let explanation = explain(&language(), &task, &[0, 2], rule);
    assert_eq!(explanation.unexplained, ["blue square"], "nobody knows what the first could see");
}

#[test]
fn known_block_left_out_is_unexplained() {
    let mut task = task_1();
    // Now the teacher knows of the block.
    for example in &mut task.examples {
        let own = example.views[0].clone();
        example.views[1].after = own.after;
    }
    let rule = learned(&task_1(), 1).primary().next().unwrap().clone();
    let explanation = explain(&language(), &task, &[0, 1], &rule);
    assert!(!explanation.is_complete(), "{explanation:?}");
    assert_eq!(explanation.unexplained, ["blue square"]);
}

#[test]
fn hidden_object_beside_a_visible_similar_one_is_unknown() {
    let mut task = task_1();
    for view in task.examples.iter_mut().flat_map(|example| &mut example.views) {
        for (snapshot, filled) in [(&mut view.before, false), (&mut view.after, true)] {
            // 6 cm beside the hidden one, and filled.
            let beside = object(50, "medium blue square", [0.24, 0.7, 0.03], &[("filled", filled)]);
            snapshot.objects.push(beside);
        }
    }
    let rule = learned(&task_1(), 1).primary().next().unwrap().clone();
    let explanation = explain(&language(), &task, &[0, 1], &rule);
    assert_eq!(explanation.unseen, ["blue square"], "{explanation:?}");
    assert!(explanation.is_complete(), "{explanation:?}");
}

#[test]
fn mentioned_objects_are_known_to_the_teacher() {
    let rule = learned(&task_1(), 1).primary().next().unwrap().clone();
    let mut spoken_of = object(1, "medium blue square", [0.0; 3], &[("filled", false)]);
    spoken_of.position_m = None;
    let views = [0, 1].map(|perspective| view(perspective, vec![spoken_of.clone()], vec![spoken_of.clone()]));
    let explanation = explain(&language(), &task(vec![views.to_vec()]), &[0, 1], &rule);
    assert_eq!(
        (explanation.unseen.len(), explanation.unexplained.as_slice()),
        (0, &["square".to_owned()][..])
    );
    assert_eq!(explanation.unexplained_kinds, [spoken_of.features]);
}

#[test]
fn a_rule_finds_what_is_left_to_do_on_new_objects() {
    let novel = snapshot(vec![
        object(1, "medium blue square", [0.0; 3], &[("filled", false)]),
        object(2, "medium red square", [0.0; 3], &[("filled", true)]),
        object(3, "medium green square", [0.0; 3], &[("filled", false)]),
        object(4, "small wood peg", [0.0; 3], &[("inserted", false)]),
    ]);
    let open = |perspective| {
        let learned = learned(&task_1(), perspective);
        let rule = learned.primary().next().unwrap();
        rule.open(&novel, |_| false).map(|object| object.id).collect::<Vec<_>>()
    };
    assert_eq!(open(1), [1, 3]);
    assert_eq!(open(0), [3]);
}

#[test]
fn after_one_example_the_most_specific_rule_is_chosen() {
    let before = |done| {
        vec![
            object(1, "medium red triangle", [0.0; 3], &[("marked", done)]),
            object(2, "medium blue square", [0.2, 0.0, 0.0], &[("marked", false)]),
        ]
    };
    let learned = learned(&task(vec![vec![view(0, before(false), before(true))]]), 0);
    let names: Vec<&str> = learned.goals[0].iter().map(|rule| rule.name.as_str()).collect();
    assert_eq!(names[0], "all red triangle");
    let ties: Vec<&str> = learned.goals[0]
        .iter()
        .filter(|rule| rule.standing.rank == 2)
        .map(|rule| rule.name.as_str())
        .collect();
    assert_eq!(ties, ["all red", "all triangle"], "colour and shape explain it equally well");
}

#[test]
fn objects_of_other_owners_do_not_contradict_the_rule() {
    let task = task_2();
    let rule = learned(&task, 1).primary().next().unwrap().clone();
    let explanation = explain(&language(), &task, &[0, 1], &rule);
    assert!(explanation.is_complete(), "{explanation:?}");
    assert!(explanation.text().ends_with("are not yours"), "{}", explanation.text());
    assert!(explanation.foreign.contains(&"medium red square".to_owned()), "{explanation:?}");
}

#[test]
fn teacher_working_on_foreign_objects_ignores_ownership() {
    let mut task = task_2();
    for example in &mut task.examples {
        for object in &mut example.views[1].after.objects {
            // The teacher also marks one object on the other side.
            if object.id == 51 {
                object.states.insert("marked".to_owned(), true);
            }
        }
    }
    let everything = task.examples[0].views[1].clone();
    assert_eq!(everything.attended(0.03), everything);
    assert_ne!(task_2().examples[0].views[1].attended(0.03), everything);
}
