//! The examples in the documents work as they are copied.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tempfile::TempDir;

use crate::harness::{read, short_lesson, write};
use crate::recordings::{file, recorded};
use crate::venv;

/// The documents with Python programs, and the commands that run these. Each command is a line of the document.
/// They run in order in one folder, with the programs and data of the document under the names that it gives
/// them.
const RUNS: [(&str, &[&str]); 4] = [
    (
        "docs/traces.md",
        &[
            "python3 convert.py < detections.csv | leo believe -",
            "venv/bin/python to_mcap.py moved.mcap < config/traces/moved.jsonl",
            "leo believe moved.mcap",
            "leo believe config/traces/moved.jsonl --json > beliefs.jsonl",
            "python3 red.py",
        ],
    ),
    ("docs/recording.md", &["venv/bin/python ids.py task1.mcap"]),
    ("docs/tutorials/source_writer.md", &["python3 write_trace.py > lamp.jsonl", "leo believe lamp.jsonl"]),
    (
        "docs/tutorials/researcher.md",
        &["leo believe config/traces/moved.jsonl --json > beliefs.jsonl", "python3 lamp.py beliefs.jsonl"],
    ),
];

/// A fenced block of a document.
struct Block {
    language: String,
    text: String,
    /// The file whose name stands before the block.
    name: Option<String>,
}

/// The documents with their blocks: those of the repository's root, of `docs`, and of the crates.
fn documents() -> Vec<(String, String, Vec<Block>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.to_owned(), root.join("docs"), root.join("docs/tutorials")];
    let crates = fs::read_dir(root.join("shared")).expect("the crates");
    folders.extend(crates.map(|entry| entry.expect("a crate").path()));
    let mut documents = Vec::new();
    for folder in folders {
        for entry in fs::read_dir(folder).into_iter().flatten() {
            let path = entry.expect("a file").path();
            if path.extension().is_some_and(|extension| extension == "md") {
                let name = path.strip_prefix(root).expect("is in it").display().to_string();
                let text = read(&name);
                let blocks = blocks(&text);
                documents.push((name, text, blocks));
            }
        }
    }
    documents.sort_by(|(one, ..), (other, ..)| one.cmp(other));
    documents
}

fn blocks(text: &str) -> Vec<Block> {
    let (mut blocks, mut before) = (Vec::new(), String::new());
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let indent = line.len() - line.trim_start().len();
        let Some(language) = line.trim().strip_prefix("```") else {
            before.push_str(line);
            before.push('\n');
            continue;
        };
        let content = lines.by_ref().take_while(|line| line.trim() != "```");
        let content: String = content.map(|line| format!("{}\n", line.get(indent..).unwrap_or(""))).collect();
        let extension = if language == "python" { ".py" } else { &format!(".{language}") };
        let paragraph = before.trim_end().rsplit("\n\n").next().unwrap_or_default();
        let quoted = paragraph.split('`').skip(1).step_by(2);
        let name = quoted.filter(|name| name.ends_with(extension) && !name.contains(['/', ' '])).last();
        blocks.push(Block { language: language.to_owned(), text: content, name: name.map(str::to_owned) });
        before.clear();
    }
    blocks
}

/// An otherwise empty folder with what the documents tell a reader to have: the configuration of the repository, and a
/// virtual environment.
fn folder(python: &Path) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let environment = python.ancestors().nth(2).expect("it is in `bin`");
    symlink(environment, folder.path().join("venv")).expect("links");
    symlink(Path::new(env!("CARGO_MANIFEST_DIR")).join("config"), folder.path().join("config"))
        .expect("links");
    folder
}

/// Runs a command line, which must succeed without a word on standard error; returns its output.
fn run(line: &str, folder: &TempDir) -> String {
    let leo = PathBuf::from(env!("CARGO_BIN_EXE_leo"));
    let path = format!("{}:/usr/local/bin:/usr/bin:/bin", leo.parent().expect("a folder").display());
    let mut command = Command::new("sh");
    command.args(["-ec", line]).current_dir(folder.path()).stdin(Stdio::null());
    command.env_clear().env("PATH", path).env("XDG_STATE_HOME", folder.path());
    let output = command.output().expect("starts");
    let err = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && err.is_empty(), "`{line}`: {}: {err}", output.status);
    String::from_utf8(output.stdout).expect("is text")
}

#[test]
fn every_python_program_of_the_documents_runs_as_copied() {
    let Some(python) = venv::interpreter("mcap-ros2-support==0.5.7", "mcap.writer") else { return };
    let mut with_programs = BTreeSet::new();
    let mut run_programs = 0;
    for (document, text, blocks) in documents() {
        let programs: Vec<&Block> = blocks.iter().filter(|block| block.language == "python").collect();
        if programs.is_empty() {
            continue;
        }
        let (_, lines) =
            RUNS.iter().find(|(known, _)| *known == document).unwrap_or_else(|| panic!("{document}"));
        let folder = folder(&python);
        for block in &blocks {
            if let Some(name) = &block.name {
                write(&folder, name, &block.text);
            }
        }
        if document == "docs/recording.md" {
            // In place of the recording of a whole lesson, which takes longer.
            let lesson = write(&folder, "short.toml", &short_lesson());
            recorded(&lesson, &file(&folder, "task1.mcap"));
        }
        for program in programs {
            let name = program.name.as_ref().unwrap_or_else(|| panic!("{document}: {}", program.text));
            assert!(lines.iter().any(|line| line.contains(name.as_str())), "{document}: {name} is never run");
            run_programs += 1;
        }
        for line in *lines {
            assert!(text.contains(&format!("\n    {line}\n")), "{document} does not have the line `{line}`");
            let out = run(line, &folder);
            assert!(line.contains(" > ") || line.contains("to_mcap") || !out.is_empty(), "`{line}`");
            if line.contains("lamp.py") {
                assert_eq!(out, "3.6,0,1.0\n4.4,1,1.0\n");
            }
        }
        with_programs.insert(document);
    }
    assert_eq!((with_programs.len(), run_programs), (RUNS.len(), 6));
}

#[test]
fn the_converter_of_a_csv_writes_only_numbers_that_json_has() {
    if !Command::new("python3").arg("--version").output().is_ok_and(|version| version.status.success()) {
        skip::skip("there is no python3 here to convert a detector's CSV with");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    for block in blocks(&read("docs/traces.md")) {
        if let Some(name) = block.name {
            write(&folder, &name, &block.text);
        }
    }
    let rows = "time_s,label,x_m,y_m,z_m,yaw_deg,score\n\
        0.0,person,1.5,0.0,0.55,nan,0.98\n0.0,red block,0.6,0.0,0.03,NaN,0.91\n0.0,red block,nan,0.0,0.03,0,0.9\n\
        0.1,lamp on,0.6,-0.3,0.03,,0.9\n0.1,lamp on,0.6,inf,0.03,0,0.9\n0.1,lamp on,0.6,0.3,0.03,0,\n";
    write(&folder, "detections.csv", rows);
    let trace = run("python3 convert.py < detections.csv", &folder);
    let frames: Vec<serde_json::Value> =
        trace.lines().map(|line| serde_json::from_str(line).expect("is JSON")).collect();
    let counts: Vec<usize> =
        frames.iter().filter_map(|frame| frame["observations"].as_array().map(Vec::len)).collect();
    assert_eq!(counts, [1, 1], "{trace}");
    let out = run("python3 convert.py < detections.csv | leo believe -", &folder);
    assert!(out.ends_with("2 frames, 2 observations\n"), "{out}");
}

#[test]
fn every_json_and_toml_example_of_the_documents_is_well_formed() {
    let mut seen = [0, 0];
    for (document, _, blocks) in documents() {
        for Block { language, text, .. } in blocks {
            match language.as_str() {
                "json" => {
                    let parse = |text: &str| serde_json::from_str::<serde_json::Value>(text);
                    let lines = || text.lines().map(parse).collect::<Result<Vec<_>, _>>();
                    assert!(parse(&text).is_ok() || lines().is_ok(), "{document}: {:?}", lines());
                    seen[0] += 1;
                }
                "toml" => {
                    let parsed: Result<toml::Table, _> = text.parse();
                    assert!(parsed.is_ok(), "{document}: {parsed:?}");
                    seen[1] += 1;
                }
                _ => {}
            }
        }
    }
    assert!(seen[0] >= 4 && seen[1] >= 10, "{seen:?}");
}
