use clock::Duration;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::json;

use crate::page::{Page, find, opened};
use crate::robot::{Host, MAX_WAIT, Robot};

/// Opens the page of a restarted console at the same address.
fn found_again(host: &Host) -> Page {
    let end = clock::now() + MAX_WAIT;
    while opened(host, &format!("http://{host}")).is_err() {
        assert!(clock::now() < end, "nobody listens at {host} any more");
        clock::sleep_until(clock::now() + Duration::from_millis(20));
    }
    Page::open(host)
}

#[test]
fn after_a_console_restart_held_things_return_and_the_page_reconnects() {
    const BLOCK: &str = "red square";
    let robot = Robot::start("console-death");
    let mut page = Page::open(&robot.host);
    page.wait("a robot at work", |cells| {
        let console = cells.get("process/console").is_some_and(|row| row["pid"].as_u64() > Some(0));
        console && cells.get("workspace").is_some_and(|workspace| workspace["simulated"] == true)
    });
    page.must("clear", json!({}));
    page.wait("an empty table", |cells| !cells.values().any(|cell| cell["kind"] == "object"));
    page.must("add", json!({ "kind": "square", "colour": "red", "at": [-0.2, 0.8] }));
    page.wait("the block at rest", |cells| find(cells, BLOCK).is_some_and(|block| block["held"].is_null()));
    let before = page.thing(BLOCK).expect("is there")["p"].clone();
    page.must("take", json!({ "thing": BLOCK }));
    page.must("carry", json!({ "at": [0.2, 0.6, 0.2] }));
    page.wait("it in the hand", |cells| {
        find(cells, BLOCK).is_some_and(|block| !block["held"].is_null() && block["p"] != before)
    });
    let pid = page.cells["process/console"]["pid"].as_i64().expect("a number");
    let pid = Pid::from_raw(i32::try_from(pid).expect("a number")).expect("a process");
    kill_process(pid, Signal::KILL).expect("it lives");
    drop(page);

    let mut page = found_again(&robot.host);
    page.wait("another life of the console", |cells| {
        cells.get("process/console").is_some_and(|row| row["restarts"] == 1)
    });
    page.wait("the block back where it was", |cells| {
        find(cells, BLOCK).is_some_and(|block| block["held"].is_null() && block["p"] == before)
    });
    // The old black box is lost with the console; a new one starts.
    let kept = page.must("keep", json!({}));
    let file = std::path::Path::new(kept["file"].as_str().unwrap_or_default());
    assert!(file.to_string_lossy().ends_with("_asked.mcap") && file.exists(), "{kept}");
}

#[test]
fn a_late_console_shows_the_remembered_tasks() {
    let robot = Robot::start("console-memory");
    let mut page = Page::open(&robot.host);
    let knows = |cells: &std::collections::BTreeMap<String, serde_json::Value>| {
        cells.get("task/task 1").is_some_and(|task| task["examples"] == 1 && !task["rule"].is_null())
    };
    page.wait("what the first demonstration comes to", knows);
    let learned = page.cells["task/task 1"].clone();
    // In manual mode nothing more is learned.
    page.must("clear", json!({}));
    page.wait("a table by hand", |cells| cells.get("workspace").is_some_and(|it| it["mode"] == "set-up"));
    let pid = page.cells["process/console"]["pid"].as_i64().expect("a number");
    let pid = Pid::from_raw(i32::try_from(pid).expect("a number")).expect("a process");
    kill_process(pid, Signal::KILL).expect("it lives");
    drop(page);

    let mut page = found_again(&robot.host);
    page.wait("what it comes to, told again", knows);
    let again = &page.cells["task/task 1"];
    for part in ["hypotheses", "rule", "explanation"] {
        assert_eq!(again[part], learned[part], "{part}");
    }
}
