//! Leo asks about an ambiguous demonstration, and the answer becomes an example.

use message::EventKind;

use super::harness::LearnerHarness;

/// A demonstration after which either the red ones or the triangles may be meant.
fn ambiguous() -> LearnerHarness {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.table.borrow_mut().lay(&["red", "blue"], None);
    run.table.borrow_mut().things[0].shape = "triangle";
    run.steps(10);
    run.say("Leo, I can teach you to do task 1");
    run.insert(0, 0);
    run.say("Task 1 is done");
    run.steps(5);
    run
}

#[test]
fn an_answer_is_not_counted_as_a_demonstration() {
    let mut run = ambiguous();
    run.say("Yes");
    assert_eq!(run.saved.last().unwrap().1.examples.len(), 2);
    assert_eq!(run.texts(EventKind::DemonstrationEnded), ["task 1"]);
    assert_eq!(run.texts(EventKind::Answered), ["yes"]);
}

#[test]
fn an_ambiguous_demonstration_is_asked_about_and_the_answer_counts() {
    let rule = |answer: &str| {
        let mut run = ambiguous();
        let asked = run.texts(EventKind::Said).pop().unwrap();
        assert!(asked.starts_with("Should a ") && asked.ends_with(" be filled, too?"), "{asked}");
        run.say(answer);
        assert_eq!(run.saved.last().unwrap().1.examples.len(), 2);
        let about_red = asked.contains("red square");
        (about_red, run.texts(EventKind::RuleChosen).pop().unwrap())
    };
    let (about_red, yes) = rule("Yes");
    assert_eq!(yes, if about_red { "all red" } else { "all triangle" });
    let (_, no) = rule("No.");
    assert!(no != yes, "{no}");
}

#[test]
fn a_yes_after_a_performance_does_not_answer_an_earlier_question() {
    let mut run = ambiguous();
    run.say("Leo, do task 1");
    for _ in 0..100 {
        run.steps(50);
        if !run.learner.is_performing() {
            break;
        }
    }
    run.say("Yes");
    assert_eq!(run.saved.last().unwrap().1.examples.len(), 1);
    assert!(run.texts(EventKind::Said).last().unwrap().starts_with("good"));
}

#[test]
fn answer_is_attributed_to_the_last_teacher() {
    let mut run = ambiguous();
    run.say_as(2, "Yes");
    let teachers: Vec<u16> =
        run.saved.last().unwrap().1.examples.iter().map(|example| example.teacher).collect();
    assert_eq!(teachers, [1, 1]);
}

#[test]
fn an_unanswered_question_is_dropped_when_a_demonstration_begins() {
    let mut run = ambiguous();
    run.say("Leo, I can teach you to do task 1");
    run.say("Yes");
    assert_eq!(run.saved.last().unwrap().1.examples.len(), 1);
}

#[test]
fn only_the_next_sentence_answers_a_question() {
    for between in ["Leo, do task too", "What a nice day", "Task 2 is done", "not that one", "Stop!"] {
        let mut run = ambiguous();
        run.say(between);
        run.say("No!");
        assert_eq!(run.task("task 1").examples.len(), 1, "after {between:?}");
        let said = run.texts(EventKind::Said).pop().unwrap();
        // To a sentence that is not understood Leo asks back, and "no" answers that.
        let is_dropped = said.starts_with("what is wrong?") || said.starts_with("all right");
        assert!(is_dropped, "after {between:?}: {said}");
    }
}

#[test]
fn counter_question_keeps_the_question_open() {
    let mut run = ambiguous();
    for back in ["Why?", "What did you learn?", "What do you think I see?"] {
        run.say(back);
        assert_eq!(run.task("task 1").examples.len(), 1);
    }
    run.say("No");
    assert_eq!(run.task("task 1").examples.len(), 2);
}
