//! Who may know whom: the layers, what is wrapped by one crate alone, and what a core may not do.
#![expect(clippy::expect_used, reason = "a test that cannot read the sources has failed")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use cargo_metadata::{DependencyKind, MetadataCommand, Package};

/// The crates from the top to the base, one row per layer. An arrow only goes down.
const LAYERS: [&[&str]; 6] = [
    &["leo"],
    &[
        "belief-process",
        "console-process",
        "learner-process",
        "link-process",
        "mock-bus-process",
        "motor-process",
        "sensor-process",
        "simulator-process",
        "supervisor-process",
    ],
    &["folder", "process", "realtime", "recording", "serial", "store", "torque", "trace", "transport"],
    &[
        "account",
        "belief",
        "chronicle",
        "cycle",
        "kinematics",
        "metrics",
        "motion",
        "perception",
        "perspective",
        "records",
        "scene",
        "servo",
        "study",
        "tasks",
    ],
    &["config", "message"],
    &["budget", "clock", "geometry", "prefetch", "quantity", "testkit"],
];

/// Arrows within a layer, from the crate to those of its own layer that it may know.
const PEERS: [(&str, &[&str]); 11] = [
    ("process", &["folder", "realtime", "transport"]),
    ("store", &["folder"]),
    ("transport", &["folder"]),
    ("recording", &["folder", "transport"]),
    ("torque", &["serial"]),
    ("belief", &["perception"]),
    ("chronicle", &["perspective"]),
    ("perspective", &["belief", "perception", "scene"]),
    ("motion", &["kinematics"]),
    ("study", &["account"]),
    ("config", &["message"]),
];

/// What others made that only some of our crates may know.
const WRAPPED: [(&str, &[&str]); 18] = [
    ("iceoryx2", &["transport"]),
    ("iceoryx2-bb-derive-macros", &["message"]),
    ("iceoryx2-bb-elementary-traits", &["message"]),
    ("clap_complete", &["leo"]),
    ("clap_mangen", &["leo"]),
    ("parry3d", &["scene"]),
    ("ratatui", &["console-process"]),
    ("redb", &["store"]),
    ("mcap", &["recording", "records", "trace"]),
    ("libc", &["realtime"]),
    ("sd-notify", &["supervisor-process"]),
    ("signal-hook", &["process", "supervisor-process"]),
    (
        "rustix",
        &["clock", "folder", "process", "realtime", "recording", "serial", "supervisor-process", "transport"],
    ),
    ("urdf-rs", &["kinematics"]),
    ("toml", &["config"]),
    ("quinn", &["link-process"]),
    ("quinn-proto", &["link-process"]),
    ("rustls", &["link-process"]),
];

/// Crates that may hold unsafe code.
const MAY_BE_UNSAFE: [&str; 3] = ["shared/prefetch", "shared/realtime", "shared/testkit"];

/// Files of a service's shell, which may open, read and wait; everything else of it is core.
const SHELL_FILES: [&str; 3] = ["lib.rs", "run.rs", "shell.rs"];

/// Further files of a shell, where it has more than one noun.
const MORE_SHELL_FILES: [&str; 55] = [
    "console/src/arming.rs",
    "console/src/black_box.rs",
    "console/src/black_box/files.rs",
    "console/src/fares.rs",
    "console/src/hand.rs",
    "console/src/lessons.rs",
    "console/src/look.rs",
    "console/src/tape.rs",
    "console/src/top.rs",
    "console/src/top/boards.rs",
    "console/src/top/live.rs",
    "console/src/web.rs",
    "console/src/web/connections.rs",
    "console/src/web/door.rs",
    "console/src/web/fed.rs",
    "console/src/web/guard.rs",
    "console/src/web/live.rs",
    "learner/src/keeper.rs",
    "learner/src/memory.rs",
    "link/src/net.rs",
    "link/src/net/handshakes.rs",
    "link/src/net/incoming.rs",
    "link/src/net/keys.rs",
    "link/src/net/peers.rs",
    "link/src/ports.rs",
    "mock_bus/src/alone.rs",
    "mock_bus/src/end.rs",
    "mock_bus/src/ptys.rs",
    "motor/src/ending.rs",
    "motor/src/ledger.rs",
    "motor/src/line.rs",
    "motor/src/threads.rs",
    "simulator/src/desk.rs",
    "simulator/src/saving.rs",
    "supervisor/src/bench.rs",
    "supervisor/src/bench/bare.rs",
    "supervisor/src/bench/leo.rs",
    "supervisor/src/bench/report.rs",
    "supervisor/src/class.rs",
    "supervisor/src/replay.rs",
    "supervisor/src/tape.rs",
    "supervisor/src/teach.rs",
    "supervisor/src/caretaker.rs",
    "supervisor/src/check.rs",
    "supervisor/src/check/apply.rs",
    "supervisor/src/check/measure.rs",
    "supervisor/src/children.rs",
    "supervisor/src/conductor.rs",
    "supervisor/src/lives.rs",
    "supervisor/src/readiness/system.rs",
    "supervisor/src/service_manager.rs",
    "supervisor/src/signals.rs",
    "supervisor/src/stop_by_any_user.rs",
    "supervisor/src/guard.rs",
    "supervisor/src/memory_watch.rs",
];

/// What a core may not say: it is told the time, and opens nothing.
const SHELL_WORDS: [&str; 7] =
    ["transport::", "clock::now", "clock::sleep_until", "std::fs", "std::env", "std::net", "std::process"];

/// Reading the clock of the machine, or waiting by it.
const CLOCK_WORDS: [&str; 5] =
    ["Instant::now", "SystemTime::now", "clock_gettime", "clock_nanosleep", "thread::sleep"];

fn packages() -> Vec<Package> {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
    MetadataCommand::new().manifest_path(manifest).no_deps().exec().expect("cargo metadata").packages
}

/// Dependencies of each crate, those of its tests aside, by name.
fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let of = |package: &Package| {
        let kept = package.dependencies.iter().filter(|dependency| dependency.kind == DependencyKind::Normal);
        kept.map(|dependency| dependency.name.clone()).collect()
    };
    packages().iter().map(|package| (package.name.to_string(), of(package))).collect()
}

fn layer_of(name: &str) -> Option<usize> {
    LAYERS.iter().position(|layer| layer.contains(&name))
}

#[test]
fn an_arrow_only_goes_down() {
    let dependencies = dependencies();
    let mut wrong = Vec::new();
    let mut edges = 0;
    for (from, to) in &dependencies {
        let Some(layer) = layer_of(from) else {
            wrong.push(format!("`{from}` is in no layer: list it in LAYERS"));
            continue;
        };
        let peers = PEERS.iter().find(|(name, _)| name == from).map_or(&[][..], |(_, peers)| peers);
        for name in to.iter().filter(|name| dependencies.contains_key(*name)) {
            edges += 1;
            let goes_down = layer_of(name).is_some_and(|below| below > layer);
            if !goes_down && !peers.contains(&name.as_str()) {
                wrong.push(format!("`{from}` may not know `{name}`"));
            }
        }
        wrong.extend(
            peers
                .iter()
                .filter(|peer| !to.contains(**peer))
                .map(|peer| format!("`{from}` no longer knows `{peer}`")),
        );
    }
    let listed: usize = LAYERS.iter().map(|layer| layer.len()).sum();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(listed, dependencies.len(), "LAYERS lists a crate that is gone");
    assert!(edges > 50, "only {edges} edges were seen");
}

#[test]
fn what_others_made_is_wrapped() {
    let dependencies = dependencies();
    for (foreign, may) in WRAPPED {
        let knows: Vec<&str> = dependencies
            .iter()
            .filter(|(_, to)| to.contains(foreign))
            .map(|(from, _)| from.as_str())
            .collect();
        let wrong: Vec<&&str> = knows.iter().filter(|name| !may.contains(name)).collect();
        assert!(wrong.is_empty(), "{wrong:?} may not know `{foreign}`: only {may:?} may");
        assert!(!knows.is_empty(), "nobody knows `{foreign}`: take it out of WRAPPED");
    }
}

/// Every Rust file below a folder of the repository, with its path in it.
fn sources(folder: &str) -> Vec<(String, String)> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("a folder of the repository").flatten() {
            let path = entry.path();
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.push(path);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    walk(&root.join(folder), &mut found);
    let read = |path: PathBuf| {
        let name = path.strip_prefix(root).expect("below the root").display().to_string();
        (name, fs::read_to_string(&path).expect("a source"))
    };
    found.into_iter().map(read).collect()
}

/// The numbered lines of a source without its comments and without its tests, which stand last.
fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.lines().take_while(|line| !line.starts_with("#[cfg(test)]"));
    lines.enumerate().map(|(index, line)| (index + 1, line.split("//").next().unwrap_or("")))
}

fn is_test(path: &str) -> bool {
    path.ends_with("tests.rs") || path.contains("/tests/") || path.contains("/benches/")
}

/// Where any of `words` is said in the files that `among` picks; how many files those were.
fn said(words: &[&str], folders: &[&str], among: impl Fn(&str) -> bool) -> (Vec<String>, usize) {
    let mut places = Vec::new();
    let mut files = 0;
    for (path, text) in folders.iter().flat_map(|folder| sources(folder)) {
        if is_test(&path) || !among(&path) {
            continue;
        }
        files += 1;
        for (line, code) in code(&text) {
            let found = words.iter().filter(|word| code.contains(**word));
            places.extend(found.map(|word| format!("{path}:{line}: `{word}`")));
        }
    }
    (places, files)
}

#[test]
fn a_core_opens_nothing_and_reads_no_clock() {
    let is_core = |path: &str| {
        let name = path.rsplit('/').next().unwrap_or(path);
        let is_shell =
            SHELL_FILES.contains(&name) || MORE_SHELL_FILES.iter().any(|shell| path.ends_with(shell));
        path.starts_with("services/") && path.contains("/src/") && !is_shell
    };
    let (places, cores) = said(&SHELL_WORDS, &["services"], is_core);
    assert!(places.is_empty(), "a core may not say\n{}", places.join("\n"));
    assert!(cores > 0, "no core was seen");

    let pure = [LAYERS[3], LAYERS[4], LAYERS[5]].concat();
    let words = [&SHELL_WORDS[..], &["transport::", "serial::"]].concat();
    // Reading the clock and reading files is what these are for.
    let is_pure = |path: &str| {
        let name = path.split('/').nth(1).unwrap_or("");
        pure.contains(&name) && !["budget", "clock", "config"].contains(&name)
    };
    let (places, files) = said(&words, &["shared"], is_pure);
    assert!(places.is_empty(), "a pure crate may not say\n{}", places.join("\n"));
    assert!(files > 10, "only {files} files were seen");
}

#[test]
fn only_the_clock_reads_the_clock() {
    let (places, files) =
        said(&CLOCK_WORDS, &["services", "shared"], |path| !path.starts_with("shared/clock/"));
    assert!(places.is_empty(), "only `clock` may say\n{}", places.join("\n"));
    assert!(files > 20, "only {files} files were seen");
    let (inside, _) = said(&CLOCK_WORDS, &["shared"], |path| path.starts_with("shared/clock/"));
    assert!(!inside.is_empty(), "the words are no longer those by which a clock is read");
}

#[test]
fn unsafe_code_lives_where_it_is_listed() {
    let words = ["unsafe ", "unsafe_code"];
    let listed = |path: &str| MAY_BE_UNSAFE.iter().any(|folder| path.starts_with(folder));
    let (places, files) = said(&words, &["services", "shared"], |path| !listed(path));
    assert!(places.is_empty(), "unsafe code lives in {MAY_BE_UNSAFE:?} alone\n{}", places.join("\n"));
    assert!(files > 20, "only {files} files were seen");
    for folder in MAY_BE_UNSAFE {
        let (inside, _) = said(&words, &[folder], |_| true);
        assert!(!inside.is_empty(), "{folder} holds no unsafe code: take it out of MAY_BE_UNSAFE");
    }
}
