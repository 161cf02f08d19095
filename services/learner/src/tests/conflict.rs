//! Conflicts between the rules from Leo's own view and from the teacher's perspective.

use message::EventKind;
use tasks::{HypothesisLanguage, OnConflict, Settings};

use super::harness::LearnerHarness;

/// The perspective followed last, its rule, and the explanation of the difference.
fn outcome(run: &LearnerHarness) -> (Option<u16>, String, String) {
    let chosen = run.events.iter().rfind(|event| event.kind() == Some(EventKind::RuleChosen));
    let last = |kind| run.texts(kind).pop().unwrap_or_default();
    (chosen.map(|event| event.perspective), last(EventKind::RuleChosen), last(EventKind::Explained))
}

/// The last `count` sentences that Leo said.
fn said(run: &LearnerHarness, count: usize) -> Vec<String> {
    let mut said = run.texts(EventKind::Said);
    said.split_off(said.len() - count)
}

/// Task 1 is demonstrated twice as in the paper, and then once with a red one left out that the teacher sees.
fn with_a_slip(on_conflict: OnConflict) -> LearnerHarness {
    let mut run = LearnerHarness::with(1, Vec::new(), on_conflict);
    run.teach();
    slip(&mut run);
    run
}

fn slip(run: &mut LearnerHarness) {
    run.lay_anew(&["green", "yellow", "red", "blue"], Some(3));
    run.say("Leo, I can teach you to do task 1");
    run.steps(20);
    run.insert(0, 0);
    run.insert(1, 1);
    run.say("Task 1 is done");
    run.steps(10);
}

#[test]
fn with_conflict_own_leo_follows_its_view_and_names_the_teachers_rule() {
    let mut run = LearnerHarness::with(1, Vec::new(), OnConflict::Own);
    run.teach();
    let (followed, rule, why) = outcome(&run);
    assert_eq!((followed, rule.as_str()), (Some(0), "all but blue"));
    assert!(why.contains("\"all filled\"") && why.contains("blue square"), "{why}");
    assert_eq!((said(&run, 1), run.task("task 1").examples.len()), (vec![why.clone()], 2));
    run.perform(&[]);
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["filled 3 of 3"]);
    run.say("Why?");
    let [because] = <[String; 1]>::try_from(said(&run, 1)).unwrap();
    assert!(because.contains("\"all but blue filled\"") && because.contains("2 of 2"), "{because}");
    assert!(because.ends_with(&why), "{because}");
    insta::assert_snapshot!(run.transcript());
}

#[test]
fn an_explained_conflict_is_resolved_for_the_teacher_and_explained() {
    let mut run = LearnerHarness::with(1, Vec::new(), OnConflict::Resolve);
    run.teach();
    let (followed, rule, why) = outcome(&run);
    assert_eq!((followed, rule.as_str()), (Some(1), "all"));
    assert!(why.contains("\"all but blue\"") && why.contains("blue square"), "{why}");
    assert_eq!((said(&run, 1), run.task("task 1").examples.len()), (vec![why], 2));
    insta::assert_snapshot!(run.transcript());
    run.perform(&[]);
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["filled 5 of 5"]);
}

#[test]
fn by_default_leo_follows_the_teacher_and_asks_about_contradictions() {
    let mut run = with_a_slip(OnConflict::Human);
    assert_eq!(outcome(&run).1, "all");
    let [asked] = <[String; 1]>::try_from(said(&run, 1)).unwrap();
    assert!(asked.contains("red square") && asked.ends_with('?'), "{asked}");
    run.perform(&[]);
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["filled 5 of 5"]);
}

#[test]
fn open_conflict_asks_and_follows_the_earlier_decision() {
    let mut run = with_a_slip(OnConflict::Resolve);
    let [unsure, until_then, asked] = <[String; 3]>::try_from(said(&run, 3)).unwrap();
    assert!(unsure.ends_with(&outcome(&run).2), "{unsure}");
    assert!(until_then.contains("2 examples: all filled"), "{until_then}");
    assert!(asked.contains("red square") && asked.ends_with('?'), "{asked}");
    run.say("What did you learn?");
    assert!(said(&run, 1)[0].ends_with(": all filled"), "{:?}", said(&run, 1));
    run.perform(&[]);
    assert_eq!(said(&run, 1), [until_then]);
    assert_eq!(run.texts(EventKind::PerformanceEnded), ["filled 5 of 5"]);
    // The question is still open: "Why?" repeats it, and it may be answered then.
    run.say("Why?");
    assert_eq!(said(&run, 2), [unsure, asked]);
    insta::assert_snapshot!(run.transcript());
    run.say("Yes");
    assert_eq!(run.task("task 1").examples.len(), 4);
    assert_eq!(outcome(&run).0, Some(1));
}

#[test]
fn answer_decides_which_schema_is_followed() {
    let decided = |answer: &str| {
        let mut run = with_a_slip(OnConflict::Resolve);
        run.say(answer);
        let (followed, rule, why) = outcome(&run);
        run.perform(&[]);
        (followed, rule, why, run.texts(EventKind::PerformanceEnded).pop().unwrap())
    };
    let (followed, rule, why, done) = decided("Yes");
    assert_eq!((followed, rule.as_str(), done.as_str()), (Some(1), "all", "filled 5 of 5"));
    assert!(["\"all but blue\"", "blue square", "red square"].iter().all(|word| why.contains(word)), "{why}");
    let yes = why;
    let (followed, rule, why, done) = decided("No");
    assert_eq!((followed, rule.as_str(), done.as_str()), (Some(0), "all green and yellow", "filled 2 of 2"));
    assert!(why.contains("\"all filled\""), "{why}");
    insta::assert_snapshot!(format!("Yes: {yes}\nNo: {why}"));
}

#[test]
fn without_a_previous_rule_leo_declines_and_asks_again() {
    let mut run = LearnerHarness::with(1, Vec::new(), OnConflict::Resolve);
    run.lay_anew(&["red", "yellow"], Some(1));
    run.say("Leo, I can teach you to do task 1");
    run.steps(20);
    run.insert(0, 0);
    run.insert(1, 1);
    // The yellow one becomes visible to the teacher after it was filled.
    run.table.borrow_mut().things[1].hidden = false;
    run.steps(20);
    run.say("Task 1 is done");
    run.steps(10);
    let [asked] = <[String; 1]>::try_from(said(&run, 1)).unwrap();
    assert!(asked.contains("yellow square") && asked.ends_with('?'), "{asked}");
    assert_eq!(run.texts(EventKind::RuleChosen), [""; 0]);
    run.say("Leo, do task 1");
    let [declined, again] = <[String; 2]>::try_from(said(&run, 2)).unwrap();
    assert_eq!((again, run.texts(EventKind::Declined).len()), (asked, 1));
    run.say("What did you learn?");
    assert_eq!(said(&run, 1), [declined]);
    insta::assert_snapshot!(run.transcript());
    run.say("Yes");
    assert_eq!(run.texts(EventKind::RuleChosen), ["all"]);
}

#[test]
fn objects_left_out_of_a_number_need_no_explanation() {
    for on_conflict in [OnConflict::Human, OnConflict::Resolve] {
        let settings =
            Settings { on_conflict, language: HypothesisLanguage::Extended, ..Settings::default() };
        let mut run = LearnerHarness::learning(1, Vec::new(), settings);
        let showings: [(&[&str], &[usize]); 2] = [
            (&["red", "red", "green", "yellow", "blue"], &[0, 2, 3]),
            (&["green", "yellow", "yellow", "red", "red", "blue"], &[0, 1, 3, 4]),
        ];
        for (colours, filled) in showings {
            run.lay_anew(colours, Some(colours.len() - 1));
            run.say("Leo, I can teach you to do task 1");
            run.steps(20);
            (0..).zip(filled).for_each(|(peg, &block)| run.insert(peg, block));
            run.say("Task 1 is done");
            run.steps(10);
        }
        let (followed, rule, why) = outcome(&run);
        assert_eq!((followed, rule.as_str()), (Some(1), "all but one"), "{on_conflict:?}");
        assert!(why.contains("\"all but two\"") && why.contains("blue square"), "{on_conflict:?}: {why}");
        assert!(
            !["red", "green", "yellow"].iter().any(|colour| why.contains(colour)),
            "{on_conflict:?}: {why}"
        );
    }
}

#[test]
fn every_conflict_policy_gives_one_result_if_both_views_agree() {
    let taught = |on_conflict| {
        let mut run = LearnerHarness::with(1, Vec::new(), on_conflict);
        run.hidden_from = Some(2);
        run.teach();
        run.events
    };
    let human = taught(OnConflict::Human);
    for on_conflict in [OnConflict::Own, OnConflict::Resolve] {
        assert!(taught(on_conflict) == human, "{on_conflict:?}");
    }
}
