//! Tests of the learner with simulated beliefs and a body whose every skill takes five steps.

mod asking;
mod conflict;
mod dialogue;
mod harness;
mod recovery;
mod sentences;
mod stop;
mod telling;
mod wrong;

use message::{Event, EventKind};
use motion::{Face, Skill};

use self::harness::LearnerHarness;

fn kinds(events: &[Event]) -> Vec<EventKind> {
    events.iter().map(|event| event.kind().unwrap()).collect()
}

fn last_high_likelihood(run: &LearnerHarness, perspective: u16) -> Vec<String> {
    let last =
        run.events.iter().rposition(|event| event.kind() == Some(EventKind::DemonstrationEnded)).unwrap();
    run.events[last..]
        .iter()
        .filter(|event| event.kind() == Some(EventKind::Hypothesis))
        .filter(|event| event.perspective == perspective && event.high_likelihood == 1)
        .map(|event| event.text.as_str().to_owned())
        .collect()
}

#[test]
fn leo_learns_the_teachers_rule_explains_it_and_fills_every_hole() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    assert_eq!(last_high_likelihood(&run, 0), ["all but blue"]);
    assert_eq!(last_high_likelihood(&run, 1), ["all"]);
    assert_eq!(run.texts(EventKind::RuleChosen), ["all", "all"]);
    let explained = run.texts(EventKind::Explained);
    assert!(explained.iter().all(|text| text.contains("blue square")), "{explained:?}");
    assert_eq!(explained.len(), 2);
    assert_eq!(run.texts(EventKind::ActionSeen).len(), 8, "four pegs in each demonstration");
    run.perform(&[]);
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["filled 5 of 5"]);
    assert_eq!(run.texts(EventKind::StepDone)[1], "red square filled");
    assert_eq!(run.table.borrow().filled().len(), 5);
    assert_eq!(run.texts(EventKind::StepFailed), [""; 0]);
    insta::assert_snapshot!(run.transcript());
}

#[test]
fn each_demonstration_counts_in_its_own_teachers_view() {
    let mut wording = Vec::new();
    for teachers in [[1, 2], [2, 1]] {
        let mut run = LearnerHarness::new(2, Vec::new());
        let sets = [["red", "green", "yellow", "red", "blue"], ["green", "yellow", "red", "yellow", "blue"]];
        for (teacher, colours) in teachers.into_iter().zip(sets) {
            // The other teacher sees the blue one.
            run.hidden_from = Some(teacher);
            run.demonstrate_as(u32::from(teacher), &colours, |_| {});
        }
        assert_eq!(run.texts(EventKind::RuleChosen), ["all", "all"], "{teachers:?}");
        let chosen = run.events.iter().filter(|event| event.kind() == Some(EventKind::RuleChosen));
        assert_eq!(chosen.map(|event| event.perspective).collect::<Vec<_>>(), teachers);
        let explained = run.texts(EventKind::Explained);
        assert!(explained.iter().all(|text| text.contains("blue square")), "{explained:?}");
        // The last teacher is addressed as such.
        assert!(explained.len() == 2 && explained[0].contains("you ") && !explained[1].contains("you "));
        wording.push(explained);
        run.perform(&[]);
        assert_eq!(run.texts(EventKind::PerformanceEnded), ["filled 5 of 5"]);
    }
    assert_eq!(wording[0], wording[1]);
    insta::assert_snapshot!(wording[0].join("\n"));
}

#[test]
fn demonstration_of_an_unsimulated_teacher_uses_the_robots_view() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.demonstrate_as(2, &["red", "green", "yellow", "red", "blue"], |_| {});
    run.demonstrate(&["green", "yellow", "red", "yellow", "blue"], |_| {});
    assert_eq!(run.texts(EventKind::RuleChosen), ["all but blue", "all but blue"]);
    let chosen = run.events.iter().filter(|event| event.kind() == Some(EventKind::RuleChosen));
    assert_eq!(chosen.map(|event| event.perspective).collect::<Vec<_>>(), [0, 1]);
}

#[test]
fn without_perspective_taking_leo_leaves_the_blue_ones_out() {
    let mut run = LearnerHarness::new(0, Vec::new());
    run.teach();
    assert_eq!(run.texts(EventKind::RuleChosen), ["all but blue", "all but blue"]);
    assert_eq!(run.texts(EventKind::Explained), [""; 0]);
    run.perform(&[]);
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["filled 3 of 3"]);
    assert_eq!(run.table.borrow().filled(), ["red", "green", "yellow"]);
}

#[test]
fn a_demonstration_begins_with_what_each_can_see() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    let seen: Vec<(u16, bool)> = run
        .events
        .iter()
        .filter(|event| event.kind() == Some(EventKind::Seen))
        .map(|event| (event.perspective, event.text.as_str().contains("blue square")))
        .collect();
    assert_eq!(seen, [(0, true), (1, false), (0, true), (1, false)]);
}

#[test]
fn an_action_event_names_the_actor_and_the_change() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.demonstrate(&["red", "green", "blue"], |_| {});
    let acts = run.texts(EventKind::ActionSeen);
    assert!(["teacher", "red square", "peg"].iter().all(|word| acts[0].contains(word)), "{acts:?}");
}

#[test]
fn a_movement_like_leos_own_is_reported_before_its_act_completes() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.demonstrate(&["red", "green", "blue"], |_| {});
    let (movements, acts) = (run.texts(EventKind::MovementSeen), run.texts(EventKind::ActionSeen));
    assert_eq!(movements.len(), acts.len());
    assert!(["teacher", "red square", "peg"].iter().all(|word| movements[0].contains(word)), "{movements:?}");
    insta::assert_snapshot!(run.transcript());
    let watched = [EventKind::MovementSeen, EventKind::ActionSeen];
    let watched: Vec<_> = kinds(&run.events).into_iter().filter(|kind| watched.contains(kind)).collect();
    assert!(watched.chunks(2).all(|both| both == [EventKind::MovementSeen, EventKind::ActionSeen]));
}

#[test]
fn pushing_an_object_is_not_reported_as_a_movement() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.table.borrow_mut().lay(&["red", "green"], None);
    run.steps(20);
    run.say("Leo, I can teach you to do rows.");
    run.steps(20);
    run.table.borrow_mut().things[0].held_by = 1;
    for _ in 0..40 {
        run.table.borrow_mut().things[0].place_m[0] += 0.005;
        run.steps(1);
    }
    run.table.borrow_mut().things[0].held_by = message::NOBODY;
    run.steps(50);
    assert_eq!(run.texts(EventKind::MovementSeen), [""; 0]);
    let acts = run.texts(EventKind::ActionSeen);
    assert!(acts.len() == 1 && acts[0].contains("red square"), "{acts:?}");
    insta::assert_snapshot!(run.transcript());
}

#[test]
fn learning_a_task_without_a_matching_skill_reports_the_missing_skill() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.table.borrow_mut().lay(&["red", "green"], None);
    run.table.borrow_mut().things.iter_mut().take(2).for_each(|thing| thing.shape = "cylinder");
    run.steps(20);
    run.say("Leo, I can teach you to do lights.");
    run.steps(20);
    for button in 0..2 {
        run.table.borrow_mut().things[button].on = true;
        run.steps(50);
    }
    run.say("Lights is done!");
    run.steps(10);
    assert_eq!(run.task("lights").examples.len(), 1);
    assert!(run.texts(EventKind::Said).last().unwrap().contains("no skill"));
    run.table.borrow_mut().things[0].on = false;
    run.steps(50);
    run.say("Leo, do lights.");
    run.steps(200);
    let failed = run.texts(EventKind::StepFailed);
    assert!(failed.len() == 1 && failed[0].starts_with("red cylinder: "), "{failed:?}");
    insta::assert_snapshot!(run.transcript());

    // No sentence about skills if Leo can perform the task.
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    assert!(run.texts(EventKind::Said).iter().all(|said| !said.contains("no skill")));
}

#[test]
fn a_step_is_tried_again_and_given_up_in_the_end() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    run.perform(&["red", "red", "green", "green", "green"]);
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["filled 4 of 5"]);
    let failed = run.texts(EventKind::StepFailed);
    assert!(failed.len() == 1 && failed[0].starts_with("green square: "), "{failed:?}");
    insta::assert_snapshot!(run.transcript());
    assert_eq!(run.table.borrow().filled(), ["blue", "red", "blue", "yellow"]);
    let inserts =
        run.table.borrow().skills.iter().filter(|skill| matches!(skill, Skill::Insert { .. })).count();
    // Red succeeds at the third attempt, green is given up after three, and the other three succeed at once.
    let (red, green, others) = (3, 3, 3);
    assert_eq!(inserts, red + green + others);
}

#[test]
fn a_task_without_matching_objects_is_declined() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.teach();
    let mut perform = |colours: &[&'static str], filled: bool| {
        run.lay_anew(colours, None);
        for thing in run.table.borrow_mut().things.iter_mut().take(colours.len()) {
            thing.on = filled;
        }
        run.steps(10);
        run.say("Leo, do task 1");
        run.steps(10);
        let face = run.table.borrow().skills.last().copied();
        (run.texts(EventKind::PerformanceEnded).pop().unwrap(), face)
    };
    let nothing = "nothing to do: I see nothing that \"all filled\" is about".to_owned();
    assert_eq!(perform(&[], false), (nothing, Some(Skill::Show(Face::Puzzled))));
    let done = "nothing to do: everything is filled".to_owned();
    assert_eq!(perform(&["red", "blue"], true), (done, Some(Skill::Show(Face::Pleased))));
}

#[test]
fn joint_goals_are_published_at_goal_rate_while_idle() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.steps(100);
    assert_eq!(run.goal_frames, 50);
}

#[test]
fn the_same_input_gives_the_same_output() {
    let run = || {
        let mut run = LearnerHarness::new(1, Vec::new());
        run.teach();
        run.perform(&["red"]);
        (run.events, run.saved)
    };
    assert_eq!(run(), run());
}
