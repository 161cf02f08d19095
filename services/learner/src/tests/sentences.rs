//! Sentences of the teacher: names of tasks, questions, corrections, and sentences at the wrong time.

use message::EventKind;

use super::harness::LearnerHarness;

#[test]
fn number_words_and_digits_name_the_same_task() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.lay_anew(&["red", "blue"], Some(1));
    run.say("Leo, I can teach you to do Task One.");
    run.steps(20);
    run.insert(0, 0);
    run.say("task 1 is done");
    run.steps(10);
    run.perform(&[]);
    assert_eq!(run.texts(EventKind::PerformanceStarted), ["Task One"], "the first name stays its name");
    assert_eq!(run.saved.len(), 1);
    assert_eq!(run.saved[0].0, "task 1");
}

#[test]
fn sentences_at_the_wrong_time_are_answered() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.table.borrow_mut().lay(&["red", "blue"], None);
    run.steps(5);
    run.say("What a nice day");
    run.say("Task 1 is done");
    run.say("Leo, do task 1");
    run.say("Leo, I can teach you to do task 1");
    run.say("task 2 is done");
    run.say("task 1 is done");
    run.say("Leo, do task 1");
    let said = run.texts(EventKind::Said);
    assert_eq!(said.len(), 7, "{said:#?}");
    insta::assert_snapshot!(run.transcript());
    assert_eq!(run.saved, []);
    assert!(said[0].contains("Did you mean"), "{}", said[0]);
}

#[test]
fn questions_about_tasks_and_views_are_answered() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.table.borrow_mut().lay(&["red", "blue"], Some(1));
    run.steps(5);
    run.say("What did you learn?");
    run.say("Why?");
    run.say("What do you think I see?");
    run.teach();
    run.say("What did you learn?");
    run.say("Why?");
    insta::assert_snapshot!(run.transcript());
}

#[test]
fn a_hidden_object_beside_a_similar_one_is_described_as_another() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.table.borrow_mut().lay(&["blue", "blue"], Some(1));
    let [x, y, z] = run.table.borrow().things[0].place_m;
    run.table.borrow_mut().things[1].place_m = [x, y + 0.06, z];
    run.steps(5);
    run.say("What do you think I see?");
    let said = run.texts(EventKind::Said);
    let [square] = said.as_slice() else { panic!("{said:?}") };
    assert!(square.contains("7 × peg") && square.ends_with("another square"), "{square}");
    let mut wording = run.transcript();

    let mut run = LearnerHarness::new(1, Vec::new());
    run.table.borrow_mut().lay(&["blue", "red", "red", "blue", "blue"], Some(1));
    run.table.borrow_mut().things.iter_mut().skip(2).take(3).for_each(|thing| thing.hidden = true);
    run.steps(5);
    run.say("What do you think I see?");
    let said = run.texts(EventKind::Said);
    let [squares] = said.as_slice() else { panic!("{said:?}") };
    assert!(squares.ends_with("another 2 × blue square and 2 × red square"), "{squares}");
    wording += &run.transcript();
    insta::assert_snapshot!(wording);
}

#[test]
fn without_perspective_taking_leo_cannot_say_what_others_see() {
    let mut run = LearnerHarness::new(0, Vec::new());
    run.table.borrow_mut().lay(&["red"], None);
    run.steps(5);
    run.say("What do you think I see?");
    assert_eq!(run.texts(EventKind::Said).len(), 1);
    insta::assert_snapshot!(run.transcript());
}

#[test]
fn courtesy_words_do_not_prevent_ending_a_demonstration() {
    for done in ["Hey Leo, Task 1 is done", "Please, task one is done!", "Leo, please: task 1 is done"] {
        let mut run = LearnerHarness::new(1, Vec::new());
        run.lay_anew(&["red", "blue"], Some(1));
        run.say("Leo, I can teach you to do task 1");
        run.insert(0, 0);
        run.say("Hey Leo, task 2 is done");
        let said = run.texts(EventKind::Said).pop().unwrap();
        assert!(said.contains("task 1, not task 2"), "{said}");
        run.say(done);
        run.steps(10);
        assert_eq!(run.task("task 1").examples.len(), 1, "{done}");
    }
    let mut run = LearnerHarness::new(1, Vec::new());
    run.lay_anew(&["red", "blue"], Some(1));
    run.say("Leo, I can teach you to do Please me");
    run.insert(0, 0);
    run.say("Hey Leo, please me is done");
    run.steps(10);
    assert_eq!(run.task("please me").examples.len(), 1);
}

#[test]
fn an_object_rejected_by_the_teacher_is_not_filled() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    run.say("not that one");
    run.perform_with(&[], |run| {
        run.steps(3);
        run.say("No, not that one.");
    });
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["filled 4 of 5"]);
    insta::assert_snapshot!(run.transcript());
}

#[test]
fn a_correction_adds_an_example() {
    // Leo alone learns to leave the blue ones out; then it is shown that they are meant, too.
    let mut run = LearnerHarness::new(0, Vec::new());
    run.teach();
    run.perform(&[]);
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["filled 3 of 3"]);
    run.say("No");
    run.say("No, like this");
    run.insert(5, 0);
    run.insert(6, 3);
    run.say("Task 1 is done");
    run.steps(10);
    assert_eq!(run.saved.last().unwrap().1.examples.len(), 3);
    let said = run.texts(EventKind::Said);
    assert!(said.iter().any(|text| text.starts_with("what is wrong?")), "{said:?}");
    // One demonstration against two leaves the goal ambiguous.
    assert!(said.last().unwrap().starts_with("Should a "), "{said:?}");
    run.say("Yes");
    assert_eq!(run.saved.last().unwrap().1.examples.len(), 4);
}

#[test]
fn praise_after_a_performance_is_acknowledged() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    run.perform(&[]);
    run.say("Yes");
    assert!(run.texts(EventKind::Said).last().unwrap().starts_with("good"));
}
