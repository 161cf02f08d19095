//! Message layouts for other languages: a C header and a Python module, generated from the sources of this crate.
//! `LEO_REWRITE=1 cargo test -p leo-message` regenerates them.

mod c;
mod numbers;
mod python;

use std::collections::BTreeMap;
use std::process::Command;

use crate::declared::{Declared, array, compare, compiled, declared};

const HEADER: &str = "../../docs/examples/c/leo_messages.h";
const MODULE: &str = "../../docs/examples/python/leo_messages.py";

/// The types in dependency order: each after the types that it contains.
fn in_order(declared: &BTreeMap<String, Declared>) -> Vec<(&str, &Declared)> {
    fn visit<'a>(name: &'a str, all: &'a BTreeMap<String, Declared>, out: &mut Vec<(&'a str, &'a Declared)>) {
        let Some(declared) = all.get(name) else { return };
        if out.iter().any(|(known, _)| *known == name) {
            return;
        }
        for field in &declared.fields {
            visit(array(&field.kind).map_or(field.kind.as_str(), |(entry, _)| entry), all, out);
        }
        out.push((name, declared));
    }
    let mut out = Vec::new();
    for name in declared.keys() {
        visit(name, declared, &mut out);
    }
    out
}

#[test]
fn the_c_header_is_made_from_the_sources() {
    let declared = declared();
    compare(HEADER, &c::header(&in_order(&declared), &numbers::numbers(), &compiled()));
}

#[test]
fn the_python_module_is_made_from_the_sources() {
    let declared = declared();
    compare(MODULE, &python::module(&in_order(&declared), &numbers::numbers(), &compiled()));
}

/// Runs a tool, which must succeed without output. `None` if the machine does not have it.
fn passes(tool: &str, arguments: &[&str]) -> Option<()> {
    let output = Command::new(tool).args(arguments).output().ok()?;
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.is_empty(), "{tool} {arguments:?}\n{said}");
    Some(())
}

#[test]
fn a_c_compiler_agrees_with_every_size_and_offset() {
    let header = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/examples/c/leo_messages.h");
    let strict = ["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only", "-x", "c"];
    if passes("cc", &[&strict[..], &[header]].concat()).is_none() {
        skip::skip("there is no C compiler `cc` here");
        return;
    }
    // The same header is for C++ too.
    let cpp = ["-std=c++11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-x", "c++", header];
    if passes("c++", &cpp).is_none() {
        skip::skip("there is no C++ compiler `c++` here");
    }
    // Checks that the assertions can fail: packed structs have other offsets.
    let packed =
        Command::new("cc").args(strict).args(["-fpack-struct=1", header]).output().expect("is there");
    assert!(!packed.status.success());
    assert!(String::from_utf8_lossy(&packed.stderr).contains("static assertion failed"));
}

#[test]
fn python_agrees_with_every_size_and_offset() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/examples/python");
    let import = format!(
        "import sys; sys.dont_write_bytecode = True; sys.path.insert(0, {folder:?}); import leo_messages"
    );
    if passes("python3", &["-c", &import]).is_none() {
        skip::skip("there is no `python3` here");
    }
}
