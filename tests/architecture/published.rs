//! The crates that can be published: a package needs no file from the rest of the repository, and its README says what
//! a program that uses it depends on.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

use cargo_metadata::Package;

use crate::layers::packages;

/// What reads a file at compile time: its name is the first literal behind it.
const INCLUDES: [&str; 3] = ["include_str!(", "include_bytes!(", "#[path = "];

/// The packages that `cargo publish --workspace` uploads. Their names are not taken: they begin with `leo-`.
fn published() -> Vec<Package> {
    let (published, others): (Vec<Package>, Vec<Package>) =
        packages().into_iter().partition(|package| package.publish.is_none());
    assert!(published.iter().all(|package| package.name.starts_with("leo-")), "names that are not ours");
    let kept: Vec<&str> = others.iter().map(|package| package.name.as_str()).collect();
    assert!(kept.iter().all(|name| !name.starts_with("leo-")), "{kept:?}: one of them lost its `publish`");
    published
}

fn folder(package: &Package) -> &Path {
    package.manifest_path.parent().expect("a folder").as_std_path()
}

/// The files in a package, relative to its folder.
fn files(package: &Package) -> BTreeSet<PathBuf> {
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let list = ["package", "--list", "--allow-dirty", "--offline", "--quiet"];
    let output = Command::new(cargo).args(list).current_dir(folder(package)).output().expect("cargo");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("paths").lines().map(PathBuf::from).collect()
}

/// The files that a source reads at compile time, relative to the folder of its package.
fn included(file: &Path, text: &str) -> Vec<PathBuf> {
    let places = INCLUDES.iter().flat_map(|include| text.match_indices(include));
    let name = |(at, include): (usize, &str)| {
        let mut literals = text.get(at + include.len()..)?.split('"').skip(1).step_by(2);
        let first = literals.next()?;
        let path = if first == "CARGO_MANIFEST_DIR" {
            PathBuf::from(literals.next()?.trim_start_matches('/'))
        } else {
            file.parent()?.join(first)
        };
        Some(without_parents(&path))
    };
    places.filter_map(name).collect()
}

/// The path without `..`, where they do not lead out of the folder.
fn without_parents(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for component in path.components() {
        if component != Component::ParentDir || !plain.pop() {
            plain.push(component);
        }
    }
    plain
}

#[test]
fn a_package_contains_every_file_that_it_includes() {
    let (mut missing, mut seen) = (Vec::new(), 0);
    for package in published() {
        let files = files(&package);
        assert!(files.contains(Path::new("LICENSE-MIT")) && files.contains(Path::new("LICENSE-APACHE")));
        for file in files.iter().filter(|file| file.extension().is_some_and(|extension| extension == "rs")) {
            let text = fs::read_to_string(folder(&package).join(file)).expect("a source");
            for name in included(file, &text) {
                seen += 1;
                if !files.contains(&name) {
                    missing.push(format!("{}: {} includes {}", package.name, file.display(), name.display()));
                }
            }
        }
    }
    assert!(missing.is_empty(), "not in the package:\n{}", missing.join("\n"));
    assert!(seen > 10, "only {seen} included files were seen");
}

/// The lines of the first block of a language.
fn block<'a>(readme: &'a str, language: &str) -> Vec<&'a str> {
    let from = readme.lines().skip_while(|line| *line != format!("```{language}")).skip(1);
    from.take_while(|line| *line != "```").collect()
}

#[test]
fn a_readme_lists_the_dependencies_of_its_example() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let published = published();
    let library = |package: &Package| {
        package.targets.iter().find(|target| target.is_lib()).map(|target| target.name.clone())
    };
    let mut compared = 0;
    for package in published.iter().filter(|package| package.readme.is_some()) {
        let readme = fs::read_to_string(folder(package).join("README.md")).expect("a README");
        let source = fs::read_to_string(folder(package).join("src/lib.rs")).expect("a library");
        assert!(
            source.starts_with("#![doc = include_str!(\"../README.md\")]"),
            "not compiled: {}",
            package.name
        );

        let example = block(&readme, "rust");
        let used = example.iter().filter_map(|line| line.strip_prefix("use ")?.split("::").next());
        let mut expected = vec!["[dependencies]".to_owned()];
        for name in BTreeSet::from_iter(used.filter(|name| *name != "std")) {
            let of = published.iter().find(|other| library(other).as_deref() == Some(name));
            let of = of.unwrap_or_else(|| panic!("{}: `{name}` is not published", package.name));
            let path = folder(of).strip_prefix(root).expect("below the root").display();
            expected
                .push(format!("{} = {{ version = \"{}\", path = \"../leo/{path}\" }}", of.name, of.version));
        }
        assert_eq!(block(&readme, "toml"), expected, "{}", package.name);
        compared += usize::from(expected.len() > 1);
    }
    assert_eq!(compared, 9, "READMEs with an example");
}
