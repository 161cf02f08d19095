//! The commands, programs and data in the documents work as they are copied.

mod by_hand;
mod documents;
mod session;
mod shell;
mod table;
mod trial;

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;
use std::sync::Mutex;
use std::thread;

use documents::{Block, Document};
use session::Session;
use table::{ENTRIES, Entry, Step, lines};
use trial::Trial;

use crate::harness::{read, run_leo};
use crate::venv;

/// The command lines of the documents, those of them that are run, and the commands of `leo` in them.
const COMMANDS: usize = 122;
const RUN: usize = 73;
const PARSED: usize = 74;
/// Documents that are tried at once. Robots wait more than they compute.
const LANES: usize = 2;
/// What a block may be. `rust` is compiled by the documentation tests, and pictures and layouts are not run.
const LANGUAGES: [&str; 9] = ["sh", "python", "json", "toml", "csv", "rust", "text", "yaml", "mermaid"];
/// Words that begin a command. A block of text that is not run has no line with them.
const PROGRAMS: [&str; 9] = ["leo", "cargo", "sudo", "python3", "pip", "curl", "cp", "sed", "git"];

fn entry(document: &Document) -> Option<&'static Entry> {
    ENTRIES.iter().find(|entry| entry.path == document.path)
}

/// The programs and data of a document that its command lines name.
fn named_blocks<'a>(document: &'a Document, entry: &Entry) -> Vec<(&'a str, &'a Block)> {
    let named = document.blocks.iter().filter_map(|block| Some((block.name.as_deref()?, block)));
    named.filter(|(name, _)| lines(entry).any(|(line, _)| line.contains(name))).collect()
}

fn is_installed(program: &str) -> bool {
    ["/usr/local/bin", "/usr/bin", "/bin"].iter().any(|folder| Path::new(folder).join(program).exists())
}

/// A session with what a document needs. `None`, with a message, if this machine does not have it.
fn session(entry: &Entry) -> Option<Session> {
    if let Some(missing) = entry.programs.iter().find(|program| !is_installed(program)) {
        skip::skip(format_args!("the command lines of {} need {missing}", entry.path));
        return None;
    }
    let python = match entry.python {
        Some((package, module)) => Some(venv::interpreter(package, module)?),
        None => None,
    };
    Some(Session::new(python.as_deref()))
}

/// Runs the lines of a document in a fresh folder; returns their number, or `None` where something is missing.
fn run_document(document: &Document, entry: &Entry) -> Option<usize> {
    let mut session = session(entry)?;
    for (name, block) in named_blocks(document, entry) {
        session.write(name, &block.text);
    }
    let mut run = 0;
    for step in entry.steps {
        match step {
            Step::ByHand(act) => act(&mut session),
            Step::Line(line, trial) => {
                session.run(line, trial);
                run += usize::from(!matches!(trial, Trial::NotRun(_)));
            }
        }
    }
    session.end();
    Some(run)
}

#[test]
fn every_command_line_of_the_documents_is_declared() {
    let mut wrong = Vec::new();
    let mut seen = 0;
    let documents = documents::all();
    for document in &documents {
        let commands = document.commands();
        seen += commands.len();
        let declared: Vec<&str> = entry(document).into_iter().flat_map(lines).map(|(line, _)| line).collect();
        for (number, command) in &commands {
            if !declared.contains(&command.as_str()) {
                wrong.push(format!(
                    "{}:{number}: `{command}` is not in tests/commands/snippets/table.rs: add how it is tried",
                    document.path
                ));
            }
        }
        let found: Vec<&str> = commands.iter().map(|(_, command)| command.as_str()).collect();
        if wrong.is_empty() && found != declared {
            wrong.push(format!(
                "{}: its lines are {found:?}, and tests/commands/snippets/table.rs has {declared:?}: correct the table",
                document.path
            ));
        }
    }
    for entry in ENTRIES {
        if !documents.iter().any(|document| document.path == entry.path) {
            wrong.push(format!("{} is in tests/commands/snippets/table.rs, and is no document", entry.path));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(seen, COMMANDS);
}

#[test]
fn every_command_line_of_the_documents_runs_as_copied() {
    let documents = documents::all();
    let queue = Mutex::new(ENTRIES.iter());
    let counts = Mutex::new(BTreeMap::new());
    thread::scope(|scope| {
        for _ in 0..LANES {
            scope.spawn(|| {
                loop {
                    let next = queue.lock().expect("no lane panics with it").next();
                    let Some(entry) = next else { break };
                    let document = documents.iter().find(|document| document.path == entry.path);
                    let run = run_document(document.expect("is there"), entry);
                    counts.lock().expect("no lane panics with it").insert(entry.path, run);
                }
            });
        }
    });
    let counts = counts.into_inner().expect("no lane panicked");
    // What is missing on this machine was said.
    if counts.values().all(Option::is_some) {
        assert_eq!(counts.values().flatten().sum::<usize>(), RUN, "{counts:?}");
    }
}

#[test]
fn every_command_line_of_the_documents_is_understood() {
    let (mut parsed, mut reasons) = (0, 0);
    for entry in ENTRIES {
        for (line, trial) in lines(entry) {
            assert_eq!(shell::syntax_error(line), None, "{}: `{line}`", entry.path);
            for words in shell::leo_commands(line) {
                let words: Vec<OsString> = words.into_iter().map(OsString::from).collect();
                if let Err(error) = commands::accepts(words) {
                    panic!("{}: `{line}`: {error}", entry.path);
                }
                parsed += 1;
            }
            if let Trial::NotRun(reason) = trial {
                assert!(!reason.is_empty(), "{}: `{line}` needs a reason", entry.path);
                reasons += 1;
            }
        }
    }
    assert_eq!((parsed, reasons), (PARSED, COMMANDS - RUN));
}

#[test]
fn every_python_program_of_the_documents_is_named_by_a_command() {
    let mut programs = 0;
    for document in documents::all() {
        for block in document.blocks.iter().filter(|block| block.language == "python") {
            let place = format!("{}:{}", document.path, block.line);
            let name = block.name.as_deref().unwrap_or_else(|| panic!("{place}: name its file before it"));
            let is_run =
                |(line, trial): (&str, &Trial)| line.contains(name) && !matches!(trial, Trial::NotRun(_));
            assert!(
                entry(&document).is_some_and(|entry| lines(entry).any(is_run)),
                "{place}: {name} is never run"
            );
            programs += 1;
        }
    }
    assert_eq!(programs, 7);
}

#[test]
fn the_options_of_commands_in_sentences_exist() {
    let mut helps: BTreeMap<String, String> = BTreeMap::new();
    let mut seen = 0;
    for document in documents::all() {
        let text = read(&document.path);
        // Lines are wrapped within a command, too.
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        for command in text.split('`').filter(|command| command.starts_with("leo ")) {
            let words: Vec<&str> = command.split(' ').skip(1).take_while(|word| *word != "|").collect();
            let is_name =
                |word: &&&str| word.chars().all(|letter| letter.is_ascii_lowercase() || letter == '-');
            let names: Vec<&str> = words.iter().filter(|word| !word.starts_with('-')).copied().collect();
            let depth = if matches!(names.first(), Some(&("bus" | "tasks"))) { 2 } else { 1 };
            let path: Vec<&str> = names.iter().take(depth).take_while(is_name).copied().collect();
            let help = helps.entry(path.join(" ")).or_insert_with(|| {
                let output = run_leo(&[path.as_slice(), &["--help"]].concat());
                assert_eq!(output.status, Some(0), "{}: `{command}`: {output:?}", document.path);
                output.out
            });
            for word in words.iter().filter(|word| word.starts_with("--")) {
                let option = word.split('=').next().unwrap_or_default();
                assert!(help.contains(option), "{}: `{command}`: {help}", document.path);
            }
            seen += 1;
        }
    }
    assert!(seen > 300, "only {seen} commands were seen");
}

#[test]
fn the_converter_of_a_csv_writes_only_numbers_that_json_has() {
    if !is_installed("python3") {
        skip::skip("there is no python3 here to convert a detector's CSV with");
        return;
    }
    let mut session = Session::new(None);
    for block in documents::blocks(&read("docs/traces.md")) {
        if let Some(name) = block.name {
            session.write(&name, &block.text);
        }
    }
    let rows = "time_s,label,x_m,y_m,z_m,yaw_deg,score\n\
        0.0,person,1.5,0.0,0.55,nan,0.98\n0.0,red block,0.6,0.0,0.03,NaN,0.91\n0.0,red block,nan,0.0,0.03,0,0.9\n\
        0.1,lamp on,0.6,-0.3,0.03,,0.9\n0.1,lamp on,0.6,inf,0.03,0,0.9\n0.1,lamp on,0.6,0.3,0.03,0,\n";
    session.write("detections.csv", rows);
    session.run("python3 convert.py < detections.csv > trace.jsonl", &Trial::Ends);
    let trace = session.read("trace.jsonl");
    let frames: Vec<serde_json::Value> =
        trace.lines().map(|line| serde_json::from_str(line).expect("is JSON")).collect();
    let counts: Vec<usize> =
        frames.iter().filter_map(|frame| frame["observations"].as_array().map(Vec::len)).collect();
    assert_eq!(counts, [1, 1], "{trace}");
    session.run("leo believe trace.jsonl", &Trial::Says("2 frames, 2 observations\n"));
    session.write("unknown.csv", &rows.replace("red block", "mug"));
    session.run("python3 convert.py < unknown.csv", &Trial::Fails("the label 'mug' is not in LOOKS"));
}

#[test]
fn every_json_and_toml_example_of_the_documents_is_well_formed() {
    let mut seen = [0, 0];
    for Document { path, blocks } in documents::all() {
        for Block { language, text, line, .. } in blocks {
            match language.as_str() {
                "json" => {
                    let parse = |text: &str| serde_json::from_str::<serde_json::Value>(text);
                    let lines = || text.lines().map(parse).collect::<Result<Vec<_>, _>>();
                    assert!(parse(&text).is_ok() || lines().is_ok(), "{path}:{line}: {:?}", lines());
                    seen[0] += 1;
                }
                "toml" => {
                    let parsed: Result<toml::Table, _> = text.parse();
                    assert!(parsed.is_ok(), "{path}:{line}: {parsed:?}");
                    seen[1] += 1;
                }
                _ => {}
            }
        }
    }
    assert!(seen[0] >= 4 && seen[1] >= 10, "{seen:?}");
}

#[test]
fn every_block_of_the_documents_says_its_language() {
    let mut seen = 0;
    for Document { path, blocks } in documents::all() {
        for Block { language, text, line, .. } in blocks {
            assert!(
                LANGUAGES.contains(&language.as_str()),
                "{path}:{line}: ```{language} is none of {LANGUAGES:?}"
            );
            let is_command = |line: &str| line.split(' ').next().is_some_and(|word| PROGRAMS.contains(&word));
            let is_hidden = matches!(language.as_str(), "text" | "yaml") && text.lines().any(is_command);
            assert!(!is_hidden, "{path}:{line}: a command is not run in a block of `{language}`: indent it");
            seen += 1;
        }
    }
    assert!(seen > 100, "only {seen} blocks were seen");
}
