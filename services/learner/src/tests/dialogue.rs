//! Sentences of a naive teacher: a lesson without reading anything, questions back, names, and forgetting.

use message::EventKind;
use motion::Skill;

use super::harness::LearnerHarness;

fn said(run: &LearnerHarness) -> String {
    run.texts(EventKind::Said).pop().unwrap_or_default()
}

/// What Leo says to a sentence.
fn reply(run: &mut LearnerHarness, text: &str) -> String {
    let before = run.texts(EventKind::Said).len();
    run.say(text);
    run.texts(EventKind::Said).split_off(before).join(" | ")
}

fn keys(run: &LearnerHarness) -> Vec<&str> {
    run.known.keys().map(String::as_str).collect()
}

#[test]
fn a_naive_teacher_teaches_a_task_and_names_it() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.lay_anew(&["red", "green"], None);
    let mut wording = Vec::new();
    for text in ["hello", "help", "watch me", "watch this", "help", "this is called filling"] {
        wording.push(format!("{text}\n    {}", reply(&mut run, text)));
    }
    run.insert(0, 0);
    run.insert(1, 1);
    run.say("I'm done");
    run.steps(5);
    assert_eq!(keys(&run), ["filling"]);
    for text in [
        "help",
        "thank you",
        "well done",
        "which tasks do you know?",
        "what is filling?",
        "how sure are you?",
    ] {
        wording.push(format!("{text}\n    {}", reply(&mut run, text)));
    }
    for text in
        ["what now?", "what would settle it?", "only the red ones", "what did you learn about dancing", "bye"]
    {
        wording.push(format!("{text}\n    {}", reply(&mut run, text)));
    }
    insta::assert_snapshot!(wording.join("\n"));
}

#[test]
fn questions_about_objects_are_answered_from_both_views() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.lay_anew(&["red", "blue"], Some(1));
    let mut wording = Vec::new();
    for text in [
        "what do you see?",
        "do you know where the blue square is?",
        "is there a green square?",
        "can I see the blue square?",
        "do I know about the red square?",
        "what do you think I know?",
    ] {
        wording.push(format!("{text}\n    {}", reply(&mut run, text)));
    }
    assert!(wording[3].contains("not know"), "{wording:#?}");
    insta::assert_snapshot!(wording.join("\n"));
}

#[test]
fn a_question_back_is_done_only_after_yes() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    run.lay_anew(&["red", "green"], None);
    for (text, answer, performs) in [
        ("can you do task 1?", "no", false),
        ("can you do task 1?", "what do you see?", false),
        ("I will do task 1 myself", "nope", false),
        ("can you do task 1?", "yes", true),
    ] {
        let asked = reply(&mut run, text);
        assert!(asked.contains('?') && !run.learner.is_performing(), "{text}: {asked}");
        run.say(answer);
        assert_eq!(run.learner.is_performing(), performs, "{text}: {answer}");
    }
    run.say("stop");
    run.say("yes");
    assert!(!run.learner.is_performing(), "the proposal ended with the next sentence");
}

#[test]
fn an_unknown_sentence_is_never_answered_with_a_list() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    for text in
        ["what a nice day", "asdf qwer", "my cat is called Tom", "do not do task 1", "how do you do it?"]
    {
        let answer = reply(&mut run, text);
        assert_eq!(answer.matches('"').count(), 4, "one sentence is quoted back, and one proposed: {answer}");
    }
    assert_eq!(run.texts(EventKind::PerformanceStarted), [""; 0]);
}

#[test]
fn tasks_are_renamed_and_forgotten_also_in_the_store() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    run.say("rename task 1 to filling");
    assert_eq!(run.texts(EventKind::Renamed), ["filling"]);
    assert_eq!(keys(&run), ["filling"]);
    assert_eq!(run.known["filling"].name, "filling");
    assert_eq!(run.known["filling"].examples.len(), 2);
    run.say("undo the last step");
    assert_eq!(run.known["filling"].examples.len(), 2, "it is asked first");
    run.say("yes");
    assert_eq!(run.known["filling"].examples.len(), 1);
    run.say("forget filling");
    run.say("no");
    assert_eq!(keys(&run), ["filling"]);
    run.say("forget it completely");
    run.say("please forget filling");
    run.say("yes");
    assert_eq!(keys(&run), [""; 0]);
    assert_eq!(run.learner.known().count(), 0);
    assert_eq!(run.texts(EventKind::Forgotten), ["filling"]);
    assert!(reply(&mut run, "do filling").contains("nothing yet"));
    insta::assert_snapshot!(run.texts(EventKind::Said).split_off(2).join("\n"));
}

#[test]
fn a_cancelled_demonstration_does_not_count() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.lay_anew(&["red", "green"], None);
    run.say("let me show you filling");
    run.insert(0, 0);
    run.say("never mind");
    run.say("I'm done");
    assert_eq!(keys(&run), [""; 0]);
    assert!(said(&run).contains("no demonstration has begun"), "{}", said(&run));
}

#[test]
fn words_that_could_mean_stop_hold_a_moving_robot_still() {
    for text in [
        "wait",
        "wait a moment",
        "enough",
        "freeze",
        "cancel",
        "don't do that",
        "no",
        "hold on",
        "stpo",
        "No, that's wrong!",
    ] {
        let mut run = LearnerHarness::new(1, Vec::new());
        run.teach();
        run.perform_with(&[], |run| {
            run.steps(3);
            run.say(text);
            assert!(!run.learner.is_performing(), "{text}");
            assert_eq!(run.table.borrow().skills.last(), Some(&Skill::Hold), "{text}");
        });
        assert_eq!(run.saved.len(), 2, "{text}: no answer to a question");
    }
}

#[test]
fn a_word_that_could_mean_stop_drops_a_request_before_it() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    run.lay_anew(&["red", "green"], None);
    run.say_at_once(&["could you do task 1?", "no, wait"]);
    run.steps(50);
    assert_eq!(run.texts(EventKind::PerformanceStarted), [""; 0]);
    assert_eq!(run.texts(EventKind::Declined).len(), 1);
}

#[test]
fn a_stopped_task_goes_on_when_told_to() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    run.perform_with(&[], |run| {
        run.steps(3);
        run.say("don't stop");
        assert!(run.learner.is_performing());
        run.say("wait a moment");
        run.say("don't stop");
        assert!(!run.learner.is_performing(), "it is asked first");
        run.say("go on");
        assert!(run.learner.is_performing());
    });
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["stopped: filled 0", "filled 5 of 5"]);
    run.say("go on");
    assert!(!run.learner.is_performing(), "nothing was stopped since");
    run.lay_anew(&["red", "green"], None);
    run.say("once more");
    assert!(run.learner.is_performing());
}
