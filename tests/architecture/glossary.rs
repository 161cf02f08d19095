//! The glossary: each name in its last column is declared where the row says, each path exists, and each table is in
//! alphabetical order.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::source::{Source, sources};

/// The heading of a table of terms.
const HEADING: &str = "| term | meaning | in the code |";

/// A row of the glossary: its line, its term and its last cell.
struct Row {
    line: usize,
    term: String,
    code: String,
}

/// A name that a row gives, `Type` or `Type::field` or `macro!`, and the crate, module or service that must declare it.
type NameIn = (String, Option<String>);

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The tables of terms, each with its rows.
fn tables(page: &str) -> Vec<Vec<Row>> {
    let mut tables: Vec<Vec<Row>> = Vec::new();
    let mut is_table = false;
    for (line, text) in (1..).zip(page.lines()) {
        if text == HEADING {
            is_table = true;
            tables.push(Vec::new());
        } else if !text.starts_with('|') {
            is_table = false;
        } else if is_table && !text.starts_with("|---") {
            let text = text.replace("\\|", "/");
            let cells: Vec<&str> = text.trim_matches('|').split('|').map(str::trim).collect();
            let [term, _, code]: [&str; 3] = cells.try_into().expect("three cells");
            let row = Row { line, term: term.to_owned(), code: code.to_owned() };
            tables.last_mut().expect("a table").push(row);
        }
    }
    tables
}

/// The names of a cell, each with the crate in brackets behind it, and the paths of the cell.
fn names(cell: &str) -> (Vec<NameIn>, Vec<String>) {
    let parts: Vec<&str> = cell.split('`').collect();
    let (mut found, mut paths): (Vec<NameIn>, Vec<String>) = (Vec::new(), Vec::new());
    let (mut pending, mut field) = (Vec::new(), None);
    for around in parts.windows(3).step_by(2) {
        let &[before, word, after] = around else { continue };
        if before.contains(';') {
            found.extend(pending.drain(..).map(|name| (name, None)));
        }
        if word.contains('/') && !word.contains(' ') {
            paths.push(word.to_owned());
        }
        let is_type = word.starts_with(char::is_uppercase) && word.chars().all(char::is_alphanumeric);
        if before.ends_with('(') && after.starts_with(')') {
            found.extend(pending.drain(..).map(|name| (name, Some(word.to_owned()))));
        } else if is_type {
            pending.push(field.take().map_or_else(|| word.to_owned(), |field| format!("{word}::{field}")));
        } else if word.ends_with('!') {
            pending.push(word.to_owned());
        }
        field = (!is_type && after == " of ").then_some(word);
    }
    found.extend(pending.into_iter().map(|name| (name, None)));
    (found, paths)
}

/// The folder of a crate or a service, and the module in it, if one is named.
fn folder(place: &str) -> (String, Option<String>) {
    if place.contains('/') {
        return (place.to_owned(), None);
    }
    let (name, module) = place.split_once("::").map_or((place, None), |(name, module)| (name, Some(module)));
    (format!("shared/{name}"), module.map(|module| format!("/src/{}", module.replace("::", "/"))))
}

#[test]
fn every_name_in_the_glossary_is_declared_where_it_says() {
    let page = fs::read_to_string(root().join("docs/GLOSSARY.md")).expect("the glossary");
    let tables = tables(&page);
    let places = tables.iter().flatten().flat_map(|row| names(&row.code).0).filter_map(|(_, place)| place);
    // A name of `servo` is not one of `servo::mock`, where a row names that module.
    let modules: BTreeSet<(String, String)> = places
        .map(|place| folder(&place))
        .filter_map(|(folder, module)| module.map(|module| (folder, module)))
        .collect();
    let mut known: BTreeMap<String, Vec<Source>> = BTreeMap::new();
    let (mut wrong, mut compared) = (Vec::new(), 0);
    for Row { line, term, code } in tables.iter().flatten() {
        let (names, paths) = names(code);
        for path in paths.iter().filter(|path| !root().join(path).exists()) {
            wrong.push(format!("line {line}, {term}: there is no `{path}`"));
        }
        for (name, place) in names {
            compared += 1;
            let Some(place) = place else {
                wrong.push(format!("line {line}, {term}: `{name}` has no crate behind it"));
                continue;
            };
            let (folder, module) = folder(&place);
            if !root().join(&folder).exists() {
                wrong.push(format!("line {line}, {term}: there is no crate `{place}`"));
                continue;
            }
            let sources = known.entry(folder.clone()).or_insert_with(|| sources(&folder));
            let is_in_module = |path: &str| match &module {
                Some(module) => path.contains(module),
                None => !modules.iter().any(|(other, module)| *other == folder && path.contains(module)),
            };
            let mut in_module = sources.iter().filter(|source| is_in_module(&source.path));
            if !in_module.any(|source| source.content.declared.contains(&name)) {
                wrong.push(format!("line {line}, {term}: `{place}` declares no `{name}`"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(compared > 100, "only {compared} names were seen");
}

#[test]
fn the_terms_of_each_table_are_in_alphabetical_order() {
    let page = fs::read_to_string(root().join("docs/GLOSSARY.md")).expect("the glossary");
    let key = |term: &str| -> String {
        let kept = |letter: &char| letter.is_alphanumeric() || *letter == ' ';
        term.to_lowercase().chars().filter(kept).collect()
    };
    let tables = tables(&page);
    for pair in tables.iter().flat_map(|rows| rows.windows(2)) {
        let [before, after] = pair else { continue };
        let is_sorted = key(&before.term) < key(&after.term);
        assert!(is_sorted, "line {}: \"{}\" comes before \"{}\"", after.line, after.term, before.term);
    }
    assert_eq!(tables.len(), 9, "tables of terms");
}

#[test]
fn names_are_read_with_their_crate_their_field_and_their_paths() {
    let cell =
        "`Wrong`; `bits` of `Inquiry`, `Metric` (`tasks`); `try!` (`a::b`), `services/motor`, `[learner]`";
    let (names, paths) = names(cell);
    let expected = [
        ("Wrong", None),
        ("Inquiry::bits", Some("tasks")),
        ("Metric", Some("tasks")),
        ("try!", Some("a::b")),
    ];
    let expected = expected.map(|(name, place)| (name.to_owned(), place.map(str::to_owned)));
    assert_eq!(names, expected);
    assert_eq!(paths, ["services/motor"]);
    assert_eq!(folder("servo::mock"), ("shared/servo".to_owned(), Some("/src/mock".to_owned())));
}
