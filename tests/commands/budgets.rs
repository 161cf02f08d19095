//! Untrusted files and pipes: limits of their cost, and the messages when a limit is exceeded.

mod mcap;

use std::fs::{self, File};
use std::process::{Command, Stdio};

use tempfile::TempDir;

use crate::assert_refused;
use crate::harness::{CommandOutput, leo, run_leo, short_lesson, write};
use crate::recordings::{file, recorded};
use mcap::{Mcap, attachment, channel, message, schema, without_check_sums};

/// Memory limit for a small file or line, in KiB.
const MEMORY_KIB: u64 = 512 << 10;
/// Size to which the files expand, in bytes: more than the memory limit.
const EXPANDED: usize = 900 << 20;
const MIB: usize = 1 << 20;

/// Runs a command that the kernel gives at most [`MEMORY_KIB`] of heap; an allocation beyond it aborts the command.
fn run_limited(arguments: &[&str], input: Stdio) -> CommandOutput {
    let (command, files) = leo(arguments);
    let mut limited = Command::new("/bin/sh");
    limited.args(["-c", r#"ulimit -d "$0" && exec "$@""#, &MEMORY_KIB.to_string()]);
    limited.arg(command.get_program()).args(command.get_args());
    limited.current_dir(env!("CARGO_MANIFEST_DIR"));
    limited.env_clear().env("XDG_STATE_HOME", files.path()).stdin(input);
    let output = limited.output().expect("starts");
    let text = |bytes| String::from_utf8(bytes).expect("is text");
    CommandOutput { status: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

/// Checks that a command refuses a file with these words and stays within the memory limit.
fn assert_bounded(arguments: &[&str], input: Stdio, words: &[&str]) {
    assert_refused(&run_limited(arguments, input), 2, words);
}

fn small(folder: &TempDir, name: &str, bytes: &[u8]) -> String {
    assert!(bytes.len() < 2 * MIB, "{name} is {} bytes long", bytes.len());
    let to = file(folder, name);
    fs::write(&to, bytes).expect("writes");
    to
}

/// A sparse file of 1 GiB.
fn sparse(folder: &TempDir, name: &str) -> String {
    let to = file(folder, name);
    File::create(&to).and_then(|file| file.set_len(1 << 30)).expect("makes a file");
    to
}

/// A recording whose chunks expand to [`EXPANDED`] bytes of 1 MiB records.
fn expanding(is_checked: bool, record: impl Fn(usize) -> Vec<u8>) -> Vec<u8> {
    const AT_ONCE: usize = 60;
    let mut recording = Mcap::recording();
    for chunk in 0..EXPANDED / MIB / AT_ONCE {
        let records: Vec<Vec<u8>> = (chunk * AT_ONCE..(chunk + 1) * AT_ONCE).map(&record).collect();
        recording.chunk(&records.concat(), is_checked);
    }
    recording.end()
}

#[test]
fn a_recording_that_expands_to_gigabytes_is_refused_cheaply() {
    let folder = tempfile::tempdir().expect("a folder");
    let id = |number: usize| u16::try_from(number).expect("there are few");
    let schemas = expanding(true, |number| schema(id(number), "leo", MIB));
    let files = expanding(false, |number| attachment(&number.to_string(), MIB));
    for (name, bytes) in [("schemas.mcap", schemas), ("files.mcap", files)] {
        let recording = small(&folder, name, &bytes);
        let words = ["after frame 0", "need more than 64 MiB of memory", "no recording of Leo", &recording];
        assert_bounded(&["replay", &recording], Stdio::null(), &words);
    }
    for is_checked in [true, false] {
        let zeros = expanding(is_checked, |_| vec![0; MIB]);
        let recording = small(&folder, "zeros.mcap", &zeros);
        assert_bounded(&["replay", &recording], Stdio::null(), &[&recording, "expand to more than", "MiB"]);
        assert_bounded(&["believe", &recording], Stdio::null(), &[&recording]);
    }
}

#[test]
fn a_trace_that_expands_to_gigabytes_is_refused_cheaply() {
    let folder = tempfile::tempdir().expect("a folder");
    // Many sources at one instant: their frames are believed together.
    let observation = r#"{"position_m":[0,0,0]},"#.repeat(60_000);
    let json = format!(r#"{{"at_ns":1,"observations":[{}]}}"#, observation.trim_end_matches(','));
    let mut trace = Mcap::new("leo_trace/1");
    for chunk in 0..20_u16 {
        let sources = 20 * chunk..20 * (chunk + 1);
        let of = |source: u16| {
            let json = json.replacen("1,", &format!("1,\"source\":{source},"), 1);
            [channel(source), message(source, &json)].concat()
        };
        trace.chunk(&sources.map(of).collect::<Vec<_>>().concat(), true);
    }
    let trace = small(&folder, "sources.mcap", &trace.end());
    assert_bounded(&["believe", &trace], Stdio::null(), &[&trace, "of one instant are too many"]);

    let many = r#"{"position_m":[0,0,0]},"#.repeat(600_000);
    let json =
        format!("{{\"leo_trace\":1}}\n{{\"at_ns\":1,\"observations\":[{}]}}\n", many.trim_end_matches(','));
    let trace = write(&folder, "many.jsonl", &json);
    assert_bounded(&["believe", &trace], Stdio::null(), &[&trace, "line 2", "at most 65536 observations"]);

    let zeros = {
        let mut trace = Mcap::new("leo_trace/1");
        for _ in 0..EXPANDED / (60 * MIB) {
            trace.chunk(&vec![0; 60 * MIB], true);
        }
        small(&folder, "zeros.mcap", &trace.end())
    };
    assert_bounded(&["believe", &zeros], Stdio::null(), &[&zeros, "expand to more than"]);
    let input = File::open(&zeros).expect("opens");
    assert_bounded(&["believe", "-"], input.into(), &["standard input", "expand to more than"]);
}

#[test]
fn every_reading_command_refuses_a_gigabyte_line_or_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let long = sparse(&folder, "long.toml");
    let whole = "is longer than 4 MiB, the most that Leo reads of a file of configuration";
    let line = "line 1 is longer than 4 MiB: put one example in a line";
    let table: [(&[&str], &str); 17] = [
        (&["learn", &long], line),
        (&["learn", "--config", &long, "config/examples/squares.jsonl"], whole),
        (&["teach", &long], whole),
        (&["teach", "config/lessons/task1.toml", "--config", &long], whole),
        (&["run", "--lesson", &long], whole),
        (&["run", "--config", &long], whole),
        (&["run", "--faults", &long], whole),
        (&["check", "--config", &long], whole),
        (&["believe", &long], "line 1 is longer than 16 MiB: put one frame in a line"),
        (&["believe", "config/traces/moved.jsonl", "--config", &long], whole),
        (&["record", "a.mcap", "--config", &long], whole),
        (&["record", "a.mcap", "--lesson", &long], whole),
        (&["replay", &long], "is not a recording of Leo"),
        (&["tasks", "import", &long], "is longer than 256 MiB"),
        (&["arm", "--config", &long], whole),
        (&["bus", "scan", "--config", &long], whole),
        (&["mock-bus", "--config", &long], whole),
    ];
    for (arguments, words) in table {
        if arguments.contains(&"import") {
            // The buffer that takes 256 MiB doubles to the whole limit.
            assert_refused(&run_leo(arguments), 2, &[&long, words]);
        } else {
            assert_bounded(arguments, Stdio::null(), &[&long, words]);
        }
    }
    let input = || File::open(&long).expect("opens").into();
    assert_bounded(&["learn", "-"], input(), &["standard input", line]);
    assert_bounded(&["believe", "-"], input(), &["standard input", "line 1 is longer than 16 MiB"]);
}

#[test]
fn examples_that_expand_too_much_are_refused_by_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let objects: Vec<String> = (0..200_000).map(|id| format!("{{\"id\":{id}}}")).collect();
    let example = format!(r#"{{"perspectives":[{{"before":[{}],"changed":[]}}]}}"#, objects.join(","));
    let text = format!("{{\"leo_examples\":1}}\n{}", format!("{example}\n").repeat(20));
    let examples = write(&folder, "many.jsonl", &text);
    assert_bounded(&["learn", &examples], Stdio::null(), &[&examples, "line ", "of memory", "use fewer"]);
}

#[test]
fn a_recording_chunk_without_check_sum_is_reported_and_not_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = write(&folder, "short.toml", &short_lesson());
    let recording = file(&folder, "lesson.mcap");
    recorded(&lesson, &recording);
    let mut bytes = fs::read(&recording).expect("reads");
    assert!(without_check_sums(&mut bytes) > 1);
    fs::write(&recording, &bytes).expect("writes");
    let words = [&recording, "no check sum", "nothing is compared", "record again"];
    assert_refused(&run_leo(&["replay", &recording]), 2, &words.map(|word| -> &str { word }));
}

#[test]
fn a_trace_chunk_without_check_sum_is_used_and_reported() {
    let folder = tempfile::tempdir().expect("a folder");
    let json = r#"{"at_ns":1,"observations":[{"position_m":[0.6,0,0]}]}"#;
    let records = [channel(0), message(0, json)].concat();
    let trace = small(&folder, "a.mcap", &Mcap::new("leo_trace/1").chunk(&records, false).end());
    let output = run_leo(&["believe", &trace]);
    assert_eq!(output.status, Some(0), "{output:?}");
    assert!(output.err.contains("1 chunk has no check sum"), "{output:?}");
    fs::write(&trace, Mcap::new("leo_trace/1").chunk(&records, true).end()).expect("writes");
    let output = run_leo(&["believe", &trace]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
}
