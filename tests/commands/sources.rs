//! Commands with sensory sources besides or instead of the simulator.

use crate::assert_refused;
use crate::harness::{read, run_leo, short_lesson, write};

/// The configuration with one more source.
fn with_camera() -> String {
    read("config/leo.toml")
        + "\n[[sensor.source]]\nname = \"camera\"\nkind = \"external\"\nrate_hz = 30.0\nposition_sd_m = 0.02\n"
}

fn without_simulator() -> String {
    read("config/leo.toml").replace("\nkind = \"simulator\"", "\nkind = \"external\"")
}

#[test]
fn an_external_source_has_no_effect_in_simulated_time() {
    let files = tempfile::tempdir().expect("a folder");
    let lesson = write(&files, "lesson.toml", &short_lesson());
    let config = write(&files, "leo.toml", &with_camera());
    let alone = run_leo(&["teach", &lesson, "--json"]);
    let together = run_leo(&["teach", &lesson, "--json", "--config", &config]);
    assert_eq!((alone.status, together.status), (Some(0), Some(0)), "{together:?}");
    assert_eq!((alone.err.as_str(), together.err.as_str()), ("", ""));
    assert_eq!(alone.out, together.out);
    assert!(alone.out.contains("demonstration"), "{alone:?}");
}

#[test]
fn without_a_simulator_source_no_lesson_is_played() {
    let files = tempfile::tempdir().expect("a folder");
    let config = write(&files, "leo.toml", &without_simulator());
    let refused = run_leo(&["teach", "config/lessons/task1.toml", "--config", &config]);
    assert_eq!((refused.status, refused.out.as_str()), (Some(2), ""));
    assert!(refused.err.contains("kind \"simulator\""), "{refused:?}");
    let output = run_leo(&["-v", "run", "--for", "1", "--config", &config]);
    assert_eq!(output.status, Some(0), "{output:?}");
    assert!(output.err.contains("the robot runs") && output.err.contains("processes=6"), "{output:?}");
}

/// The configuration with a trace as one more source.
fn with_trace(keys: &str) -> String {
    read("config/leo.toml") + "\n[[sensor.source]]\nname = \"recorded\"\nkind = \"trace\"\n" + keys
}

#[test]
fn a_trace_is_played_in_simulated_time_the_same_every_time() {
    let files = tempfile::tempdir().expect("a folder");
    let lesson = write(&files, "lesson.toml", &short_lesson());
    write(&files, "moved.jsonl", &read("config/traces/moved.jsonl"));
    // Relative paths are relative to the configuration.
    let config = write(&files, "leo.toml", &with_trace("file = \"moved.jsonl\"\nrepeat = true\n"));
    let alone = run_leo(&["teach", &lesson, "--json"]);
    let one = run_leo(&["teach", &lesson, "--json", "--config", &config]);
    let two = run_leo(&["teach", &lesson, "--json", "--config", &config]);
    assert_eq!((one.status, one.err.as_str()), (Some(0), ""), "{one:?}");
    assert_eq!(one.out, two.out);
    assert_ne!(one.out, alone.out, "what was recorded is among what is believed");
}

#[test]
fn a_trace_that_cannot_be_played_is_refused_before_anything_starts() {
    let files = tempfile::tempdir().expect("a folder");
    write(&files, "empty.jsonl", "{\"leo_trace\": 1}\n");
    write(&files, "bad.jsonl", "{\"leo_trace\": 1}\n{\"at_ns\": -3}\n");
    write(
        &files,
        "two.jsonl",
        "{\"leo_trace\": 1}\n{\"at_ns\": 1, \"observations\": []}\n\
         {\"at_ns\": 1, \"source\": 4, \"observations\": []}\n",
    );
    for (keys, words) in [
        ("", &["leo.toml", "needs a `file`"][..]),
        ("file = \"none.jsonl\"", &["the source `recorded`", "none.jsonl", "No such file"]),
        ("file = \"empty.jsonl\"", &["the source `recorded`", "empty.jsonl has no frames"]),
        ("file = \"bad.jsonl\"", &["the source `recorded`", "bad.jsonl: line 2"]),
        ("file = \"two.jsonl\"", &["the source `recorded`", "0, 4", "recorded_source"]),
        ("file = \"two.jsonl\"\nrecorded_source = 3", &["no frames of a source 3"]),
    ] {
        let config = write(&files, "leo.toml", &with_trace(keys));
        for command in [&["check"][..], &["run", "--for", "5"]] {
            assert_refused(&run_leo(&[command, &["--config", &config]].concat()), 2, words);
        }
    }
}

#[test]
fn a_function_that_this_program_lacks_is_refused_before_anything_starts() {
    let files = tempfile::tempdir().expect("a folder");
    let config = write(&files, "leo.toml", &read("config/leo.toml"));
    let percepts = read("config/percepts.toml");
    for (from, to, words) in [
        ("measure = \"metres\"", "measure = { plugin = \"mine\" }", "custom distance `mine`"),
        (
            "when = \"place_in_view_and_empty\"",
            "when = { plugin = \"mine\" }",
            "custom culling function `mine`",
        ),
        (
            "history = { low_pass = { alpha = 0.5 } }",
            "history = { plugin = \"mine\" }",
            "custom history `mine`",
        ),
        ("kernel = \"orientation\"", "kernel = { plugin = \"mine\" }", "custom classifier `mine`"),
    ] {
        assert!(percepts.contains(from), "{from}");
        write(&files, "percepts.toml", &percepts.replacen(from, to, 1));
        for command in [&["check"][..], &["run", "--for", "5"]] {
            assert_refused(
                &run_leo(&[command, &["--config", &config]].concat()),
                2,
                &[words, "does not have"],
            );
        }
    }
}
