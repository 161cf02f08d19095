//! The modules of a crate: no files import each other in a circle, and an import of a crate with layers goes down.

use std::collections::BTreeSet;

use crate::paths::Content;
use crate::source::{Source, sources};

/// The modules of a crate by the folder of its sources, the lowest layer first. An import only goes down.
const MODULES: [(&str, &[&str]); 2] = [
    ("shared/belief/src", &["association", "storage", "system"]),
    ("shared/tasks/src", &["language", "demonstration", "hypotheses", "decision"]),
];

/// An import: the module that imports, and the module that it imports from. The root of the crate is "".
type Arrow = (String, String);

/// The module of a source, as its path below the root of the crate.
fn module_of(path: &str, folder: &str) -> Option<String> {
    let file = path.strip_prefix(folder)?.strip_prefix('/')?.strip_suffix(".rs")?;
    Some(if file == "lib" { String::new() } else { file.replace('/', "::") })
}

/// The module that a name belongs to, as seen from the module `here`; `None` for a name of another crate.
fn target(name: &str, here: &str, modules: &BTreeSet<String>) -> Option<String> {
    let mut path: Vec<&str> = here.split("::").filter(|segment| !segment.is_empty()).collect();
    let mut rest = name.split("::").peekable();
    match rest.next()? {
        "crate" => path.clear(),
        "self" => {}
        "super" => {
            path.pop();
        }
        _ => return None,
    }
    while rest.next_if_eq(&"super").is_some() {
        path.pop();
    }
    path.extend(rest);
    while !modules.contains(&path.join("::")) {
        path.pop()?;
    }
    Some(path.join("::"))
}

/// Every import from one file of a crate to another.
fn arrows(all: &[Source], folder: &str) -> BTreeSet<Arrow> {
    let module = |source: &Source| module_of(&source.path, folder);
    let modules: BTreeSet<String> = all.iter().filter_map(module).collect();
    let mut arrows = BTreeSet::new();
    for (here, source) in all.iter().filter_map(|source| Some((module(source)?, source))) {
        let names = source.content.names.iter();
        let to = names.filter_map(|named| target(&named.name, &here, &modules));
        arrows.extend(to.filter(|to| *to != here).map(|to| (here.clone(), to)));
    }
    arrows
}

/// What is wrong with the imports of a crate.
fn faults(arrows: &BTreeSet<Arrow>, layers: &[&str]) -> Vec<String> {
    let layer_of = |module: &str| layers.iter().position(|layer| module.split("::").next() == Some(layer));
    let modules: BTreeSet<&String> = arrows.iter().flat_map(|(from, to)| [from, to]).collect();
    let outside = modules.into_iter().filter(|module| !module.is_empty() && layer_of(module).is_none());
    let mut wrong: Vec<String> =
        outside.map(|module| format!("`{module}` is in no layer: list it in MODULES")).collect();
    let mut down = Vec::new();
    for (from, to) in arrows {
        match (layer_of(from), layer_of(to)) {
            (Some(_), None) if to.is_empty() => {
                wrong.push(format!("`{from}` imports from the crate's root: name the module"));
            }
            (Some(layer), Some(other)) if layer < other => {
                wrong.push(format!("`{from}` may not import from `{to}`, in a higher layer"));
            }
            _ => down.push((from.as_str(), to.as_str())),
        }
    }
    wrong.extend(circle(down).map(|circle| format!("a circle: `{}`", circle.join("` -> `"))));
    wrong
}

/// The modules of a circle of imports, the first one again at the end.
fn circle<'a>(mut arrows: Vec<(&'a str, &'a str)>) -> Option<Vec<&'a str>> {
    // An import from a module that imports nothing is in no circle.
    loop {
        let before = arrows.len();
        let importing: BTreeSet<&str> = arrows.iter().map(|(from, _)| *from).collect();
        arrows.retain(|(_, to)| importing.contains(to));
        if arrows.len() == before {
            break;
        }
    }
    let mut path = vec![arrows.first()?.0];
    loop {
        let (_, next) = *arrows.iter().find(|(from, _)| path.last() == Some(from))?;
        let begin = path.iter().position(|module| *module == next);
        path.push(next);
        if let Some(begin) = begin {
            return Some(path.split_off(begin));
        }
    }
}

#[test]
fn an_import_between_modules_only_goes_down() {
    for (folder, layers) in MODULES {
        let arrows = arrows(&sources(folder), folder);
        let wrong = faults(&arrows, layers);
        assert!(wrong.is_empty(), "in {folder}\n{}", wrong.join("\n"));
        for layer in layers {
            assert!(arrows.iter().any(|(_, to)| to == layer), "no file imports from `{layer}` in {folder}");
        }
        assert!(arrows.len() > 50, "only {} imports were seen in {folder}", arrows.len());
    }
}

/// A circle of the imports between the files of a crate. A module and the modules inside it count as one.
fn circle_of_files(arrows: &BTreeSet<Arrow>) -> Option<String> {
    let is_inside = |inner: &str, outer: &str| {
        outer.is_empty() || inner.strip_prefix(outer).is_some_and(|rest| rest.starts_with("::"))
    };
    let is_across = |(from, to): &&Arrow| !is_inside(from, to) && !is_inside(to, from);
    let across = arrows.iter().filter(is_across).map(|(from, to)| (from.as_str(), to.as_str()));
    Some(format!("a circle: `{}`", circle(across.collect())?.join("` -> `")))
}

#[test]
fn no_files_of_a_crate_import_each_other() {
    let all: Vec<Source> = ["services", "shared", "tests/support"].into_iter().flat_map(sources).collect();
    let folder = |source: &Source| Some(format!("{}/src", source.path.split_once("/src/")?.0));
    let folders: BTreeSet<String> = all.iter().filter_map(folder).collect();
    let mut seen = 0;
    let mut wrong = Vec::new();
    for folder in &folders {
        let arrows = arrows(&all, folder);
        seen += arrows.len();
        wrong.extend(circle_of_files(&arrows).map(|circle| format!("in {folder} {circle}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(folders.len() > 30 && seen > 1000, "only {seen} imports of {} crates were seen", folders.len());
}

#[test]
fn files_that_import_each_other_are_found() {
    let found = |texts: [(&str, &str); 4]| {
        let all = texts.map(|(path, text)| Source {
            path: format!("a/src/{path}.rs"),
            content: Content::parse(text).expect("Rust"),
        });
        circle_of_files(&arrows(&all, "a/src"))
    };
    let [lib, b] = [("lib", "mod a; mod b; use a::A;"), ("b", "use crate::a::A; pub struct B(A);")];
    let inside = ("a/inner", "use super::A; pub struct C(A);");
    assert_eq!(found([lib, b, inside, ("a", "mod inner; use inner::C; pub struct A(C);")]), None);
    let around = found([lib, b, inside, ("a", "mod inner; pub struct A(crate::b::B);")]);
    assert_eq!(around.as_deref(), Some("a circle: `a` -> `b` -> `a`"));
}

#[test]
fn the_storage_of_beliefs_takes_one_trait_of_the_association() {
    let all = sources("shared/belief/src");
    let of_storage = all.iter().filter(|source| source.path.contains("/src/storage"));
    let names = of_storage.flat_map(|source| &source.content.names);
    let taken = names.filter_map(|named| Some(named.name.split_once("association::")?.1));
    assert_eq!(taken.collect::<BTreeSet<_>>(), BTreeSet::from(["FeatureStore"]));
}

#[test]
fn an_import_that_goes_up_or_around_is_found() {
    let source = |path: &str, text: &str| Source {
        path: format!("a/src/{path}.rs"),
        content: Content::parse(text).expect("Rust"),
    };
    let found = |low: &str, high: &str| {
        let all = [
            source("lib", "mod low; mod high; pub use high::B; pub use low::A;"),
            source("low", "mod inner; pub use inner::A;"),
            source("low/inner", low),
            source("high", high),
        ];
        faults(&arrows(&all, "a/src"), &["low", "high"])
    };
    assert_eq!(found("use std::fs; pub struct A;", "use crate::low::A; pub struct B(A);"), [""; 0]);
    let up = found("pub struct A(crate::high::B);", "pub struct B;");
    assert_eq!(up, ["`low::inner` may not import from `high`, in a higher layer"]);
    let root = found("pub struct A;", "use super::A; pub struct B(A);");
    assert_eq!(root, ["`high` imports from the crate's root: name the module"]);
    let around = found("use super::C; pub struct A(C);", "pub struct B;");
    assert_eq!(around, ["a circle: `low` -> `low::inner` -> `low`"]);
}
