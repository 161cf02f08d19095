use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::page::Page;
use crate::robot::{Robot, leo};

/// Sets up the table: blocks with holes, pegs, and optionally a wall.
fn set(page: &mut Page, blocks: &[(&str, [f64; 2])], pegs: &[[f64; 2]], wall: Option<[f64; 3]>) {
    page.must("clear", json!({}));
    page.wait("an empty table", |cells| !cells.iter().any(|(_, cell)| cell["kind"] == "object"));
    if let Some(at) = wall {
        page.must("screen", json!({ "name": "wall", "at": at, "half": [0.18, 0.01, 0.125] }));
    }
    for (colour, at) in blocks {
        page.must("add", json!({ "kind": "square", "colour": colour, "at": at }));
    }
    for at in pegs {
        page.must("add", json!({ "kind": "peg", "colour": "wood", "at": at }));
    }
    let things = blocks.len() + pegs.len();
    page.wait("beliefs in all", |cells| {
        let known = cells.iter().filter(|(key, cell)| key.starts_with("thing/") && cell["belief"].is_u64());
        known.count() == things && beliefs(cells, 0) == things
    });
}

fn beliefs(cells: &BTreeMap<String, Value>, perspective: u32) -> usize {
    let prefix = format!("belief/{perspective}/");
    cells.keys().filter(|key| key.starts_with(&prefix)).count()
}

/// Number of utterances of Leo with this beginning.
fn said(cells: &BTreeMap<String, Value>, begins: &str) -> usize {
    let lines = cells.values().filter(|line| line["who"] == "Leo" && line["kind"] == "said");
    lines.filter(|line| line["text"].as_str().is_some_and(|text| text.starts_with(begins))).count()
}

/// Fills the holes of the blocks, one peg each.
fn demonstrate(page: &mut Page, fills: &[[f64; 2]], examples: u64) {
    page.must("say", json!({ "text": "Leo, I can teach you to do task 1" }));
    page.wait("Leo's attention", |cells| said(cells, "I am watching") > 0);
    for (number, at) in fills.iter().enumerate() {
        let peg = if number == 0 { "wood peg".to_owned() } else { format!("wood peg {}", number + 1) };
        page.bring(&peg, *at);
        page.wait("the act recognised", |cells| {
            let saw = cells.values().filter(|line| line["kind"] == "saw").count();
            saw >= number + 1 + fills.len() * usize::try_from(examples - 1).expect("few")
        });
    }
    page.must("say", json!({ "text": "task 1 is done" }));
    page.wait("the example", |cells| {
        cells.get("task/task 1").is_some_and(|task| task["examples"] == examples)
    });
}

#[test]
fn a_task_taught_by_hand_is_learned_performed_and_written_down() {
    let mut robot = Robot::start("by-hand");
    let mut page = Page::open(&robot.host);
    page.wait("a robot at work", |cells| {
        beliefs(cells, 0) > 0 && beliefs(cells, 1) > 0 && cells.contains_key("workspace")
    });
    // The teacher sits as in the lesson and cannot see past the wall.
    let pegs = [[-0.1, 1.1], [0.0, 1.1], [0.1, 1.1]];
    for demonstration in 1..=2 {
        let blocks =
            [("red", [-0.3, 0.9]), ("green", [0.3, 0.8]), ("yellow", [0.05, 0.85]), ("blue", [-0.25, 0.42])];
        set(&mut page, &blocks, &pegs, Some([-0.25, 0.53, 0.0]));
        page.wait("the blue one unknown to the teacher", |cells| {
            cells.values().any(|cell| cell["words"] == "the teacher does not know of the blue square")
        });
        demonstrate(&mut page, &[[-0.3, 0.9], [0.3, 0.8], [0.05, 0.85]], demonstration);
    }
    let task = page.cells["task/task 1"].clone();
    assert_eq!(task["rule"]["name"], "all", "{task:#}");
    assert_eq!(task["hypotheses"]["robot"][0]["name"], "all but blue", "{task:#}");

    // The novel set: two blue blocks and a red one, within Leo's reach.
    let blocks = [("blue", [-0.13, 0.46]), ("red", [0.0, 0.46]), ("blue", [0.13, 0.46])];
    set(&mut page, &blocks, &[[-0.09, 0.30], [0.0, 0.30], [0.09, 0.30]], None);
    page.must("say", json!({ "text": "Leo, do task 1" }));
    page.wait("the performance", |cells| {
        cells["task/task 1"]["performances"][0]["result"].as_str().is_some()
    });
    let performed = page.cells["task/task 1"]["performances"][0].clone();
    assert_eq!(performed["result"], "filled 3 of 3", "{performed:#}");

    // Save it as a lesson.
    let saved = page.must("save", json!({ "title": "Taught by hand" }));
    let lessons = robot.lessons();
    assert_eq!(lessons.len(), 1);
    assert_eq!(saved["file"], lessons[0].to_str().expect("text"));
    robot.stop();
    // The stored task equals the page's.
    let shown = leo(&["tasks", "show", "task 1", "--json"])
        .env("XDG_STATE_HOME", robot.state())
        .output()
        .expect("runs");
    let shown: Value = serde_json::from_slice(&shown.stdout)
        .unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&shown.stderr)));
    assert_eq!(shown["report"]["tasks"][0]["rule"]["name"], task["rule"]["name"]);
    assert_eq!(shown["report"]["tasks"][0]["hypotheses"]["human"][0]["name"], "all");

    // The same result in simulated time.
    let played = leo(&["teach", "--json"]).arg(&lessons[0]).output().expect("runs");
    let played: Value = serde_json::from_slice(&played.stdout)
        .unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&played.stderr)));
    let tasks = find_tasks(&played).expect("tasks");
    assert_eq!(tasks[0]["rule"]["name"], "all", "{played:#}");
    assert_eq!(tasks[0]["hypotheses"]["robot"][0]["name"], "all but blue", "{played:#}");
    assert_eq!(tasks[0]["performances"][0]["result"], "filled 3 of 3", "{played:#}");
}

/// The list of tasks, anywhere in the report.
fn find_tasks(report: &Value) -> Option<&Value> {
    match report {
        Value::Object(fields) => fields.get("tasks").or_else(|| fields.values().find_map(find_tasks)),
        Value::Array(entries) => entries.iter().find_map(find_tasks),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => None,
    }
}

#[test]
fn the_record_button_writes_a_recording_that_can_be_replayed() {
    let mut robot = Robot::start("record");
    let mut page = Page::open(&robot.host);
    page.wait("a robot at work", |cells| beliefs(cells, 0) > 0 && beliefs(cells, 1) > 0);
    let file = page.must("record", json!({ "on": true }))["file"].clone();
    page.wait("the recording under way", |cells| {
        let recording = &cells["recording"];
        recording["on"] == true && recording["file"] == file && recording["bytes"].as_u64() > Some(0)
    });
    // A second press does not start another recording.
    assert_eq!(page.must("record", json!({ "on": true }))["file"], file);
    page.wait("some of it", |cells| cells["recording"]["seconds"].as_u64() >= Some(3));
    page.must("record", json!({ "on": false }));
    page.wait("its end", |cells| cells["recording"]["on"] == false && cells["recording"]["error"].is_null());
    page.must("record", json!({ "on": false }));
    robot.stop();
    let file = file.as_str().expect("a path");
    let replayed = leo(&["replay", file]).output().expect("runs");
    assert!(replayed.status.success(), "{}", String::from_utf8_lossy(&replayed.stderr));
}

#[test]
fn a_closed_page_returns_held_things_and_a_new_page_sees_everything() {
    let robot = Robot::start("closed");
    let mut page = Page::open(&robot.host);
    page.wait("a robot at work", |cells| cells.values().any(|cell| cell["kind"] == "object"));
    page.must("clear", json!({}));
    page.must("add", json!({ "kind": "peg", "colour": "wood", "at": [0.2, 0.8] }));
    page.must("take", json!({ "thing": "wood peg" }));
    page.must("carry", json!({ "at": [-0.2, 0.8, 0.3] }));
    page.wait("the peg in the hand", |cells| {
        crate::page::find(cells, "wood peg").is_some_and(|peg| peg["held"] == 1 && peg["p"][0] == -0.2)
    });
    drop(page);
    let mut page = Page::open(&robot.host);
    page.wait("the peg back", |cells| {
        crate::page::find(cells, "wood peg").is_some_and(|peg| peg["held"].is_null() && peg["p"][0] == 0.2)
    });
    assert!(page.cells["lessons"].as_array().is_some_and(|lessons| lessons.len() >= 14));
    assert_eq!(page.cells["joints"].as_array().map(Vec::len), Some(65));
}
