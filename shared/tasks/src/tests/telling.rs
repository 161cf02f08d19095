//! Sentences about a rule beside its demonstrations.

use super::paper::task_1;
use super::{SHARE, language, object, view};
use crate::{
    Description, Example, KnownBy, Learned, Learning, NumberedView, Settings, Statement, Task, Telling,
    contradictions_of,
};

fn ones(words: &str) -> Description {
    let colour = words.split(' ').next().map(|colour| ("colour".to_owned(), colour.to_owned()));
    Description { features: colour.into_iter().collect(), known: None }
}

fn telling(statement: Statement) -> Telling {
    Telling { speaker: 1, statement, prevails: None }
}

/// What a perspective learns from a task with its sentences.
fn learned(task: &Task, perspective: u16) -> Learned {
    let examples = task.examples.iter().enumerate();
    let views =
        examples.filter_map(|(number, example)| Some((number, example.view(perspective)?.attended(0.03))));
    let mut views: Vec<NumberedView> = views.collect();
    let told = crate::told(&language(), task, &mut views);
    let mut learning =
        Learning::new(&language(), &Settings { high_likelihood: SHARE, ..Settings::default() });
    views.iter().for_each(|(_, view)| learning.add(view));
    told.iter().for_each(|view| learning.add_told(view));
    learning.learned()
}

fn best(task: &Task, perspective: u16) -> String {
    learned(task, perspective).primary().next().map(|rule| rule.name.clone()).unwrap_or_default()
}

/// The teacher fills a small red block, and leaves out a large green one if `leaves` says so; otherwise that one is
/// absent. A large blue one is hidden from the teacher.
fn filling(leaves: bool) -> Task {
    let blocks = |filled: bool, perspective: u16| {
        let all = [
            ("small red square", true, 0),
            ("large green square", leaves, 0),
            ("large blue square", true, 1),
        ];
        let there =
            all.into_iter().filter(|(_, is_there, from)| *is_there && (perspective == 0 || *from == 0));
        let there = there.enumerate().map(|(index, (words, ..))| {
            let id = u64::try_from(index).unwrap();
            let at = quantity::number::float_of_count(index);
            object(id, words, [0.3, at, 0.0], &[("filled", filled && words.contains("red"))])
        });
        there.collect::<Vec<_>>()
    };
    let views =
        [0, 1].map(|perspective| view(perspective, blocks(false, perspective), blocks(true, perspective)));
    Task { name: "filling".to_owned(), examples: vec![Example::shown(1, views.to_vec())] }
}

fn told(mut task: Task, statements: &[Statement]) -> Task {
    let told = statements.iter().map(|statement| Example::told(1, telling(statement.clone())));
    task.examples.extend(told);
    task
}

#[test]
fn telling_decides_what_showing_leaves_open() {
    let open = learned(&filling(true), 1);
    let names: Vec<&str> = open.primary().take(1).map(|rule| rule.name.as_str()).collect();
    assert_eq!(names, ["all small red"], "size and colour explain it alike");
    let colour = told(filling(true), &[Statement::Irrelevant("size".to_owned())]);
    assert_eq!(best(&colour, 1), best(&filling(true), 1), "no other kind differs in size alone");

    let mut shown = filling(true);
    for view in shown.examples.iter_mut().flat_map(|example| &mut example.views) {
        for snapshot in [&mut view.before, &mut view.after] {
            snapshot.objects.push(object(8, "large red square", [0.5, 0.0, 0.0], &[("filled", true)]));
            snapshot.objects.push(object(9, "small green square", [0.6, 0.0, 0.0], &[("filled", true)]));
        }
    }
    let rules = [
        (Statement::Only(vec![ones("red")]), "all red"),
        (Statement::Also(vec![ones("red")]), "all red"),
        // It says nothing about the large red one.
        (Statement::Not(vec![ones("green")]), "all small red"),
        (Statement::AllBut(vec![ones("green")]), "all red"),
        (Statement::Irrelevant("size".to_owned()), "all red"),
        (Statement::Irrelevant("colour".to_owned()), "all small"),
    ];
    for (statement, rule) in rules {
        assert_eq!(best(&told(shown.clone(), std::slice::from_ref(&statement)), 1), rule, "{statement:?}");
    }
}

#[test]
fn the_order_of_showing_and_telling_makes_no_difference() {
    let after =
        told(filling(true), &[Statement::Only(vec![ones("red")]), Statement::Irrelevant("size".to_owned())]);
    for turns in 0..after.examples.len() {
        let mut before = after.clone();
        before.examples.rotate_left(turns);
        for perspective in [0, 1] {
            assert_eq!(learned(&before, perspective), learned(&after, perspective), "{turns}");
        }
    }
}

#[test]
fn all_of_them_are_those_that_the_speaker_knows_of() {
    let known = |known| Description { known: Some(known), ..Description::default() };
    let all = told(filling(false), &[Statement::Also(vec![known(KnownBy::Speaker)])]);
    assert_eq!(best(&all, 1), "all");
    // Nothing was said about the blue one: the robot saw that it was left out.
    assert_ne!(best(&all, 0), "all");
    let hidden = told(filling(false), &[Statement::Also(vec![known(KnownBy::NotSpeaker)])]);
    assert_eq!(best(&hidden, 1), "all");
    assert_eq!(contradictions_of(&language(), &hidden, &[0, 1], 1), [], "they did not see it");
}

#[test]
fn a_speaker_knows_of_the_kinds_that_they_name() {
    let task = told(task_1(), &[Statement::Not(vec![ones("blue")])]);
    assert_eq!((best(&task_1(), 1), best(&task, 1)), ("all".to_owned(), "all but blue".to_owned()));
}

#[test]
fn a_sentence_that_contradicts_a_demonstration_is_found_and_can_prevail() {
    let task = filling(true);
    let find =
        |statement: Statement| contradictions_of(&language(), &told(task.clone(), &[statement]), &[0, 1], 1);
    let found = find(Statement::Not(vec![ones("red")]));
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].kind["colour"].as_str(), found[0].is_told), ("red", false));
    let found = find(Statement::Also(vec![ones("green")]));
    assert_eq!((found[0].kind["colour"].as_str(), found[0].is_told), ("green", true));
    for fitting in [Statement::Only(vec![ones("red")]), Statement::Irrelevant("colour".to_owned())] {
        assert_eq!(find(fitting.clone()), [], "{fitting:?}");
    }
    let mut task = told(task, &[Statement::Also(vec![ones("green")])]);
    assert_eq!(learned(&task, 1).tally(), 1, "of two");
    task.examples[1].telling.as_mut().unwrap().prevails = Some(2);
    assert_eq!((best(&task, 1).as_str(), learned(&task, 1).tally()), ("all", 2));
}

#[test]
fn a_later_sentence_that_prevails_replaces_an_earlier_one() {
    let mut task =
        told(filling(true), &[Statement::Only(vec![ones("red")]), Statement::Also(vec![ones("blue")])]);
    let found = contradictions_of(&language(), &task, &[0, 1], 2);
    assert_eq!(found.len(), 0, "the teacher cannot see the blue one: {found:?}");
    task.examples[2] = Example::told(1, telling(Statement::Also(vec![ones("green")])));
    let found = contradictions_of(&language(), &task, &[0, 1], 2);
    assert_eq!(found.len(), 1, "{found:?}");
    task.examples[2].telling.as_mut().unwrap().prevails = Some(3);
    assert_eq!(best(&task, 1), "all");
}

#[test]
fn a_sentence_is_stored_readably_and_old_examples_are_still_read() {
    let task =
        told(filling(false), &[Statement::Only(vec![ones("red")]), Statement::Irrelevant("size".to_owned())]);
    let text = serde_json::to_string(&task).unwrap();
    assert_eq!(serde_json::from_str::<Task>(&text).unwrap(), task);
    insta::assert_snapshot!(serde_json::to_string(&task.examples[1..]).unwrap());
    let old = serde_json::to_string(&filling(false)).unwrap();
    assert!(!old.contains("telling"), "{old}");
    assert_eq!(serde_json::from_str::<Task>(&old).unwrap(), filling(false));
}

#[test]
fn a_kind_that_was_never_shown_can_be_spoken_of() {
    let task = told(filling(false), &[Statement::Not(vec![ones("yellow")])]);
    assert_eq!(best(&filling(false), 1), "all");
    assert_ne!(best(&task, 1), "all");
    let also = told(filling(true), &[Statement::Also(vec![ones("yellow")])]);
    assert_eq!(best(&also, 1), "all red and yellow");
}

#[test]
fn what_the_teacher_could_not_know_does_not_speak_against_their_sentence() {
    // The robot saw that the blue one was left out.
    let task = told(filling(false), &[Statement::Also(vec![ones("blue")])]);
    assert_eq!((best(&task, 0), learned(&task, 0).tally()), ("all".to_owned(), 2));
}

#[test]
fn a_sentence_prevails_over_what_was_there_when_it_was_confirmed() {
    let mut task = told(filling(true), &[Statement::Not(vec![ones("red")])]);
    task.examples[1].telling.as_mut().unwrap().prevails = Some(2);
    assert_eq!(contradictions_of(&language(), &task, &[0, 1], 1), []);
    task.examples.extend(filling(true).examples);
    let found = contradictions_of(&language(), &task, &[0, 1], 1);
    assert_eq!(found.len(), 1, "the red one was filled once more: {found:?}");
}

#[test]
fn all_of_them_does_not_grow_with_what_is_seen_later() {
    let known = Description { known: Some(KnownBy::Speaker), ..Description::default() };
    let mut task = told(filling(false), &[Statement::Also(vec![known])]);
    task.examples.extend(filling(true).examples);
    assert_eq!(contradictions_of(&language(), &task, &[0, 1], 1), [], "the green one came later");
    assert_eq!(learned(&task, 1).tally(), 3);
}

#[test]
fn after_an_example_is_removed_a_new_one_is_not_overruled() {
    let mut task = told(filling(true), &[Statement::Not(vec![ones("red")])]);
    task.examples.extend(filling(true).examples);
    task.examples[1].telling.as_mut().unwrap().prevails = Some(3);
    assert_eq!(contradictions_of(&language(), &task, &[0, 1], 1), []);
    assert!(task.remove(2).is_some() && task.remove(2).is_none());
    task.examples.extend(filling(true).examples);
    assert_eq!(contradictions_of(&language(), &task, &[0, 1], 1).len(), 1, "the new one was not there then");
}
