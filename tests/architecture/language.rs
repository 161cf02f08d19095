//! The language of comments and documents, and what documents refer to.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Pronouns of persons. A machine is named by a noun.
const PRONOUNS: [&str; 10] =
    ["anybody", "everybody", "he", "him", "his", "nobody", "somebody", "who", "whoever", "whom"];

/// Lines of comments that may hold a pronoun: they are about people. Raise it for no machine.
const MAX_IN_COMMENTS: usize = 30;
/// The same for the documents.
const MAX_IN_DOCUMENTS: usize = 60;
/// The README is for a stranger.
const MAX_README_LINES: usize = 120;
/// The name of a test is read in a list of a thousand.
const MAX_WORDS_OF_A_TEST: usize = 12;
/// A word of so many parts is the name of a test, a metric or a key: it must exist.
const PARTS_OF_A_NAME: usize = 5;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The files of the repository with one of these endings, except what is built or installed.
fn files(endings: &[&str]) -> Vec<(PathBuf, String)> {
    fn walk(folder: &Path, endings: &[&str], found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("a folder").flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            let name = name.to_string_lossy();
            if ["target", "node_modules", ".git"].contains(&name.as_ref()) {
                continue;
            }
            if path.is_dir() {
                walk(&path, endings, found);
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    walk(root(), endings, &mut found);
    found.sort();
    let text = |path: PathBuf| {
        let bytes = fs::read(&path).expect("a file of the repository");
        (path, String::from_utf8_lossy(&bytes).into_owned())
    };
    found.into_iter().map(text).collect()
}

/// Lines with a pronoun, outside code, as `path:line: text`.
fn with_pronoun<'a>(path: &Path, lines: impl Iterator<Item = (usize, &'a str)>) -> Vec<String> {
    let path = path.strip_prefix(root()).unwrap_or(path).display().to_string();
    let mut is_code = false;
    let mut found = Vec::new();
    for (number, line) in lines {
        if line.trim_start().starts_with("```") {
            is_code = !is_code;
        }
        // What stands between backticks is code as well.
        let prose: String = line.split('`').step_by(2).collect::<Vec<_>>().join(" ").to_lowercase();
        let mut words = prose.split(|letter: char| !letter.is_alphanumeric() && letter != '_');
        if !is_code && words.any(|word| PRONOUNS.contains(&word)) {
            found.push(format!("{path}:{number}: {}", line.trim()));
        }
    }
    found
}

#[test]
fn comments_name_machines_by_nouns() {
    let comments = |(path, text): &(PathBuf, String)| {
        let lines = (1..).zip(text.lines()).filter_map(|(number, line)| {
            let comment = line.trim_start().strip_prefix("//")?;
            Some((number, comment.trim_start_matches(['/', '!'])))
        });
        with_pronoun(path, lines)
    };
    let found: Vec<String> = files(&[".rs"]).iter().flat_map(comments).collect();
    assert!(found.len() <= MAX_IN_COMMENTS, "{} lines:\n{}", found.len(), found.join("\n"));
}

#[test]
fn documents_name_machines_by_nouns() {
    let lines = |(path, text): &(PathBuf, String)| with_pronoun(path, (1..).zip(text.lines()));
    let found: Vec<String> = files(&[".md"]).iter().flat_map(lines).collect();
    assert!(found.len() <= MAX_IN_DOCUMENTS, "{} lines:\n{}", found.len(), found.join("\n"));
}

#[test]
fn the_name_of_a_test_has_at_most_twelve_words() {
    let mut names = 0;
    for (path, text) in files(&[".rs"]) {
        for rest in text.split("#[test]").skip(1) {
            let name = rest.split("fn ").nth(1).and_then(|rest| rest.split('(').next()).unwrap_or_default();
            names += 1;
            assert!(name.split('_').count() <= MAX_WORDS_OF_A_TEST, "{}: {name}", path.display());
        }
    }
    assert!(names > 1000, "only {names} tests were seen");
}

#[test]
fn the_readme_is_short() {
    let text = fs::read_to_string(root().join("README.md")).expect("a README");
    assert!(text.lines().count() <= MAX_README_LINES, "{} lines", text.lines().count());
}

/// The anchor that a heading gets.
fn anchor(heading: &str) -> String {
    let kept = |letter: char| letter.is_alphanumeric() || letter == '-' || letter == '_' || letter == ' ';
    heading.trim().to_lowercase().chars().filter(|letter| kept(*letter)).collect::<String>().replace(' ', "-")
}

fn anchors(text: &str) -> Vec<String> {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    headings.map(|line| anchor(line.trim_start_matches('#'))).collect()
}

#[test]
fn every_link_between_documents_leads_somewhere() {
    let mut wrong = Vec::new();
    let mut links = 0;
    for (path, text) in files(&[".md"]) {
        let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        for target in targets.filter(|target| !target.contains("://") && !target.contains(' ')) {
            links += 1;
            let (file, heading) = target.split_once('#').unwrap_or((target, ""));
            let file = if file.is_empty() { path.clone() } else { path.with_file_name("").join(file) };
            let leads = file.exists()
                && (heading.is_empty()
                    || fs::read_to_string(&file)
                        .is_ok_and(|text| anchors(&text).contains(&heading.to_owned())));
            if !leads {
                wrong.push(format!("{}: {target}", path.strip_prefix(root()).unwrap_or(&path).display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(links > 100, "only {links} links were seen");
}

#[test]
fn every_long_name_in_a_document_exists() {
    fn words(text: &str) -> impl Iterator<Item = &str> {
        text.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_')
    }
    let mut known = BTreeSet::new();
    for (_, text) in
        files(&[".rs", ".toml", ".js", ".mjs", ".sh", ".py", ".h", ".json", ".service", ".rules"])
    {
        known.extend(words(&text).filter(|word| word.contains('_')).map(str::to_owned));
    }
    let mut wrong = Vec::new();
    let mut names = 0;
    for (path, text) in files(&[".md"]) {
        // Names of the middleware, and of files with a number, are not in the sources.
        let is_ours =
            |word: &&str| !word.starts_with("iox2_") && !word.starts_with('_') && !word.contains("_00");
        let long = |word: &&str| word.split('_').count() >= PARTS_OF_A_NAME;
        for word in words(&text).filter(long).filter(is_ours) {
            names += 1;
            // A metric is exported with a suffix of its kind.
            let stem =
                ["_total", "_bucket", "_count", "_sum"].iter().find_map(|kind| word.strip_suffix(kind));
            if !known.contains(word) && !stem.is_some_and(|stem| known.contains(stem)) {
                wrong.push(format!("{}: {word}", path.strip_prefix(root()).unwrap_or(&path).display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(names > 50, "only {names} names were seen");
}

#[test]
fn every_filter_of_a_promise_selects_a_test() {
    let mut names: BTreeSet<String> = BTreeSet::new();
    for (path, text) in files(&[".rs"]) {
        names.extend(path.file_stem().map(|stem| stem.to_string_lossy().into_owned()));
        let functions = text.split("fn ").skip(1);
        let name = |rest: &str| {
            rest.split(|letter: char| !letter.is_alphanumeric() && letter != '_').next().map(str::to_owned)
        };
        names.extend(functions.filter_map(name));
    }
    let page = fs::read_to_string(root().join("docs/promises.md")).expect("the promises");
    let mut filters = 0;
    for command in page.split('`').skip(1).step_by(2).filter(|text| text.starts_with("cargo test")) {
        let mut words = command.split_whitespace().skip(2);
        while let Some(word) = words.next() {
            match word {
                "--test" | "-p" => drop(words.next()),
                option if option.starts_with('-') => {}
                filter => {
                    filters += 1;
                    let is_known = names.iter().any(|name| name.contains(filter));
                    assert!(is_known, "`{command}` selects no test");
                }
            }
        }
    }
    assert!(filters > 10, "only {filters} filters were seen");
}

#[test]
fn a_pronoun_is_seen_in_prose_and_not_in_code() {
    let lines = ["the servo, whoever it is", "`who` is a command", "```", "who = 1", "```", "Who?"];
    let found = with_pronoun(Path::new("page.md"), (1..).zip(lines));
    assert_eq!(found, ["page.md:1: the servo, whoever it is", "page.md:6: Who?"]);
}
