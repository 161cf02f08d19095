//! `leo learn` on the command line.

use serde_json::Value;

use crate::assert_refused;
use crate::harness::{CommandOutput, read, redacted, run_leo, write};

/// Task 1 of the study as before-and-after examples.
const SQUARES: &str = "config/examples/squares.jsonl";
const HEADER: &str = r#"{"leo_examples": 1}"#;
const RED: &str = r#"{"id": 1, "features": {"colour": "red"}, "states": {"marked": false}}"#;

fn document(arguments: &[&str]) -> Value {
    let output = run_leo(&[&["learn", SQUARES, "--json"], arguments].concat());
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    serde_json::from_str(&output.out).expect("one JSON document")
}

/// The best rule of each perspective after the last example.
fn winners(document: &Value) -> Vec<&str> {
    let winner = |perspective: usize| {
        let rule = format!("/examples/1/perspectives/{perspective}/goals/0/rules/0/name");
        document.pointer(&rule).and_then(Value::as_str).expect("a rule")
    };
    vec![winner(0), winner(1)]
}

#[test]
fn each_perspective_learns_its_own_rule_and_the_teachers_is_followed() {
    for arguments in [&[][..], &["--language", "extended"]] {
        let document = document(arguments);
        assert_eq!(winners(&document), ["all but blue", "all"]);
        assert_eq!(document.pointer("/followed/perspective"), Some(&Value::from(1)));
    }
}

/// The result for the built-in examples plus a changed copy of the last one, under a policy.
fn concluded(on_conflict: &str, change: impl Fn(&mut Value)) -> Value {
    let files = tempfile::tempdir().expect("a folder");
    let key = format!("on_conflict = \"{on_conflict}\"");
    let config = read("config/leo.toml").replace("on_conflict = \"human\"", &key);
    assert!(config.contains(&key));
    let config = write(&files, "leo.toml", &config);
    let examples = read(SQUARES);
    let last = examples.lines().rfind(|line| line.starts_with('{')).expect("an example");
    let mut more: Value = serde_json::from_str(last).expect("JSON");
    change(&mut more);
    let examples = write(&files, "examples.jsonl", &format!("{examples}\n{more}\n"));
    let output = run_leo(&["learn", &examples, "--json", "--config", &config]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    serde_json::from_str(&output.out).expect("one JSON document")
}

/// Leaves a green square empty that both perspectives see.
fn leave_one_out(more: &mut Value) {
    let perspectives = more["perspectives"].as_array_mut().expect("a list");
    for perspective in perspectives {
        let changed = perspective["changed"].as_array_mut().expect("a list");
        let before = changed.len();
        changed.retain(|thing| thing["id"] != 1);
        assert_eq!(changed.len() + 1, before);
    }
}

#[test]
fn a_conflict_is_decided_or_asked_about_as_configured() {
    for (on_conflict, followed) in [("human", 1), ("own", 0), ("resolve", 1)] {
        let document = concluded(on_conflict, |_| {});
        assert_eq!(document["followed"]["perspective"], followed, "{on_conflict}");
        assert_eq!(
            document["open_question"],
            Value::Null,
            "he could not know of the blue square: {on_conflict}"
        );
    }
    for (on_conflict, followed) in
        [("human", Value::from(1)), ("own", Value::from(0)), ("resolve", Value::Null)]
    {
        let document = concluded(on_conflict, leave_one_out);
        assert_eq!(document["followed"]["perspective"], followed, "{on_conflict}");
        let is_open = document["open_question"].as_str().is_some_and(|asked| asked.contains("green square"));
        assert_eq!(is_open, on_conflict == "resolve", "{on_conflict}: {}", document["open_question"]);
    }
}

#[test]
fn a_question_gives_a_probability_for_each_perspective() {
    let document = document(&[]);
    let probability = |object: usize, answer: usize| {
        let pointer = format!("/examples/1/asked/{object}/answers/{answer}/probability");
        document.pointer(&pointer).cloned().expect("an answer")
    };
    let number = |object, answer| probability(object, answer).as_f64().expect("a number");
    assert!(number(0, 0) < 0.01 && number(0, 1) > 0.99, "the blue square");
    assert!(number(1, 0) > 0.99 && number(1, 1) > 0.99, "the red square");
    assert_eq!(probability(3, 0), Value::Null, "a peg has no hole");
}

#[test]
fn every_run_of_learn_prints_the_same_text() {
    let [one, same]: [CommandOutput; 2] =
        [(); 2].map(|()| run_leo(&["learn", SQUARES, "--language", "extended"]));
    assert_eq!((one.status, &one.out), (Some(0), &same.out), "{one:?}");
    for rule in ["all but blue filled", "four of them filled", "the teacher: all filled"] {
        assert!(one.out.contains(rule), "{rule} is not in {}", one.out);
    }
    insta::assert_snapshot!(one.out);
}

#[test]
fn an_invalid_line_is_named_with_its_field() {
    let files = tempfile::tempdir().expect("a folder");
    let good = format!(
        r#"{{"perspectives": [{{"before": [{RED}], "changed": [{{"id": 1, "states": {{"marked": true}}}}]}}]}}"#
    );
    let view = |view: &str| format!("{HEADER}\n{good}\n\n{{\"perspectives\": [{view}]}}\n");
    let before = |object: &str| view(&format!(r#"{{"before": [{object}], "after": []}}"#));
    let cases: Vec<(String, &[&str])> = vec![
        (String::new(), &["no examples"]),
        (HEADER.to_owned(), &["no examples"]),
        (good.clone(), &["line 1", "leo_examples"]),
        (format!("{{\"leo_examples\": 2}}\n{good}"), &["line 1", "version 2"]),
        (format!("{HEADER}\n{{\"perspectives\": []}}"), &["line 2", "perspectives"]),
        (before(r#"{"id": 1, "colour": "red"}"#), &["line 4", "perspectives[0].before[0].colour"]),
        (before(r#"{"features": {}}"#), &["line 4", "perspectives[0].before[0].id"]),
        (before(&format!("{RED}, {RED}")), &["line 4", "before[1].id", "another object"]),
        (before(r#"{"id": 1, "states": {"marked": 0.5}}"#), &["line 4", "states.marked", "true or false"]),
        (before(r#"{"id": 1, "position_m": [1e9, 0, 0]}"#), &["line 4", "position_m", "out of range"]),
        (before(r#"{"id": 1, "features": {"": "red"}}"#), &["line 4", "before[0]", "no name"]),
        (view(&format!(r#"{{"before": [{RED}]}}"#)), &["line 4", "perspectives[0]", "`after`", "`changed`"]),
        (
            view(&format!(r#"{{"before": [{RED}], "changed": [{{"id": 7}}]}}"#)),
            &["line 4", "changed[0].id", "7"],
        ),
        (
            view(&format!(
                r#"{{"before": [{RED}], "changed": [{{"id": 1, "states": {{"filled": true}}}}]}}"#
            )),
            &["line 4", "changed[0].states.filled", "before"],
        ),
        (
            view(r#"{"before": [], "after": []}, {"before": [], "after": []}"#),
            &["line 4", "perspectives[1].perspective", "before"],
        ),
        (format!("{HEADER}\n{good}\n{{\"perspectives\": "), &["line 3", "column"]),
    ];
    let mut wording = String::new();
    for (text, words) in cases {
        let file = write(&files, "examples.jsonl", &text);
        let output = run_leo(&["learn", &file, "--json"]);
        assert_refused(&output, 2, &[&["examples.jsonl"], words].concat());
        wording += &redacted(&output.err, &[(&file, "examples.jsonl")]);
    }
    insta::assert_snapshot!(wording);
    assert_refused(&run_leo(&["learn", "/nowhere.jsonl"]), 2, &["/nowhere.jsonl"]);
}

#[test]
fn a_noise_of_one_half_is_refused() {
    let output = run_leo(&["learn", SQUARES, "--noise", "0.5"]);
    assert_eq!((output.status, output.out.as_str()), (Some(2), ""), "{output:?}");
    assert!(output.err.contains("0.5"), "{output:?}");
    insta::assert_snapshot!(output.err);
}
