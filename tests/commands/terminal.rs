//! Colours and progress, on a pseudo-terminal and elsewhere.

use std::fmt::Write as _;
use std::fs::File;
use std::io::Read as _;
use std::os::fd::OwnedFd;
use std::process::{Command, Stdio};
use std::thread;

use testkit::terminal::terminal;

use crate::harness::{leo, write};

/// What begins a colour.
const COLOUR: &str = "\x1b[3";

/// Runs a command of which `stream` is a terminal; returns the output there, and whether it succeeded.
fn on_terminal(mut command: Command, stream: fn(&mut Command, OwnedFd)) -> (String, bool) {
    let (mut screen, line) = terminal().expect("a pseudo-terminal");
    stream(&mut command, line);
    let mut child = command.env("TERM", "xterm").spawn().expect("starts");
    // The terminal hangs up when the command ends, because only the command has the other end.
    drop(command);
    let reader = thread::spawn(move || {
        let (mut seen, mut bytes) = (Vec::new(), [0; 4096]);
        while let Ok(count @ 1..) = screen.read(&mut bytes) {
            seen.extend_from_slice(bytes.get(..count).unwrap_or_default());
        }
        String::from_utf8_lossy(&seen).into_owned()
    });
    let succeeded = child.wait().expect("ours").success();
    (reader.join().expect("reads"), succeeded)
}

#[test]
fn verdicts_are_coloured_on_a_terminal_unless_colours_are_unwanted() {
    let check = || leo(&["check", "--seconds", "0"]);
    let on_output = |command: &mut Command, line: OwnedFd| {
        command.stdout(line);
    };
    let (command, _files) = check();
    let (seen, _) = on_terminal(command, on_output);
    assert!(seen.contains(&format!("{COLOUR}2mgood")), "{seen:?}");
    let (mut command, _files) = check();
    command.env("NO_COLOR", "1");
    let (seen, _) = on_terminal(command, on_output);
    assert!(seen.contains("good") && !seen.contains('\x1b'), "{seen:?}");
    let (mut command, _files) = check();
    let seen = String::from_utf8(command.output().expect("starts").stdout).expect("is text");
    assert!(seen.contains("good") && !seen.contains('\x1b'), "{seen:?}");
}

#[test]
fn a_large_trace_shows_its_progress_on_a_terminal_alone() {
    let files = tempfile::tempdir().expect("a folder");
    let mut trace = "{\"leo_trace\": 1}\n".to_owned();
    for frame in 0..12_000_u64 {
        let at_ns = frame * 100_000_000;
        writeln!(
            trace,
            "{{\"at_ns\": {at_ns}, \"observations\": [{{\"position_m\": [1, 0, 0.7], \"colour\": \"#e73f3f\"}}]}}"
        )
        .expect("writes to memory");
    }
    let trace = write(&files, "long.jsonl", &trace);
    let believe = || {
        let (mut command, kept) = leo(&["believe", &trace, "--json"]);
        command.stdout(File::create(files.path().join("out")).expect("makes a file"));
        (command, kept)
    };
    let (command, _files) = believe();
    let (seen, succeeded) = on_terminal(command, |command, line| {
        command.stderr(line);
    });
    assert!(succeeded && seen.contains(" % ") && seen.contains(" left"), "{seen:?}");
    // It is cleared at the end.
    let last = seen.rsplit('\r').next().unwrap_or_default();
    assert!(!last.contains('%'), "{last:?}");
    let (mut command, _files) = believe();
    let ended = command.stderr(Stdio::piped()).output().expect("starts");
    assert_eq!((ended.status.code(), String::from_utf8_lossy(&ended.stderr).as_ref()), (Some(0), ""));
}
