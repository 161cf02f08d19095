//! The sources of the repository, without those that are compiled for tests alone.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::paths::Content;

/// A source file: its path in the repository, and what it holds outside its tests.
pub(crate) struct Source {
    pub(crate) path: String,
    pub(crate) content: Content,
}

/// Every source below a folder of the repository, except tests, benches and modules for tests.
pub(crate) fn sources(folder: &str) -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    walk(&root.join(folder), &mut files);
    let parse = |file: &PathBuf| {
        let path = file.strip_prefix(root).expect("below the root").display().to_string();
        let text = fs::read_to_string(file).expect("a source");
        let content = Content::parse(&text).map_err(|error| format!("{path}: {error}")).expect("Rust");
        Source { path, content }
    };
    let all: Vec<Source> = files.iter().map(parse).collect();
    let for_tests: BTreeSet<String> = all.iter().flat_map(modules_for_tests).collect();
    let is_test = |path: &str| {
        path.contains("/benches/")
            || path.split_once("/tests/").is_some_and(|(before, _)| !before.contains("/src"))
            || for_tests
                .iter()
                .any(|test| path == format!("{test}.rs") || path.starts_with(&format!("{test}/")))
    };
    all.into_iter().filter(|source| !is_test(&source.path)).collect()
}

/// The modules for tests that a source declares, as paths without an ending.
fn modules_for_tests(source: &Source) -> Vec<String> {
    let path = Path::new(&source.path);
    let is_root =
        path.file_name().is_some_and(|name| name == "lib.rs" || name == "main.rs" || name == "mod.rs");
    let folder = if is_root { path.parent().unwrap_or(path).to_owned() } else { path.with_extension("") };
    source.content.test_modules.iter().map(|module| folder.join(module).display().to_string()).collect()
}

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
