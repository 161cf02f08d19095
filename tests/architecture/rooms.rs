//! The rooms of a crate: its modules lie above one another, and no files import each other in a circle.

use std::collections::BTreeSet;

use crate::source::{Source, sources};

/// The rooms of a crate by the folder of its sources, the lowest room first. An import only goes down.
const ROOMS: [(&str, &[&str]); 1] = [("shared/belief/src", &["association", "storage", "system"])];

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
fn faults(arrows: &BTreeSet<Arrow>, rooms: &[&str]) -> Vec<String> {
    let floor = |module: &str| rooms.iter().position(|room| module.split("::").next() == Some(room));
    let modules: BTreeSet<&String> = arrows.iter().flat_map(|(from, to)| [from, to]).collect();
    let outside = modules.into_iter().filter(|module| !module.is_empty() && floor(module).is_none());
    let mut wrong: Vec<String> = outside.map(|module| format!("`{module}` is in no room")).collect();
    for (from, to) in arrows {
        match (floor(from), floor(to)) {
            (Some(_), None) if to.is_empty() => {
                wrong.push(format!("`{from}` imports from the crate's root: name the room"));
            }
            (Some(room), Some(other)) if room < other => {
                wrong.push(format!("`{from}` may not import from `{to}`, in a higher room"));
            }
            _ => {}
        }
    }
    wrong.extend(in_circles(arrows).iter().map(|(from, to)| format!("`{from}` -> `{to}` is in a circle")));
    wrong
}

/// The imports that are left when modules are removed that import nothing, or that nothing imports.
fn in_circles(arrows: &BTreeSet<Arrow>) -> BTreeSet<Arrow> {
    let mut left = arrows.clone();
    loop {
        let from: BTreeSet<&String> = left.iter().map(|(from, _)| from).collect();
        let to: BTreeSet<&String> = left.iter().map(|(_, to)| to).collect();
        let is_kept = |arrow: &&Arrow| from.contains(&arrow.1) && to.contains(&arrow.0);
        let kept: BTreeSet<Arrow> = left.iter().filter(is_kept).cloned().collect();
        if kept.len() == left.len() {
            return left;
        }
        left = kept;
    }
}

#[test]
fn an_import_between_rooms_only_goes_down() {
    for (folder, rooms) in ROOMS {
        let arrows = arrows(&sources(folder), folder);
        let wrong = faults(&arrows, rooms);
        assert!(wrong.is_empty(), "in {folder}\n{}", wrong.join("\n"));
        for room in rooms {
            assert!(arrows.iter().any(|(_, to)| to == room), "no file imports from `{room}` in {folder}");
        }
        assert!(arrows.len() > 50, "only {} imports were seen in {folder}", arrows.len());
    }
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
        content: crate::paths::Content::parse(text).expect("Rust"),
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
    assert_eq!(up, ["`low::inner` may not import from `high`, in a higher room"]);
    let root = found("pub struct A;", "use super::A; pub struct B(A);");
    assert!(root.contains(&"`high` imports from the crate's root: name the room".to_owned()), "{root:?}");
    let around = found("use super::C; pub struct A(C);", "pub struct B;");
    assert_eq!(around, ["`low` -> `low::inner` is in a circle", "`low::inner` -> `low` is in a circle"]);
}
