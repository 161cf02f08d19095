//! Leo obeys a stop of every partner, and no example is lost.

use message::EventKind;
use motion::Skill;

use super::harness::LearnerHarness;

#[test]
fn stop_is_obeyed_at_once_for_every_speaker() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    run.perform_with(&[], |run| {
        run.steps(3);
        run.say("Stop!");
        assert!(!run.learner.is_performing());
        assert_eq!(run.table.borrow().skills.last(), Some(&Skill::Hold));
    });
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["stopped: filled 0"]);
}

#[test]
fn stop_is_obeyed_while_objects_are_unidentified() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    run.perform_with(&[], |run| {
        run.steps(3);
        run.restart_belief();
        run.missing = (0..12).collect();
        run.say("Leo, stop!");
        assert!(!run.learner.is_performing());
        assert_eq!(run.table.borrow().skills.last(), Some(&Skill::Hold));
    });
}

#[test]
fn a_task_requested_before_stop_does_not_begin_after_it() {
    let mut at_once = LearnerHarness::new(1, Vec::new());
    at_once.teach();
    at_once.lay_anew(&["red", "green"], None);
    at_once.say_at_once(&["Leo, do task 1", "Stop!"]);
    let mut queued = LearnerHarness::new(1, Vec::new());
    queued.teach();
    queued.lay_anew(&["red", "green"], None);
    queued.restart_belief();
    queued.say("Leo, do task 1");
    queued.steps(5);
    queued.say("Stop!");
    for mut run in [at_once, queued] {
        run.steps(300);
        assert_eq!(run.table.borrow().skills.last(), Some(&Skill::Hold));
        assert_eq!(run.texts(EventKind::PerformanceStarted), [""; 0]);
        let told = "I do not begin task 1: you said stop";
        assert!(run.texts(EventKind::Said).ends_with(&["I hold still".to_owned(), told.to_owned()]));
        assert_eq!(run.texts(EventKind::Declined), [told], "whoever waits for the performance waits no more");
        // A request after the stop is performed, even if it comes in the same step.
        run.say_at_once(&["Stop!", "Leo, do task 1"]);
        assert!(run.learner.is_performing());
    }
}

#[test]
fn demonstrations_before_stop_count_and_the_requested_task_may_be_corrected() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    run.lay_anew(&["red", "green"], None);
    run.say("Leo, I can teach you to do task 2");
    run.insert(0, 0);
    run.restart_belief();
    run.say("Task 2 is done");
    run.say("Leo, do task 1");
    run.say("Stop!");
    run.steps(200);
    assert_eq!(run.task("task 2").examples.len(), 1);
    assert_eq!(run.texts(EventKind::PerformanceStarted), [""; 0]);

    run.say_at_once(&["Leo, do task 1", "Stop!"]);
    run.say("No, like this");
    assert_eq!(run.texts(EventKind::TeachingStarted).last().map(String::as_str), Some("task 1"));
    insta::assert_snapshot!(run.texts(EventKind::Said).pop().unwrap());
}

/// Leo performs task 1 during a demonstration of task 2, until two holes are filled.
fn a_task_in_a_task() -> LearnerHarness {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    run.lay_anew(&["red", "green", "yellow", "red"], None);
    run.say("Leo, I can teach you to do task 2");
    run.say("Leo, do task 1");
    for _ in 0..500 {
        if run.texts(EventKind::StepDone).len() == 2 {
            break;
        }
        run.steps(1);
    }
    assert_eq!(run.table.borrow().filled().len(), 2);
    run
}

/// The executables of a task's last example in the robot's own view: the actor, the task and the number of holes.
fn deeds_of(run: &LearnerHarness, task: &str) -> Vec<(u16, Option<String>, usize)> {
    let task = run.task(task);
    let filled = tasks::Effect::State { name: "filled".to_owned(), on: true };
    let executables = &task.examples.last().unwrap().view(0).unwrap().executables;
    let holes = |done: &tasks::Executable| {
        done.changes.values().filter(|change| change.signature.contains(&filled)).count()
    };
    executables.iter().map(|done| (done.actor, done.task.clone(), holes(done))).collect()
}

#[test]
fn actions_of_leo_before_a_stop_are_attributed_to_leo() {
    let leos = || (0, Some("task 1".to_owned()), 2);
    let mut run = a_task_in_a_task();
    run.say("Stop!");
    run.insert(5, 3);
    run.say("Task 2 is done");
    run.steps(10);
    assert_eq!(deeds_of(&run, "task 2"), [leos(), (1, None, 1)]);
    let acts = run.texts(EventKind::ActionSeen);
    assert!(acts[acts.len() - 2].starts_with("I: "), "{acts:?}");

    // The same after a restart of the belief process, and if the demonstration ends first.
    for sentences in [&["Stop!", "Task 2 is done"][..], &["Task 2 is done"]] {
        let mut run = a_task_in_a_task();
        run.restart_belief();
        run.say_at_once(sentences);
        run.steps(100);
        assert_eq!(deeds_of(&run, "task 2"), [leos()], "{sentences:?}");
    }
}
