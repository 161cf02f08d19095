//! `leo study`, with the real processes.

use serde_json::Value;

use crate::harness::{read, run_leo, write};

#[test]
fn the_study_agrees_with_the_paper_in_every_cell() {
    let output = run_leo(&["study", "--json"]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    let study: Value = serde_json::from_str(&output.out).expect("is JSON");
    let cells = study.pointer("/cells").and_then(Value::as_array).expect("a list");
    assert_eq!(cells.len(), 8);
    for cell in cells {
        assert_eq!(cell.pointer("/differs"), Some(&Value::Array(Vec::new())), "{cell}");
    }
    let tests = study.pointer("/chi_square").and_then(Value::as_array).expect("a list");
    assert!(tests.iter().all(|test| test.pointer("/p").and_then(Value::as_f64).is_some_and(|p| p < 0.001)));
}

/// The task learned from a lesson, with an optional change of `leo.toml`.
fn task(lesson: &str, change: Option<(&str, &str)>) -> Value {
    let files = tempfile::tempdir().expect("a folder");
    let mut arguments = vec!["teach", lesson, "--json"];
    let config = change.map(|(from, to)| {
        let config = read("config/leo.toml").replace(from, to);
        assert!(config.contains(to), "{from} is not in leo.toml");
        write(&files, "leo.toml", &config)
    });
    arguments.extend(config.iter().flat_map(|config| ["--config", config.as_str()]));
    let output = run_leo(&arguments);
    // A lesson reports which settings it needs.
    let robot = config::Robot::load(config.as_deref().map(std::path::Path::new)).expect("a configuration");
    let needs = config::lesson::Lesson::load(lesson.as_ref()).expect("a lesson").needs;
    let says =
        needs.lacking(&robot.leo).map_or_else(String::new, |lacking| format!("needs {lacking} in leo.toml"));
    assert!(output.status == Some(0) && output.err.contains(&says), "{output:?}");
    assert!(!says.is_empty() || output.err.is_empty(), "{output:?}");
    let lessons: Value = serde_json::from_str(&output.out).expect("is JSON");
    lessons.pointer("/0/report/tasks/0").expect("a task").clone()
}

fn text(task: &Value, field: &str) -> String {
    task.pointer(field).and_then(Value::as_str).expect("a text").to_owned()
}

/// The chosen rule of a lesson, why it is not Leo's own, and the result.
fn taught(lesson: &str, change: Option<(&str, &str)>) -> [String; 3] {
    let task = task(lesson, change);
    ["/rule/name", "/explanation", "/performances/0/result"].map(|field| text(&task, field))
}

/// The chosen rule of a lesson, its perspective, and the result.
fn taught_where(lesson: &str, from: &str, to: &str) -> [String; 3] {
    let task = task(lesson, Some((from, to)));
    ["/rule/name", "/rule/perspective", "/performances/0/result"].map(|field| text(&task, field))
}

#[test]
fn a_teacher_at_the_side_has_a_view_turned_by_90_degrees() {
    let [rule, why, done] = taught("config/lessons/from_the_side.toml", None);
    assert!(rule.contains("6 things") && rule.contains("90°"), "{rule}");
    assert_eq!(done, "in place 6 of 6");
    insta::assert_snapshot!(format!("{rule}\n{why}"));
}

#[test]
fn changes_behind_the_teachers_back_are_not_part_of_the_rule() {
    let [rule, why, done] = taught("config/lessons/behind_his_back.toml", None);
    assert_eq!(rule, "all");
    assert!(why.contains("\"all red and green\"") && why.contains("yellow square"), "{why}");
    assert_eq!(done, "filled 5 of 5");
    insta::assert_snapshot!(why);
}

#[test]
fn with_two_teachers_the_view_of_the_demonstrator_counts() {
    let lesson = "config/lessons/two_teachers.toml";
    let [rule, why, done] = taught(lesson, Some(("partners = 1 ", "partners = 2 ")));
    assert_eq!((rule.as_str(), done.as_str()), ("all", "filled 5 of 5"));
    assert!(why.contains("blue square") && !why.contains("teacher"), "{why}");
    insta::assert_snapshot!(why);
    // With only the other partner's perspective simulated, that one explains nothing.
    assert_eq!(text(&task(lesson, None), "/rule/name"), "all but blue");
}

#[test]
fn rules_chosen_by_participants_are_learned_in_the_extended_language() {
    let extended = |lesson: &str| taught_where(lesson, "language = \"paper\"", "language = \"extended\"");
    assert_eq!(extended("config/lessons/three_of_them.toml"), ["three of them", "human", "filled 3 of 3"]);
    // Far from the teacher's view, performed in Leo's own.
    assert_eq!(extended("config/lessons/the_far_ones.toml"), ["the far ones", "human", "filled 3 of 3"]);
}

#[test]
fn one_slip_in_three_demonstrations_does_not_hide_the_rule() {
    let taught = taught_where("config/lessons/a_slip.toml", "noise = 0.0 ", "noise = 0.05 ");
    assert_eq!(taught, ["all", "human", "filled 5 of 5"]);
}

#[test]
fn a_learned_task_is_a_step_of_another() {
    let output = run_leo(&["teach", "config/lessons/a_task_in_a_task.toml", "--json"]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    let lessons: Value = serde_json::from_str(&output.out).expect("is JSON");
    let tasks = lessons.pointer("/0/report/tasks").and_then(Value::as_array).expect("a list");
    let text = |task: usize, pointer: &str| {
        tasks.get(task).and_then(|task| task.pointer(pointer)).and_then(Value::as_str).map(str::to_owned)
    };
    assert_eq!(text(0, "/performances/0/result").as_deref(), Some("filled 2 of 2"));
    let step = text(1, "/demonstrations/0/actions/0").expect("an act");
    assert!(step.starts_with("I: ") && step.contains("filled"), "{step}");
    assert_eq!(text(1, "/rule/name").as_deref(), Some("all filled and all marked"));
    assert_eq!(text(1, "/performances/0/result").as_deref(), Some("filled, marked 4 of 4"));
}
