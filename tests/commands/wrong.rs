//! Lessons with mistakes, with the real processes: each gets a clear answer, and nothing is lost.

use serde_json::{Value, json};

use crate::harness::{read, run_leo, write};

/// The report of a lesson.
fn report(lesson: &str, config: &str) -> Value {
    let output = run_leo(&["teach", lesson, "--json", "--config", config]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    let lessons: Value = serde_json::from_str(&output.out).expect("is JSON");
    lessons.pointer("/0/report").expect("a report").clone()
}

/// What Leo said.
fn said(report: &Value) -> Vec<&str> {
    let said = report.pointer("/said").and_then(Value::as_array).expect("a list");
    said.iter().map(|text| text.as_str().expect("a text")).collect()
}

#[test]
fn each_misunderstood_sentence_gets_its_own_answer() {
    let report = report("config/lessons/misunderstandings.toml", "config/leo.toml");
    let said = said(&report);
    let contradiction = said.iter().find(|text| text.contains("2 examples: ")).expect("it was said");
    assert!(contradiction.contains("1 of 2 "), "{contradiction}");
    insta::assert_snapshot!(said.join("\n"));
    // No demonstration is lost.
    let task = report.pointer("/tasks").and_then(Value::as_array).expect("a list");
    let one = task.iter().find(|task| task["name"] == "one peg").expect("it was taught");
    assert_eq!(one["examples"], 2, "{one}");
    let counts: Vec<&Value> =
        one["demonstrations"].as_array().expect("a list").iter().map(|it| &it["counts"]).collect();
    assert_eq!(counts, [&json!(false), &json!(true), &json!(true)]);
}

/// A camera sees a blue square beside the table for six seconds, and then that it is gone.
fn vanishing() -> String {
    let square = json!({ "position_m": [0.6, -0.3, 0.03], "size_m": [0.06, 0.06, 0.06], "shape": [0, 0, 0, 0],
                         "colour_rgb": [0.05, 0.15, 0.8], "states": { "filled": 0.0 } });
    let mut trace = json!({ "leo_trace": 1 }).to_string();
    for frame in 0..400_u64 {
        let seen = if frame < 120 { vec![square.clone()] } else { Vec::new() };
        trace += &format!("\n{}", json!({ "at_ns": frame * 50_000_000, "observations": seen }));
    }
    trace + "\n"
}

#[test]
fn a_vanished_object_is_reported_and_the_rest_is_learned() {
    let files = tempfile::tempdir().expect("a folder");
    write(&files, "vanishing.jsonl", &vanishing());
    let source = "\n[[sensor.source]]\nname = \"camera\"\nkind = \"trace\"\nfile = \"vanishing.jsonl\"\n";
    let config = write(&files, "leo.toml", &(read("config/leo.toml") + source));
    let lesson = read("config/lessons/misunderstandings.toml");
    let head = lesson.split("# Every sentence comes").next().expect("a head");
    let demonstration =
        lesson.split("# ... and then").next().expect("most of it").split("# The teacher fills").nth(1);
    // The teacher waits meanwhile.
    let demonstration = demonstration
        .expect("a showing")
        .split_once('\n')
        .expect("lines")
        .1
        .replace("at_s = 3.0", "at_s = 8.0");
    let lesson = write(&files, "lesson.toml", &(head.to_owned() + &demonstration));
    let report = report(&lesson, &config);
    let said = said(&report);
    assert!(said.get(1).is_some_and(|text| text.contains("blue square")), "{said:#?}");
    assert_eq!(report.pointer("/tasks/0/examples"), Some(&json!(1)), "{said:#?}");
    insta::assert_snapshot!(said.join("\n"));
    let seen = report.pointer("/tasks/0/demonstrations/0/seen/robot").and_then(Value::as_str);
    assert!(seen.is_some_and(|seen| seen.contains("blue square")), "{seen:?}");
}
