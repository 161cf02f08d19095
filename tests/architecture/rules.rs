//! Where input and output, the clock and unsafe code may be.

use std::collections::BTreeSet;

use crate::layers::{LAYERS, dependencies};
use crate::source::{Source, sources};

/// Crates and modules that do input or output, read a clock, or wait: a core names none of them.
const IO_PATHS: [&str; 27] = [
    "axum",
    "clock::now",
    "clock::sleep_until",
    "folder",
    "hyper",
    "iceoryx2",
    "libc",
    "process",
    "quinn",
    "ratatui::crossterm",
    "ratatui::init",
    "realtime",
    "recording",
    "rustix",
    "rustls",
    "serial",
    "signal_hook",
    "std::env",
    "std::fs",
    "std::net",
    "std::os",
    "std::process",
    "std::thread",
    "store",
    "tokio",
    "tokio_tungstenite",
    "transport",
];

/// Methods of a path that ask the file system.
const IO_METHODS: [&str; 7] =
    [".canonicalize", ".exists", ".is_dir", ".is_file", ".read_dir", ".symlink_metadata", ".try_exists"];

/// Plain values of the crates above, which a core may name: two error types, a bit, a table of words, and a message for
/// viewers with its schema.
const VALUES: [&str; 6] = [
    "realtime::MEMORY",
    "realtime::SerialWorkersError",
    "realtime::grants",
    "recording::Schema",
    "recording::ViewerMessage",
    "serial::LineLostError",
];

/// Reading the machine's clock, or waiting by it, however it is imported.
const CLOCK_PATHS: [&str; 7] = [
    ".elapsed",
    "std::thread::sleep",
    "std::time::Instant::now",
    "std::time::SystemTime::now",
    "rustix::time::clock_gettime",
    "rustix::thread::clock_nanosleep_absolute",
    "rustix::thread::nanosleep",
];

/// Folders that may hold unsafe code.
const MAY_BE_UNSAFE: [&str; 4] =
    ["shared/prefetch/", "shared/reader/", "shared/realtime/", "tests/support/testkit/"];

/// Crates without a core: reading the clock, files or the environment is what they are for.
const READS_BY_PURPOSE: [&str; 3] = ["budget", "clock", "config"];

/// Whether a path is one of the forbidden ones, lies below one, or imports one by a glob.
fn is_below(name: &str, forbidden: &str) -> bool {
    let is_within = |inner: &str, outer: &str| {
        inner.strip_prefix(outer).is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
    };
    is_within(name, forbidden)
        || name.strip_suffix("::*").is_some_and(|parent| is_within(forbidden, parent) && parent != forbidden)
}

/// Where the sources that `among` picks name something forbidden; and how many sources those are.
fn named(all: &[Source], forbidden: &[&str], among: impl Fn(&str) -> bool) -> (Vec<String>, usize) {
    let picked: Vec<&Source> = all.iter().filter(|source| among(&source.path)).collect();
    let mut places = Vec::new();
    for source in &picked {
        for named in &source.content.names {
            let is_value = VALUES.iter().any(|value| is_below(&named.name, value));
            if !is_value && forbidden.iter().any(|forbidden| is_below(&named.name, forbidden)) {
                places.push(format!("{}:{}: `{}`", source.path, named.line, named.name));
            }
        }
    }
    (places, picked.len())
}

/// The commands have no core: they read files, print, and start processes.
const COMMANDS: &str = "services/command/";

/// Whether a source of a service is in its core: outside `src/io.rs` and `src/io/`.
fn is_service_core(path: &str) -> bool {
    !path.starts_with(COMMANDS)
        && path.split_once("/src/").is_some_and(|(_, file)| file != "io.rs" && !file.starts_with("io/"))
}

/// The library of a package. One that can be published is called after its folder, with `leo-` before it.
fn library(package: &str) -> String {
    package.strip_prefix("leo-").unwrap_or(package).replace('-', "_")
}

fn all() -> Vec<Source> {
    ["services", "shared", "tests/support"].into_iter().flat_map(sources).collect()
}

#[test]
fn a_core_does_no_io_and_reads_no_clock() {
    let forbidden = [&IO_PATHS[..], &IO_METHODS].concat();
    let services = sources("services");
    let (places, cores) = named(&services, &forbidden, is_service_core);
    assert!(places.is_empty(), "only `src/io/` of a service may name\n{}", places.join("\n"));
    assert!(cores > 50, "only {cores} sources of cores were seen");
    let (exempt, _) = named(&services, &forbidden, |path| path.starts_with(COMMANDS));
    assert!(!exempt.is_empty(), "{COMMANDS} does no input or output: check it as a core");

    let pure = LAYERS[4..].concat();
    let is_pure = |path: &str| {
        let name = path.split('/').nth(1).unwrap_or("");
        let is_of = |package: &&str| library(package) == name;
        pure.iter().any(is_of) && !READS_BY_PURPOSE.contains(&name)
    };
    let (places, files) = named(&sources("shared"), &forbidden, is_pure);
    assert!(places.is_empty(), "a pure crate may not name\n{}", places.join("\n"));
    assert!(files > 50, "only {files} sources of pure crates were seen");

    let known: BTreeSet<String> = dependencies().into_values().flatten().map(|name| library(&name)).collect();
    for path in IO_PATHS {
        let root = path.split("::").next().unwrap_or(path);
        assert!(
            root == "std" || known.contains(root),
            "no crate depends on `{root}`: take it out of the list"
        );
    }
}

#[test]
fn only_the_clock_reads_the_clock() {
    let all = all();
    let (places, files) = named(&all, &CLOCK_PATHS, |path| !path.starts_with("shared/clock/"));
    assert!(places.is_empty(), "only `clock` may name\n{}", places.join("\n"));
    assert!(files > 200, "only {files} sources were seen");
    let (inside, _) = named(&all, &CLOCK_PATHS, |path| path.starts_with("shared/clock/"));
    assert!(!inside.is_empty(), "the paths are no longer those by which a clock is read");
}

#[test]
fn unsafe_code_is_where_it_is_listed() {
    let all = all();
    let is_listed = |path: &str| MAY_BE_UNSAFE.iter().any(|folder| path.starts_with(folder));
    let (inside, outside): (Vec<&Source>, Vec<&Source>) = all
        .iter()
        .filter(|source| !source.content.unsafe_lines.is_empty())
        .partition(|source| is_listed(&source.path));
    let places: Vec<String> =
        outside.iter().map(|source| format!("{}:{:?}", source.path, source.content.unsafe_lines)).collect();
    assert!(places.is_empty(), "unsafe code is allowed in {MAY_BE_UNSAFE:?} alone\n{}", places.join("\n"));
    for folder in MAY_BE_UNSAFE {
        let is_used = inside.iter().any(|source| source.path.starts_with(folder));
        assert!(is_used, "{folder} holds no unsafe code: take it out of the list");
    }
}

#[test]
fn a_forbidden_path_is_recognised_below_it_and_by_a_glob() {
    let cases = [
        ("std::fs", true),
        ("std::fs::read", true),
        ("std::*", true),
        ("std::fs::*", true),
        ("std::fsx::read", false),
        ("std::path::Path", false),
        ("crate::std::fs", false),
    ];
    for (name, expected) in cases {
        assert_eq!(is_below(name, "std::fs"), expected, "{name}");
    }
}
