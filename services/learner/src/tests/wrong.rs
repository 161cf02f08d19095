//! Faulty demonstrations.

use clock::Duration;
use message::EventKind;
use tasks::Task;

use super::harness::LearnerHarness;

/// The last sentence that Leo said.
fn last_said(run: &LearnerHarness) -> String {
    run.texts(EventKind::Said).pop().unwrap()
}

/// The last sentence with these words.
fn said_with(run: &LearnerHarness, words: &str) -> String {
    let mut said = run.texts(EventKind::Said);
    said.retain(|text| text.contains(words));
    said.pop().unwrap_or_else(|| panic!("nothing is said of {words}"))
}

/// Asserts that Leo asked last, about this thing.
fn assert_asked_about(run: &LearnerHarness, thing: &str) {
    let said = last_said(run);
    assert!(said.contains(thing) && said.ends_with('?'), "{said}");
}

/// A demonstration in which a peg is inserted into one of the blocks.
fn fill_one(run: &mut LearnerHarness, colours: &[&'static str], block: usize) {
    run.lay_anew(colours, None);
    run.say("Leo, I can teach you to do task 1");
    run.insert(0, block);
    run.say("Task 1 is done");
    run.steps(5);
}

#[test]
fn contradicting_demonstrations_are_reported_and_kept() {
    let mut run = LearnerHarness::new(1, Vec::new());
    fill_one(&mut run, &["red", "green"], 0);
    fill_one(&mut run, &["red", "green"], 1);
    let told = said_with(&run, "2 examples: ");
    assert!(told.contains("1 of 2 "), "{told}");
    assert_eq!(run.task("task 1").examples.len(), 2);
    // After a third demonstration one of the two rules prevails.
    fill_one(&mut run, &["red", "green"], 0);
    let told = said_with(&run, "3 examples: ");
    assert!(told.contains("all red filled") && told.contains("2 of 3 "), "{told}");
    insta::assert_snapshot!(run.transcript());
}

#[test]
fn leo_asks_about_counter_examples_once_per_kind() {
    let mut run = LearnerHarness::new(1, Vec::new());
    fill_one(&mut run, &["red", "green"], 0);
    fill_one(&mut run, &["red", "green", "yellow"], 1);
    fill_one(&mut run, &["red", "green", "yellow"], 0);
    // The teacher left out a visible red one and filled a green one.
    assert_asked_about(&run, "a red square");
    run.say("Yes");
    assert_asked_about(&run, "a green square");
    run.say("No");
    assert_eq!(run.task("task 1").examples.len(), 5);
    let said = last_said(&run);
    assert!(said.contains("5 examples: all red filled"), "nothing more is asked: {said}");
    // An answered question is not an object that the teacher could not see.
    let explained = run.texts(EventKind::Explained).pop().unwrap_or_default();
    assert!(!explained.contains("could not see"), "{explained}");
    insta::assert_snapshot!(run.transcript());
}

#[test]
fn counter_example_is_asked_about_without_informative_query() {
    let mut run = LearnerHarness::new(1, Vec::new());
    for _ in 0..3 {
        run.lay_anew(&["red", "red"], None);
        run.say("Leo, I can teach you to do task 1");
        run.insert(0, 0);
        run.insert(1, 1);
        run.say("Task 1 is done");
        run.steps(5);
        assert!(!last_said(&run).ends_with('?'), "{}", last_said(&run));
    }
    fill_one(&mut run, &["red", "red"], 0);
    assert_asked_about(&run, "a square");
    run.say("Yes");
    assert!(last_said(&run).contains("5 examples: "), "{}", last_said(&run));
    insta::assert_snapshot!(run.transcript());
}

#[test]
fn teaching_a_task_again_adds_an_example_and_reports_it() {
    let mut run = LearnerHarness::new(1, Vec::new());
    fill_one(&mut run, &["red", "green"], 0);
    run.say("Leo, I can teach you to do TASK 1!");
    insta::assert_snapshot!(last_said(&run));
}

#[test]
fn a_vanished_object_is_reported_and_the_rest_counts() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.lay_anew(&["red", "green", "blue"], None);
    run.say("Leo, I can teach you to do task 1");
    run.insert(0, 0);
    run.missing = vec![2];
    run.insert(1, 1);
    run.say("Task 1 is done");
    run.steps(5);
    assert!(said_with(&run, "blue square").starts_with("I see no more "));
    insta::assert_snapshot!(run.transcript());
    assert_eq!(run.texts(EventKind::RuleChosen), ["all"]);
    assert_eq!(run.task("task 1").examples.len(), 1);
}

#[test]
fn a_demonstration_without_changes_keeps_what_was_learned() {
    let mut run = LearnerHarness::new(1, Vec::new());
    fill_one(&mut run, &["red", "green"], 0);
    let saved = run.saved.len();
    run.say("Leo, I can teach you to do task 1");
    run.steps(50);
    run.say("Task 1 is done");
    assert!(last_said(&run).starts_with("nothing changed"), "{}", last_said(&run));
    assert_eq!((run.saved.len(), run.task("task 1").examples.len()), (saved, 1));
}

#[test]
fn a_rule_is_learned_from_a_thousand_demonstrations() {
    let mut shown = LearnerHarness::new(1, Vec::new());
    shown.teach();
    let taught = shown.task("task 1");
    let examples = taught.examples.iter().cycle().take(1000).cloned().collect();
    let mut run = LearnerHarness::new(1, vec![Task { name: taught.name.clone(), examples }]);
    run.demonstrate(&["red", "green", "yellow", "red", "blue"], |_| {});
    assert!(said_with(&run, "1001 examples: ").ends_with(": all filled"));
    run.perform(&[]);
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["filled 5 of 5"]);
}

#[test]
fn a_demonstration_counts_only_with_timely_start_and_end() {
    let (soon, late) = (Duration::from_millis(800), Duration::from_millis(1200));
    let mut run = LearnerHarness::new(1, Vec::new());
    run.lay_anew(&["red", "green"], None);
    run.steps(300);
    run.say("Leo, I can teach you to do task 1");
    run.insert(0, 0);
    // The teacher lays the next objects meanwhile, so the current state is not what was demonstrated.
    run.say_late("Task 1 is done", late);
    let mut wording = vec![last_said(&run)];
    assert!(run.saved.is_empty(), "nothing is learned of it");

    run.say_late("Leo, I can teach you to do task 1", late);
    wording.push(last_said(&run));
    run.say("Task 1 is done");
    wording.push(last_said(&run));
    insta::assert_snapshot!(wording.join("\n"));

    run.say_late("Leo, I can teach you to do task 1", soon);
    run.insert(1, 1);
    run.say_late("Task 1 is done", soon);
    assert_eq!(run.task("task 1").examples.len(), 1);
}
