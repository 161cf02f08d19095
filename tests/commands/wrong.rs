//! Lessons with mistakes, with the real processes: each gets a clear answer, and nothing is lost.

use serde_json::{Value, json};

use crate::harness::{read, run_leo, write};

/// The account of a lesson.
fn account(lesson: &str, config: &str) -> Value {
    let output = run_leo(&["teach", lesson, "--json", "--config", config]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    let lessons: Value = serde_json::from_str(&output.out).expect("is JSON");
    lessons.pointer("/0/account").expect("an account").clone()
}

/// What Leo said.
fn said(account: &Value) -> Vec<&str> {
    let said = account.pointer("/said").and_then(Value::as_array).expect("a list");
    said.iter().map(|text| text.as_str().expect("a text")).collect()
}

#[test]
fn misunderstandings_are_answered_one_by_one() {
    let account = account("config/lessons/misunderstandings.toml", "config/leo.toml");
    let expected = [
        "no demonstration of One peg has begun; say",
        "I have not learned one peg; I know nothing yet",
        "like what? Say",
        "I am watching; say \"two pegs is done\"",
        "the showing of two pegs was not finished and does not count",
        "I am watching; say \"one peg is done\"",
        "I am being shown one peg, not Two pegs",
        "nothing changed from the beginning of the demonstration to its end: show it again",
        "I did not ask anything",
        "I am watching; say \"one peg is done\"",
        "I learned one peg from 1 example: all red filled",
        "I am watching for one more example of one peg, beside the 1 that I have; say",
        "I learned one peg from 2 examples: ",
    ];
    let said = said(&account);
    for (said, expected) in said.iter().zip(expected) {
        assert!(said.starts_with(expected), "{said:?} should begin with {expected:?}");
    }
    assert!(said.len() >= expected.len(), "{said:#?}");
    let contradiction = said.get(expected.len() - 1).expect("it was said");
    assert!(
        contradiction.contains("that is what 1 of 2 say, and no rule that I know explains"),
        "{contradiction}"
    );
    // No demonstration is lost.
    let task = account.pointer("/tasks").and_then(Value::as_array).expect("a list");
    let one = task.iter().find(|task| task["name"] == "one peg").expect("it was taught");
    assert_eq!(one["examples"], 2, "{one}");
    let counts: Vec<&Value> =
        one["demonstrations"].as_array().expect("a list").iter().map(|it| &it["counts"]).collect();
    assert_eq!(counts, [&json!(false), &json!(true), &json!(true)]);
}

/// A camera sees a blue square beside the table for six seconds, and then that it is gone.
fn vanishing() -> String {
    let square = json!({ "position_m": [0.6, -0.3, 0.03], "half_extents_m": [0.03, 0.03, 0.03],
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
    let showing =
        lesson.split("# ... and then").next().expect("most of it").split("# The teacher fills").nth(1);
    // The teacher waits meanwhile.
    let showing =
        showing.expect("a showing").split_once('\n').expect("lines").1.replace("at_s = 3.0", "at_s = 8.0");
    let lesson = write(&files, "lesson.toml", &(head.to_owned() + &showing));
    let account = account(&lesson, &config);
    let said = said(&account);
    assert_eq!(
        said.get(1),
        Some(&"I see no more of the blue square: I go by what is still there"),
        "{said:#?}"
    );
    assert!(said.iter().any(|text| text.starts_with("I learned one peg from 1 example: ")), "{said:#?}");
    let seen = account.pointer("/tasks/0/demonstrations/0/seen/robot").and_then(Value::as_str);
    assert!(seen.is_some_and(|seen| seen.contains("blue square")), "{seen:?}");
}
