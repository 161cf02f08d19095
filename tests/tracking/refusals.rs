//! What `leo evaluate` refuses, and how.

use crate::{Folder, evaluate, table};

/// A line of the MOT Challenge.
const ROW: &str = "1,1,100,100,40,100,1\n";

/// Checks an error: one line on standard error, nothing on standard output. Returns the line without the folder.
fn refused(folder: &Folder, arguments: &[&str], word: &str) -> String {
    let output = evaluate(arguments);
    assert_eq!((output.status, output.out.as_str()), (Some(2), ""), "{arguments:?} {output:?}");
    assert!(output.err.contains(word), "{word} is not in {output:?}");
    assert!(output.err.starts_with("leo: ") && output.err.lines().count() == 1, "{output:?}");
    output.err.replace(&folder.file(""), "[files]/")
}

#[test]
fn an_invalid_input_is_refused_in_one_line() {
    let folder = Folder::new();
    let [truth, trace] = table();
    let [truth, trace] = [folder.write("truth.jsonl", &truth), folder.write("trace.jsonl", &trace)];
    let [gt, det] = [folder.write("gt.txt", ROW), folder.write("det.txt", &ROW.replace("1,1,", "1,-1,"))];
    let wrong = folder.write("wrong.txt", "1,1,100,100,-40,100,1\n");
    let empty = folder.write("empty.txt", "");
    let later = "{\"leo_trace\": 1}\n{\"at_ns\": 7, \"observations\": []}\n";
    let later = folder.write("later.jsonl", later);
    let mut wording = String::new();
    let cases: [(&[&str], &str); 13] = [
        (&["--truth", "/nowhere/gt.txt", &trace], "/nowhere/gt.txt"),
        (&["--truth", &trace, &trace], "leo_truth"),
        (&["--truth", &truth, &truth], "leo_trace"),
        (&["--truth", &wrong, "--detections", &det, "--frame-rate", "25"], "line 1, w: "),
        (&["--truth", &gt, "--detections", &wrong, "--frame-rate", "25"], "line 1, w: "),
        (&["--truth", &empty, "--detections", &det, "--frame-rate", "25"], "no object"),
        (&["--truth", &gt, "--detections", &det], "--frame-rate 25"),
        (&["--truth", &gt, "--detections", &empty, "--frame-rate", "25"], "--pixel"),
        (&["--truth", &gt, "--frame-rate", "25", &trace], "--pixel"),
        (&["--truth", &truth, "--pixel", "0.01", &trace], "--pixel"),
        (&["--truth", &truth, "--similarity", "box", &trace], "size_m"),
        (
            &["--truth", &gt, "--detections", &det, "--frame-rate", "25", "--cut-off", "1"],
            "--similarity distance",
        ),
        (&["--truth", &truth, &later], "no instant"),
    ];
    for (arguments, word) in cases {
        wording += &refused(&folder, arguments, word);
    }
    insta::assert_snapshot!(wording);
}

#[test]
fn bad_usage_is_refused_before_anything_is_read() {
    for (arguments, word) in [
        (&["--truth", "/nowhere"][..], "<TRACE>"),
        (&["/nowhere"], "--truth <FILE>"),
        (&["--truth", "/nowhere", "--detections", "/nowhere", "/nowhere"], "--detections"),
        (&["--truth", "/nowhere", "--frame-rate", "0", "/nowhere"], "0.000001"),
        (&["--truth", "/nowhere", "--cut-off", "-1", "/nowhere"], "0.000001"),
        (&["--truth", "/nowhere", "--pixel", "NaN", "/nowhere"], "0.000001"),
        (&["--truth", "/nowhere", "--min-score", "1", "/nowhere"], "--detections"),
    ] {
        let output = evaluate(arguments);
        assert_eq!((output.status, output.out.as_str()), (Some(2), ""), "{arguments:?} {output:?}");
        assert!(output.err.contains(word), "{word} is not in {output:?}");
    }
}

#[test]
fn an_existing_file_is_kept() {
    let folder = Folder::new();
    let [truth, trace] = table();
    let [truth, trace] = [folder.write("truth.jsonl", &truth), folder.write("trace.jsonl", &trace)];
    let there = folder.write("there.jsonl", "mine");
    let arguments = ["--truth", &truth, &trace, "--save-hypotheses", &there];
    let output = evaluate(&arguments);
    assert_eq!((output.status, output.out.as_str()), (Some(2), ""), "{output:?}");
    assert!(output.err.contains("there.jsonl") && output.err.contains("--force"), "{output:?}");
    assert_eq!(std::fs::read_to_string(&there).expect("reads"), "mine");
    assert_eq!(evaluate(&[&arguments[..], &["--force"]].concat()).status, Some(0));
    assert_ne!(std::fs::read_to_string(&there).expect("reads"), "mine");
}

#[test]
fn the_report_says_what_was_not_compared() {
    let folder = Folder::new();
    let header = "{\"leo_truth\": 1}\n";
    let object = "{\"id\": 1, \"position_m\": [0.6, 0.0, 0.03], \"seen_by\": [0, 3]}";
    let truth: String =
        [10, 30, 40].map(|at_ms| format!("{{\"at_ns\": {at_ms}000000, \"objects\": [{object}]}}\n")).concat();
    let truth = folder.write("truth.jsonl", &format!("{header}{truth}"));
    let seen = "{\"position_m\": [0.6, 0.0, 0.03]}";
    let trace: String = [10, 20, 30]
        .map(|at_ms| format!("{{\"at_ns\": {at_ms}000000, \"observations\": [{seen}]}}\n"))
        .concat();
    let trace = folder.write("trace.jsonl", &format!("{{\"leo_trace\": 1}}\n{trace}"));
    let output = evaluate(&["--truth", &truth, &trace]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    for fact in ["3 frames of the truth", "1 frame of the truth", "1 instant of", "--partners 3", "0.6667"] {
        assert!(output.out.contains(fact), "{fact} is not in\n{}", output.out);
    }
    insta::assert_snapshot!(output.out);
}

#[test]
fn the_truth_of_the_documentation_is_valid() {
    let page = include_str!("../../docs/evaluation.md");
    let block = page.split("```json\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a block");
    let folder = Folder::new();
    let truth = folder.write("truth.jsonl", block);
    let seen = "{\"position_m\": [0.6, 0.1, 0.03]}, {\"position_m\": [0.6, -0.2, 0.03]}";
    let trace = format!("{{\"leo_trace\": 1}}\n{{\"at_ns\": 0, \"observations\": [{seen}]}}\n");
    let trace = folder.write("trace.jsonl", &trace);
    let output = evaluate(&["--truth", &truth, &trace, "--json"]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    let document: serde_json::Value = serde_json::from_str(&output.out).expect("is JSON");
    assert_eq!(document["perspectives"][0]["clear_mot"]["matches"], 2, "{document}");
}
