//! A real browser with a real robot.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{BufRead as _, BufReader};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::Value;

use crate::arming::disarmed;
use crate::robot::{Robot, leo};

/// Packages of the tests. A folder prepared by an older version may lack one.
const TOOLS: [&str; 2] = ["playwright-core", "axe-core"];
/// Serialises the preparation.
static PREPARING: Mutex<()> = Mutex::new(());
/// Serialises the browsers, because each renders in software on all cores.
static BROWSER: Mutex<()> = Mutex::new(());

/// Locks a mutex.
fn alone(door: &'static Mutex<()>) -> MutexGuard<'static, ()> {
    // A failed test leaves no inconsistent state, so poisoning is ignored.
    door.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The page's folder with its tools, created below the target folder if needed. Skips with a message if that
/// fails.
fn prepared() -> Option<PathBuf> {
    let _alone = alone(&PREPARING);
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("services/console/page");
    let to = Path::new(env!("CARGO_TARGET_TMPDIR")).join("page");
    copied(&from, &to);
    let is_there = TOOLS.iter().all(|tool| to.join("node_modules").join(tool).exists());
    if is_there || succeeds(Command::new("npm").args(["ci", "--no-audit", "--no-fund"]).current_dir(&to)) {
        return Some(to);
    }
    skipped("Node.js 20 with npm, and the npm registry, are needed: apt-get install nodejs npm")
}

fn skipped<T>(why: &str) -> Option<T> {
    skip::skip(why);
    None
}

fn succeeds(command: &mut Command) -> bool {
    command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

fn copied(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("the page's folder") {
        let entry = entry.expect("readable");
        let (name, path) = (entry.file_name(), entry.path());
        if name == "node_modules" || name == "shots" {
            continue;
        }
        if path.is_dir() {
            copied(&path, &to.join(name));
        } else {
            fs::copy(&path, to.join(name)).expect("copied");
        }
    }
}

#[test]
fn the_built_page_matches_its_sources_and_its_unit_tests_pass() {
    let Some(page) = prepared() else { return };
    for script in ["check", "types", "test"] {
        let output = Command::new("npm").args(["run", script]).current_dir(&page).output().expect("npm runs");
        let said =
            String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "npm run {script}: {said}");
    }
}

/// A script of the page's tests; `None` without a browser.
fn script(script: &str, arguments: &[&str]) -> Option<Command> {
    let page = prepared()?;
    let chromium = std::env::var("CHROMIUM").unwrap_or_else(|_| "/usr/bin/chromium".to_owned());
    if !succeeds(Command::new(&chromium).arg("--version")) {
        return skipped("Chromium is needed: apt-get install chromium, or its path in CHROMIUM");
    }
    let mut command = Command::new("node");
    command
        .arg(script)
        .args(arguments)
        .env("CHROMIUM", &chromium)
        .env("PATIENCE_S", "180")
        .env("URDF", Path::new(env!("CARGO_MANIFEST_DIR")).join("config/leo.urdf"))
        .current_dir(&page);
    Some(command)
}

/// The output of a script of the page's tests; `None` without a browser.
fn played(name: &str, arguments: &[&str]) -> Option<Vec<u8>> {
    let output = script(name, arguments)?.output().expect("node runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(output.stdout)
}

/// The address of a robot's page.
fn address(robot: &Robot) -> String {
    robot.host.url()
}

/// Compared with an empty page, which a busy machine slows down too.
#[test]
fn a_page_with_a_hundred_blocks_keeps_its_frame_rate() {
    let _alone = alone(&BROWSER);
    let Some(counted) = played("tests/pace.mjs", &["100"]) else { return };
    let counted: Value = serde_json::from_slice(&counted).expect("JSON");
    // Frames were counted in both.
    for of in ["bare", "main_view", "all_views"] {
        assert!(counted["a_second"][of].as_f64() > Some(0.0), "{counted:#}");
    }
}

/// Width and height of a PNG.
fn size(png: &[u8]) -> [u32; 2] {
    assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"), "is no PNG");
    [16, 20].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes")))
}

#[test]
fn screenshots_show_every_panel_and_perspective_on_two_screens_and_themes() {
    let _alone = alone(&BROWSER);
    let nested = |leo: String| {
        assert_eq!(leo.matches("\ndepth = 1 ").count(), 1, "{leo}");
        leo.replace("\ndepth = 1 ", "\ndepth = 2 ")
    };
    let robot = Robot::configured("shots", nested);
    let folder = tempfile::tempdir().expect("a folder");
    let into = folder.path().to_str().expect("a path of letters");
    if played("tests/shots.mjs", &[&address(&robot), "--into", into]).is_none() {
        return;
    }
    let mut pictures: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    for entry in fs::read_dir(into).expect("a folder") {
        let path = entry.expect("readable").path();
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        pictures.insert(name, fs::read(path).expect("reads"));
    }
    let on_laptops = ["view-leo", "view-above", "view-free"];
    let on_both = ["page", "perspective-2", "open", "set-up", "save", "help"];
    let mut names: Vec<String> = Vec::new();
    for scheme in ["", "-dark"] {
        names.extend(on_laptops.iter().chain(&on_both).map(|name| format!("{name}{scheme}")));
        names.extend(on_both.iter().map(|name| format!("{name}-tablet{scheme}")));
    }
    names.sort_unstable();
    assert!(pictures.keys().eq(&names), "{:?}\n{names:?}", pictures.keys());
    for (name, png) in &pictures {
        let [width, height] = size(png);
        let is_whole = name.starts_with("page-tablet") || name.starts_with("open-tablet");
        match (name.contains("-tablet"), is_whole) {
            (false, _) => assert_eq!([width, height], [1280, 800], "{name}"),
            (true, false) => assert_eq!([width, height], [820, 1180], "{name}"),
            // Includes what is below the screen.
            (true, true) => assert!(width == 820 && height > 1180, "{name}: {width} x {height}"),
        }
    }
    // Every picture is different.
    let different: BTreeSet<&Vec<u8>> = pictures.values().collect();
    assert_eq!(different.len(), names.len());
}

#[test]
fn on_small_screens_no_control_is_covered_or_off_the_page() {
    let _alone = alone(&BROWSER);
    // Uses a fake robot, whose table has the same things each time.
    played("tests/small.mjs", &[]);
}

#[test]
fn the_page_passes_axe_core_for_wcag_2_2_aa() {
    let _alone = alone(&BROWSER);
    // Uses a fake robot with one locked joint.
    played("tests/axe.mjs", &[]);
}

#[test]
fn the_log_follows_its_end_when_its_box_shrinks() {
    let _alone = alone(&BROWSER);
    let robot = Robot::start("log");
    played("tests/log.mjs", &[&address(&robot)]);
}

#[test]
fn a_newcomer_with_a_phone_follows_the_first_steps() {
    let _alone = alone(&BROWSER);
    let robot = Robot::start("guide");
    played("tests/guide.mjs", &[&address(&robot)]);
}

#[test]
fn a_browser_shows_and_moves_the_second_teachers_view() {
    let _alone = alone(&BROWSER);
    let robot = Robot::start("eyes");
    played("tests/eyes.mjs", &[&address(&robot)]);
}

#[test]
fn without_webgl_the_page_reports_it_and_remains_usable() {
    let _alone = alone(&BROWSER);
    let robot = Robot::start("blind");
    played("tests/blind.mjs", &[&address(&robot)]);
}

#[test]
fn a_browser_confirms_unlocking_and_arms_by_keyboard() {
    let _alone = alone(&BROWSER);
    // Uses a fake robot with one locked joint, whose orders are known.
    played("tests/arm.mjs", &[]);
}

#[test]
fn the_printed_address_admits_a_browser_and_stopping_needs_no_token() {
    let _alone = alone(&BROWSER);
    let robot = Robot::start("token");
    if played("tests/token.mjs", &[&address(&robot)]).is_some() {
        let reason = fs::read_to_string(robot.domain().join("emergency-stop")).expect("it is raised");
        assert!(reason.contains("127.0.0.1"), "{reason}");
    }
}

#[test]
fn without_the_token_a_page_is_read_only_and_explains_it() {
    let _alone = alone(&BROWSER);
    let robot = Robot::configured("watch", |leo| {
        let setting = "read_without_token = \"nothing\"";
        assert_eq!(leo.matches(setting).count(), 1, "{leo}");
        leo.replace(setting, "read_without_token = \"page\"")
    });
    played("tests/watch.mjs", &[&address(&robot)]);
}

#[test]
fn a_server_at_another_port_receives_only_a_cookie_that_commands_nothing() {
    let _alone = alone(&BROWSER);
    let robot = Robot::start("port");
    if played("tests/other_port.mjs", &[&address(&robot)]).is_some() {
        assert!(robot.domain().join("emergency-stop").exists());
    }
}

#[test]
fn a_browser_arms_a_robot_that_does_not_arm_by_itself() {
    let _alone = alone(&BROWSER);
    let robot = disarmed("browser-arm");
    played("tests/arm.mjs", &[&address(&robot)]);
}

/// A port without a listener, outside the ephemeral range. Otherwise the waiting page could be assigned it as
/// its own port and connect to itself.
fn free_port() -> u16 {
    let mut ports = 20_000..32_000;
    ports.find(|port| TcpListener::bind(("127.0.0.1", *port)).is_ok()).expect("a port that is free")
}

#[test]
fn an_open_page_reconnects_to_the_next_console_and_robot() {
    let _alone = alone(&BROWSER);
    let address_of = |port: u16| format!("\"127.0.0.1:{port}\"");
    let port = free_port();
    let mut robot = Robot::configured("reconnect", |leo| {
        assert_eq!(leo.matches(&address_of(7780)).count(), 1, "{leo}");
        leo.replace(&address_of(7780), &address_of(port))
    });
    let served_at = robot.host.clone();
    assert_eq!(*served_at, *format!("127.0.0.1:{port}"));
    let Some(mut command) = script("tests/reconnect.mjs", &[&address(&robot)]) else { return };
    let mut page = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("node runs");
    let mut said = BufReader::new(page.stdout.take().expect("piped")).lines().map_while(Result::ok);
    let is_asked = said.next().is_some_and(|line| line == "restart");
    if is_asked {
        robot.restart();
        assert_eq!(robot.host, served_at);
    }
    let output = page.wait_with_output().expect("it ends");
    assert!(is_asked && output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_browser_teaches_task_1_by_mouse_finger_keyboard_and_typed_sentences() {
    let _alone = alone(&BROWSER);
    let mut robot = Robot::start("browser");
    let Some(taught) = played("tests/teach.mjs", &[&address(&robot)]) else { return };
    let shown: Value = serde_json::from_slice(&taught).expect("JSON");
    robot.stop();
    let (tasks, said) = (shown["tasks"].as_array().expect("a list"), shown["said"].as_str().expect("a text"));
    assert_eq!(tasks.len(), 2, "{shown:#}");
    for (task, name) in tasks.iter().zip(["task 2", "task 1"]) {
        let known = leo(&["tasks", "show", name, "--json"]).env("XDG_STATE_HOME", robot.state()).output();
        let known: Value = serde_json::from_slice(&known.expect("runs").stdout).expect("JSON");
        says_what_is_known(task, &known["report"]["tasks"][0]);
        // An ambiguity is asked about.
        let question = known["question"].as_str();
        assert_eq!(question.is_some(), name == "task 2", "{known:#}");
        assert!(said.contains(question.unwrap_or_default()), "{said}\n{known:#}");
    }
    // The comparison covered an explanation, ties, and hypotheses after them.
    assert!(tasks[1]["why"].is_string(), "{shown:#}");
    let bars = tasks[0]["perspectives"]["human"]["hypotheses"].as_array().expect("a list");
    assert!(bars.iter().map(|bar| &bar["tied"]).eq([true, true, false]), "{shown:#}");
    let last = tasks[1]["performances"].as_array().and_then(|performances| performances.last());
    assert!(last.is_some_and(|last| last["result"] == "filled 4 of 4"), "{shown:#}");
}

/// Checks that the page and `leo tasks show` agree on a task.
fn says_what_is_known(shown: &Value, known: &Value) {
    let both = format!("the page: {shown:#}\nknown: {known:#}");
    let whose = |perspective: &Value| match perspective.as_str() {
        Some("robot") => "as Leo saw it",
        _ => "as you could see it",
    };
    let examples = known["examples"].as_u64().expect("a number");
    let count = format!("{examples} {}", if examples == 1 { "demonstration" } else { "demonstrations" });
    let why: Value = known["explanation"].as_str().map(|why| format!("“{why}”")).into();
    let rule = &known["rule"];
    assert_eq!((&shown["name"], &shown["why"]), (&known["name"], &why), "{both}");
    assert_eq!(shown["rule"], rule["name"], "{both}");
    assert_eq!(
        (&shown["count"], &shown["whose"]),
        (&count.into(), &whose(&rule["perspective"]).into()),
        "{both}"
    );

    let known_views = known["hypotheses"].as_object().expect("an object");
    let shown_views = shown["perspectives"].as_object().expect("an object");
    assert_eq!(shown_views.len(), known_views.len(), "{both}");
    for (perspective, known_view) in known_views {
        let (perspective, shown_view) = (Value::from(perspective.as_str()), &shown_views[perspective]);
        assert_eq!(shown_view["heading"], whose(&perspective), "{both}");
        let bars = shown_view["hypotheses"].as_array().expect("a list");
        let hypotheses = known_view.as_array().expect("a list");
        assert!(!bars.is_empty() && bars.len() == hypotheses.len(), "{both}");
        let first = hypotheses.iter().filter(|hypothesis| hypothesis["rank"] == 1).count();
        for (bar, hypothesis) in bars.iter().zip(hypotheses) {
            assert_eq!(bar["name"], hypothesis["name"], "{both}");
            assert_eq!(bar["posterior"].as_f64(), hypothesis["posterior"].as_f64(), "{both}");
            assert!(is_rounded(&bar["percent"], &hypothesis["posterior"]), "{both}");
            assert_eq!(bar["tally"], format!("{}/{examples}", hypothesis["tally"]), "{both}");
            assert_eq!(bar["tied"], first > 1 && hypothesis["rank"] == 1, "{both}");
            let chosen = rule["name"] == hypothesis["name"] && rule["perspective"] == perspective;
            assert_eq!(bar["chosen"], chosen, "{both}");
        }
    }
}

/// Whether a percentage text equals a probability, to the shown precision.
fn is_rounded(percent: &Value, probability: &Value) -> bool {
    let (text, exact) = (percent.as_str().expect("a text"), 100.0 * probability.as_f64().expect("a number"));
    let number = |text: &str| text.trim_end_matches(" %").parse::<f64>().expect("per cent");
    match text.strip_prefix("< ") {
        Some(above) => 0.0 < exact && exact < number(above),
        None => (exact - number(text)).abs() <= if text.contains('.') { 0.05 + 1e-9 } else { 0.5 + 1e-9 },
    }
}
