//! The files of a configuration, and values set on the command line.

use std::fs;
use std::net::TcpListener;

use crate::assert_refused;
use crate::harness::{Leo, leo, read, run_leo, short_lesson, wait_until, write};

const MOVED: &str = "config/traces/moved.jsonl";

#[test]
fn a_misspelt_file_is_named_by_every_command() {
    let files = tempfile::tempdir().expect("a folder");
    let config = write(&files, "leo.toml", &read("config/leo.toml"));
    write(&files, "lesson.toml", &read("config/lessons/task1.toml"));
    assert_eq!(run_leo(&["believe", MOVED, "--config", &config]).err, "");
    let motors = write(&files, "motors.toml", &read("config/motor.toml"));
    let said = format!("{motors} is read by nothing; did you mean motor.toml?");
    let output = run_leo(&["believe", MOVED, "--config", &config]);
    assert_eq!(output.status, Some(0), "{output:?}");
    assert!(output.err.contains(&said) && output.err.lines().count() == 1, "{output:?}");
    let output = run_leo(&["check", "--seconds", "0", "--config", &config]);
    assert!(output.out.contains(&said) && output.err.is_empty(), "{output:?}");
    for fact in [format!("{config} was read"), "motor.toml is the built-in one".to_owned()] {
        assert!(output.out.contains(&fact), "{fact} is not in {output:?}");
    }
    fs::rename(&motors, files.path().join("motor.toml")).expect("renames");
    assert_eq!(run_leo(&["believe", MOVED, "--config", &config]).err, "");
}

#[test]
fn a_value_on_the_command_line_replaces_that_of_the_file() {
    let lines = |more: &[&str]| run_leo(&[&["believe", MOVED, "--json"], more].concat()).out;
    assert_eq!(lines(&["--set", "belief.partners=0"]), lines(&["--partners", "0"]));
    assert_ne!(lines(&[]), lines(&["--set", "belief.partners=0"]));
    for (set, words) in [
        ("belief.partners=many", &["--set belief.partners=many: ", "a whole number"][..]),
        ("belief.partnerz=1", &["--set belief.partnerz=1: ", "`partners`?"]),
        ("belief.partners", &["--set belief.partners: ", "SECTION.KEY=VALUE"]),
    ] {
        for command in [&["believe", MOVED][..], &["run"], &["check"], &["study"], &["bus", "scan"]] {
            assert_refused(&run_leo(&[command, &["--set", set]].concat()), 2, words);
        }
    }
}

#[test]
fn the_processes_of_a_lesson_have_the_values_of_the_command_line() {
    let output = run_leo(&["teach", "config/lessons/task1.toml", "--json", "--set", "belief.partners=0"]);
    let robot = run_leo(&["teach", "config/lessons/task1.toml", "--json", "--perspective", "robot"]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    assert_eq!(output.out, robot.out);
}

#[test]
fn a_port_in_use_is_reported_or_refused() {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port();
    let address = format!("--set=console.address=127.0.0.1:{port}");
    let refused = run_leo(&["run", "--for", "1", &address, "--set", "console.port_required=true"]);
    assert_refused(&refused, 1, &[&port.to_string(), "in use", "console.port_required"]);
    let (command, files) = leo(&["run", "--stay", &address]);
    let robot = Leo::start(command, files);
    let said = format!("port {port} was in use");
    assert!(wait_until(|| robot.said("out").contains(&said)), "{}", robot.said("out"));
    robot.interrupt();
    assert_eq!(robot.end().status, Some(0));
}

#[test]
fn an_error_of_usage_has_the_form_of_all_others() {
    for (arguments, words) in [
        (&["teach"][..], &["<LESSON>", "leo teach --help"][..]),
        (&["tech"], &["'tech'", "'teach'"]),
        (&["believe", MOVED, "--nonsense"], &["'--nonsense'", "leo believe --help"]),
        (&["bus", "set-id", "--to", "300"], &["300", "leo bus set-id --help"]),
    ] {
        assert_refused(&run_leo(arguments), 2, words);
    }
}

#[test]
fn a_filter_of_the_log_that_means_nothing_is_one_warning() {
    for (filter, words) in [("nonsense", "`nonsense` is no level"), ("leo=loud", "`loud` is no level")] {
        let (mut command, files) = leo(&["believe", MOVED]);
        command.env("RUST_LOG", filter);
        let output = Leo::start(command, files).end();
        assert_eq!((output.status, output.err.lines().count()), (Some(0), 1), "{output:?}");
        assert!(output.err.contains("RUST_LOG") && output.err.contains(words), "{output:?}");
    }
}

#[test]
fn a_file_in_another_encoding_is_refused_with_its_encoding_and_line() {
    let files = tempfile::tempdir().expect("a folder");
    let text = read("config/leo.toml").replace("\"the teacher\"", "\"Ren\u{e9}\"");
    let line = text.lines().position(|line| line.contains("Ren")).expect("is there") + 1;
    let config = files.path().join("leo.toml");
    let said = config.display().to_string();
    let latin: Vec<u8> = text.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap_or(b'?')).collect();
    let utf16: Vec<u8> =
        std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    for (bytes, words) in [
        (latin, [format!("line {line} "), "Latin-1".to_owned()]),
        (utf16, ["UTF-16".to_owned(), "iconv".to_owned()]),
    ] {
        fs::write(&config, bytes).expect("writes");
        let output = run_leo(&["check", "--config", &said]);
        assert_refused(&output, 2, &[&said, &words[0], &words[1]]);
    }
    fs::write(&config, &text).expect("writes");
    assert_eq!(run_leo(&["believe", MOVED, "--config", &said]).err, "");
}

#[test]
fn a_trace_in_another_encoding_is_refused_with_its_encoding() {
    let files = tempfile::tempdir().expect("a folder");
    let trace = files.path().join("trace.jsonl");
    let text = "{\"leo_trace\": 1, \"title\": \"Ren\u{e9}\"}\n";
    let latin: Vec<u8> = text.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap_or(b'?')).collect();
    let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let later = [b"{\"leo_trace\": 1}\n", &latin[..]].concat();
    for (bytes, word) in [(latin, "Latin-1"), (utf16, "UTF-16"), (later, "line 2, it is not UTF-8")] {
        fs::write(&trace, bytes).expect("writes");
        let said = trace.display().to_string();
        assert_refused(&run_leo(&["believe", &said]), 2, &[&said, word, "iconv"]);
    }
}

#[test]
fn a_mistake_found_after_parsing_is_named_with_its_line() {
    let files = tempfile::tempdir().expect("a folder");
    let text = read("config/leo.toml");
    let wrong = text.replace("\nfaults = []", "\nfaults = [\n  \"drop p=0.01\",\n  \"dorp p=0.01\",\n]");
    assert_ne!(wrong, text);
    let line = wrong.lines().position(|line| line.contains("dorp")).expect("is there") + 1;
    let config = write(&files, "leo.toml", &wrong);
    assert_refused(
        &run_leo(&["check", "--config", &config]),
        2,
        &[&format!("{config}:{line}:3: "), "`dorp`"],
    );
    let set = ["check", "--set", "mock_bus.faults=[\"dorp p=0.01\"]"];
    assert_refused(&run_leo(&set), 2, &["`dorp p=0.01` in `mock_bus.faults`"]);
    let folder = files.path().display().to_string();
    assert_refused(&run_leo(&["check", "--config", &folder]), 2, &[&folder, "it is a directory"]);
    let within = format!("{config}/leo.toml");
    assert_refused(&run_leo(&["check", "--config", &within]), 2, &[&within, "not a directory"]);
}

#[test]
fn a_link_to_a_missing_file_of_the_configuration_is_refused() {
    let files = tempfile::tempdir().expect("a folder");
    let config = write(&files, "leo.toml", &read("config/leo.toml"));
    for name in ["motor.toml", "percepts.toml", "perspective.toml", "leo.urdf"] {
        let link = files.path().join(name);
        std::os::unix::fs::symlink("nowhere", &link).expect("links");
        let refused = run_leo(&["check", "--config", &config]);
        assert_refused(&refused, 2, &[&link.display().to_string(), "nowhere", "does not exist"]);
        fs::remove_file(&link).expect("is ours");
    }
}

#[test]
fn examples_in_another_encoding_are_refused_and_a_mark_is_read() {
    let files = tempfile::tempdir().expect("a folder");
    let text = read("config/examples/squares.jsonl");
    let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let latin = [text.as_bytes(), b"# Ren\xe9\n"].concat();
    let examples = files.path().join("examples.jsonl");
    let said = examples.display().to_string();
    for (bytes, words) in [(utf16, ["UTF-16", "iconv"]), (latin, ["0xe9", "Latin-1"])] {
        fs::write(&examples, bytes).expect("writes");
        assert_refused(&run_leo(&["learn", &said]), 2, &[&said, words[0], words[1]]);
    }
    fs::write(&examples, format!("\u{feff}{text}")).expect("writes");
    let marked = run_leo(&["learn", &said]);
    assert_eq!(
        (marked.status, marked.out),
        (Some(0), run_leo(&["learn", "config/examples/squares.jsonl"]).out)
    );
}

#[test]
fn no_command_writes_over_a_file_that_it_reads() {
    let files = tempfile::tempdir().expect("a folder");
    let lesson = write(&files, "lesson.toml", &short_lesson());
    let config = write(&files, "leo.toml", &read("config/leo.toml"));
    let motor = write(&files, "motor.toml", &read("config/motor.toml"));
    for to in [&lesson, &config, &motor] {
        let refused = run_leo(&["teach", &lesson, "--config", &config, "--record", to, "--force"]);
        assert_refused(&refused, 2, &[to, "is read by this command"]);
    }
    assert_eq!(fs::read_to_string(&lesson).expect("reads"), short_lesson());
    for (to, word) in [("/", "directory"), ("/nowhere/x.mcap", "its folder does not exist")] {
        assert_refused(&run_leo(&["teach", &lesson, "--record", to]), 2, &[to, word]);
    }
}

#[test]
fn a_closed_pipe_ends_every_command_quietly() {
    for arguments in [
        &["check", "--seconds", "0"][..],
        &["check", "--seconds", "0", "--json"],
        &["tasks", "list"],
        &["tasks", "export"],
        &["learn", "config/examples/squares.jsonl"],
        &["believe", MOVED],
        &["evaluate", "--help"],
    ] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let (mut command, _files) = leo(arguments);
        let ended = command.stdout(writer).output().expect("starts");
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert_eq!((ended.status.code(), said.as_str()), (Some(0), ""), "{arguments:?}");
    }
}

#[test]
fn a_page_at_an_absent_address_is_refused_before_a_process_starts() {
    // Of a network that is set aside for documentation (RFC 5737).
    let set = ["--set", "console.address=192.0.2.1:7780", "--set", "console.port_required=true"];
    let refused = run_leo(&[&["run", "--for", "1"], &set[..]].concat());
    assert_refused(&refused, 1, &["192.0.2.1", "ip address", "console.address"]);
}

#[test]
fn a_core_that_the_machine_lacks_is_refused() {
    let set = ["--set", "motor.realtime.cores=[999]"];
    assert_refused(&run_leo(&[&["run"], &set[..]].concat()), 2, &["core 999", "[motor.realtime]", "0"]);
    let output = run_leo(&[&["check", "--seconds", "0"], &set[..]].concat());
    assert_eq!(output.status, Some(1), "{output:?}");
    assert!(output.out.contains("core 999") && !output.out.contains("isolcpus=999"), "{output:?}");
}
