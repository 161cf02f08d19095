//! `leo tasks`: moves learned tasks from one store to another.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;

use serde_json::{Value, json};

use crate::harness::{redacted, run_leo, write};
use crate::{VERSION_5, assert_refused};

/// A task with one example: of two squares the red one was filled.
fn exported() -> Value {
    let object = |id: u64, colour: &str, filled: bool| {
        json!({ "id": id, "features": { "colour": colour, "shape": "square" }, "states": { "filled": filled },
                "position_m": [0.4, 0.1, 0.03] })
    };
    let snapshot = |filled: bool| {
        json!({ "at_ns": 1, "frame_position_m": [0.0, 0.0, 0.0], "frame_orientation_xyzw": [0.0, 0.0, 0.0, 1.0],
                "objects": [object(1, "red", filled), object(2, "blue", false)] })
    };
    let view = json!({ "perspective": 0, "before": snapshot(false), "after": snapshot(true) });
    json!({ "leo_tasks": 1, "tasks": [{ "name": "Task 1", "examples": [{ "teacher": 1, "views": [view] }] }] })
}

#[test]
fn learned_tasks_are_listed_shown_exported_forgotten_and_imported() {
    let files = tempfile::tempdir().expect("a folder");
    let state = files.path().join("state").display().to_string();
    let ask = |arguments: &[&str]| run_leo(&[&["tasks"], arguments, &["--state", &state]].concat());
    // Only an import may begin a directory of tasks; elsewhere the name is probably misspelt.
    let misspelt = ask(&["list"]);
    assert_refused(&misspelt, 2, &["--state", &state, "no such directory"]);
    assert!(!files.path().join("state").exists());
    fs::create_dir(&state).expect("makes a folder");
    fs::set_permissions(&state, fs::Permissions::from_mode(0o700)).expect("is ours");
    let nothing = ask(&["list"]).out;
    let unknown = ask(&["show", "task 1"]);
    assert_refused(&unknown, 2, &["task 1"]);

    let file = write(&files, "learned.json", &exported().to_string());
    let imported = ask(&["import", &file]);
    assert!(imported.status == Some(0) && imported.out.contains("Task 1"), "{imported:?}");
    let list = ask(&["list"]).out;
    assert!(list.contains("\nTask 1         1  all red\n"), "{list}");
    let shown = ask(&["show", "task 1"]).out;
    // A single example is unambiguous here: the two objects differ only in colour.
    assert!(shown.contains("ALL RED") && !shown.contains('?'), "{shown}");
    let listed: Value = serde_json::from_str(&ask(&["list", "--json"]).out).expect("is JSON");
    assert_eq!(listed, json!([{ "name": "Task 1", "examples": 1, "rule": "all red" }]));

    // An invalid setting is refused before anything is forgotten.
    let unset = ask(&["forget", "task 1", "--set", "belief.partners=x"]);
    assert_refused(&unset, 2, &["belief.partners"]);

    // An export can be imported again and gives the same export.
    let out = ask(&["export"]).out;
    let known = ask(&["import", &file]);
    assert_refused(&known, 2, &["\"Task 1\"", "--replace"]);
    let forgotten = ask(&["forget", "TASK 1"]).out;
    assert!(forgotten.contains("Task 1") && forgotten.contains("1 example"), "{forgotten}");
    let again = write(&files, "again.json", &out);
    assert_eq!(ask(&["import", &again]).out, imported.out);
    assert_eq!(ask(&["export", "task 1"]).out, out);
    assert_eq!(ask(&["import", &again, "--replace"]).out, imported.out);
    let all = [nothing, unknown.err, imported.out, list, shown, known.err, forgotten].join("\n");
    insta::assert_snapshot!(redacted(&all, &[(&files.path().display().to_string(), "[files]")]));
}

#[test]
fn an_ambiguous_example_is_shown_as_a_question() {
    let files = tempfile::tempdir().expect("a folder");
    let state = files.path().join("state").display().to_string();
    let mut ambiguous = exported();
    for moment in ["before", "after"] {
        let view = &mut ambiguous["tasks"][0]["examples"][0]["views"][0];
        view[moment]["objects"][0]["features"]["shape"] = "triangle".into();
    }
    let file = write(&files, "learned.json", &ambiguous.to_string());
    assert_eq!(run_leo(&["tasks", "import", &file, "--state", &state]).status, Some(0));
    let shown = run_leo(&["tasks", "show", "task 1", "--state", &state]).out;
    let json: Value =
        serde_json::from_str(&run_leo(&["tasks", "show", "task 1", "--json", "--state", &state]).out)
            .expect("is JSON");
    let question = json.pointer("/question").and_then(Value::as_str).expect("a question");
    assert!(question.ends_with('?') && shown.contains(question), "{shown}");
    insta::assert_snapshot!(shown);
}

#[test]
fn importing_an_invalid_file_changes_no_task() {
    let files = tempfile::tempdir().expect("a folder");
    let state = files.path().join("state").display().to_string();
    let import = |text: &str| {
        let file = write(&files, "learned.json", text);
        run_leo(&["tasks", "import", &file, "--state", &state])
    };
    let mut wording = String::new();
    let mut assert_import_refused = |text: &str, words: &[&str]| {
        let output = import(text);
        assert_refused(&output, 2, &[&["learned.json"], words].concat());
        wording += &redacted(&output.err, &[(&files.path().display().to_string(), "[files]")]);
    };
    assert_import_refused("{", &[":1:1: "]);
    assert_import_refused(r#"{ "leo_tasks": 1, "tasks": [], "more": 1 }"#, &["`more`"]);
    assert_import_refused(r#"{ "leo_tasks": 2, "tasks": [] }"#, &["version 2"]);
    let mut nameless = exported();
    nameless["tasks"][0]["name"] = "!".into();
    assert_import_refused(&nameless.to_string(), &["task 1 "]);
    let mut twice = exported();
    let again = twice["tasks"][0].clone();
    twice["tasks"].as_array_mut().expect("a list").push(again);
    assert_import_refused(&twice.to_string(), &["task 2 "]);
    insta::assert_snapshot!(wording);
    assert_refused(&run_leo(&["tasks", "import", "/nowhere.json", "--state", &state]), 2, &["/nowhere.json"]);
    assert_eq!(run_leo(&["tasks", "list", "--json", "--state", &state]).out.trim(), "[]");
}

/// Whether the words appear in this order.
fn says(text: &str, words: &[&str]) -> bool {
    let mut rest = text;
    words.iter().all(|word| match rest.split_once(word) {
        Some((_, after)) => {
            rest = after;
            true
        }
        None => false,
    })
}

#[test]
fn a_damaged_store_reports_losses_and_serves_the_rest() {
    let files = tempfile::tempdir().expect("a folder");
    let state = files.path().join("state");
    let ask = |arguments: &[&str]| {
        run_leo(&[&["tasks"], arguments, &["--state", state.to_str().expect("letters")]].concat())
    };
    let mut two = exported();
    let mut second = two["tasks"][0].clone();
    second["name"] = "Task 2".into();
    two["tasks"].as_array_mut().expect("a list").push(second);
    let file = write(&files, "learned.json", &two.to_string());
    assert_eq!(ask(&["import", &file]).status, Some(0));
    let out = ask(&["export"]).out;

    // Damage to one copy loses nothing.
    let sound = fs::read_to_string(state.join("learned.store")).expect("reads");
    fs::write(state.join("learned.store"), sound.replacen("\"shape\"", "\"squape\"", 1)).expect("writes");
    let output = ask(&["export"]);
    assert_eq!((output.status, &output.out), (Some(0), &out), "{output:?}");
    assert!(says(&output.err, &["WARN", "learned.store", "learned.damaged.store"]), "{output:?}");
    let mut wording = output.err;
    assert_eq!(ask(&["export"]).err, "", "it is told once");

    // Damage to both copies loses one example.
    for name in ["learned.store", "learned.copy.store"] {
        let sound = fs::read_to_string(state.join(name)).expect("reads");
        let line = sound.lines().find(|line| line.contains("Task 2")).expect("is there");
        fs::write(state.join(name), sound.replace(line, &line.replacen("\"shape\"", "\"squape\"", 1)))
            .expect("writes");
    }
    let output = ask(&["list"]);
    assert_eq!(output.status, Some(0), "{output:?}");
    let words = ["ERROR", "learned.damaged.2.store", "learned.copy.damaged.store", " 1 of the examples"];
    assert!(says(&output.err, &words), "{output:?}");
    wording += &output.err;
    assert!(output.out.contains("\nTask 1 ") && !output.out.contains("Task 2"), "{output:?}");

    // Empty files do not count as a new store.
    for name in ["learned.store", "learned.copy.store"] {
        fs::write(state.join(name), "").expect("writes");
    }
    let output = ask(&["list"]);
    assert!(output.status == Some(0) && !output.out.contains("Task"), "{output:?}");
    assert!(says(&output.err, &["ERROR", "learned.store", "learned.damaged."]), "{output:?}");
    wording += &output.err;
    insta::assert_snapshot!(redacted(&wording, &[(&files.path().display().to_string(), "[files]")]));
}

#[test]
fn a_locked_or_other_store_is_refused_with_a_remedy() {
    let files = tempfile::tempdir().expect("a folder");
    let state = files.path().join("state");
    let list = || run_leo(&["tasks", "list", "--state", state.to_str().expect("letters")]);
    let memory = learner_process::Memory::open(&process::state::learned(&state)).expect("is made");
    let in_use = list();
    assert_refused(&in_use, 1, &["learned.store"]);
    drop(memory);
    let database = state.join("learned.redb");
    fs::write(&database, "a database").expect("writes");
    let before_0_1 = list();
    assert_refused(&before_0_1, 2, &["learned.redb", "before 0.1", "move the file away"]);
    assert_eq!(fs::read_to_string(&database).expect("reads"), "a database");
    fs::remove_file(database).expect("is there");
    fs::write(state.join("learned.store"), VERSION_5).expect("writes");
    let newer = list();
    assert_refused(&newer, 2, &["learned.store", "version 5", "version 4"]);
    fs::remove_dir_all(&state).expect("is there");
    std::os::unix::fs::symlink(files.path(), &state).expect("links");
    let link = list();
    assert_refused(&link, 2, &[&state.display().to_string()]);
    let hidden = [(&*files.path().display().to_string(), "[files]")];
    insta::assert_snapshot!(redacted(&(in_use.err + &before_0_1.err + &newer.err + &link.err), &hidden));
}
