//! What outlives a restart of the belief process or of the learner.

use message::{Event, EventKind};
use tasks::Task;

use super::harness::LearnerHarness;
use super::{kinds, last_high_likelihood};

#[test]
fn each_demonstration_is_saved_as_one_more_example() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    let examples: Vec<(String, usize)> =
        run.saved.iter().map(|(key, task)| (key.clone(), task.examples.len())).collect();
    assert_eq!(examples, [("task 1".to_owned(), 1), ("task 1".to_owned(), 2)]);
}

#[test]
fn a_restarted_learner_performs_a_saved_task() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    let json = serde_json::to_string(&run.saved.last().unwrap().1).unwrap();
    let task: Task = serde_json::from_str(&json).unwrap();
    assert!(task == run.saved.last().unwrap().1, "a number changed on its way through the file");
    let mut later = LearnerHarness::new(1, vec![task]);
    later.perform(&[]);
    assert_eq!(later.texts(EventKind::PerformanceEnded), ["filled 5 of 5"]);
}

#[test]
fn a_demonstration_survives_a_restart_of_the_belief_process() {
    let mut whole = LearnerHarness::new(1, Vec::new());
    whole.teach();
    let mut broken = LearnerHarness::new(1, Vec::new());
    broken.demonstrate(&["red", "green", "yellow", "red", "blue"], |run| {
        run.restart_belief();
        run.steps(100);
    });
    broken.demonstrate(&["green", "yellow", "red", "yellow", "blue"], |_| {});
    assert_eq!(broken.texts(EventKind::ContinuityBroken).len(), 1);
    let hypotheses = |run: &LearnerHarness| {
        let events = run.events.iter().filter(|event| event.kind() == Some(EventKind::Hypothesis));
        events.copied().collect::<Vec<Event>>()
    };
    assert_eq!(hypotheses(&broken), hypotheses(&whole));
    assert_eq!(broken.texts(EventKind::ActionSeen), whole.texts(EventKind::ActionSeen));
}

#[test]
fn a_performance_survives_restarts_of_the_belief_process() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    run.perform_with(&[], |run| {
        for _ in 0..3 {
            run.steps(9);
            run.restart_belief();
            // After the restart nothing is perceived yet: the performance must not end.
            run.missing = (0..12).collect();
            run.steps(20);
            run.missing.clear();
        }
    });
    assert_eq!(run.texts(EventKind::ContinuityBroken).len(), 3);
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["filled 5 of 5"]);
}

#[test]
fn a_demonstration_with_an_object_lost_does_not_count() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.demonstrate(&["red", "green", "yellow", "red", "blue"], |run| {
        run.restart_belief();
        run.missing = vec![2];
        run.steps(300);
    });
    assert_eq!(run.saved, []);
    assert!(!kinds(&run.events).contains(&EventKind::DemonstrationEnded));
    let said = run.texts(EventKind::Said);
    assert!(said.iter().any(|text| text.contains("does not count")), "{said:?}");
}

#[test]
fn the_end_of_a_demonstration_waits_until_its_objects_are_found_again() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.table.borrow_mut().lay(&["red", "green", "blue"], Some(2));
    run.steps(10);
    run.say("Leo, I can teach you to do task 1.");
    run.insert(0, 0);
    run.insert(1, 1);
    run.restart_belief();
    run.missing = vec![0];
    run.say("Task 1 is done");
    run.steps(30);
    assert_eq!(run.saved, []);
    run.missing.clear();
    run.steps(60);
    assert_eq!(run.saved.len(), 1);
    assert_eq!(last_high_likelihood(&run, 1), ["all"]);
}
