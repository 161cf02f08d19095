//! `leo believe` on the command line.

use std::collections::BTreeMap;
use std::fs;
use std::io::{Cursor, Read as _, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::assert_refused;
use crate::harness::{CommandOutput, leo, read, redacted, run_leo, write};
use crate::venv;

/// Fig. 4 of the paper as a recording: a block is moved and a button pressed while the partner looks away.
const MOVED: &str = "config/traces/moved.jsonl";
const HEADER: &str = r#"{"leo_trace": 1}"#;

/// The JSON lines that a command wrote.
fn lines(output: &CommandOutput) -> Vec<Value> {
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    output.out.lines().map(|line| serde_json::from_str(line).expect("is JSON")).collect()
}

fn text<'a>(line: &'a Value, pointer: &str) -> &'a str {
    line.pointer(pointer).and_then(Value::as_str).unwrap_or_default()
}

fn number(line: &Value, pointer: &str) -> Option<u64> {
    line.pointer(pointer).and_then(Value::as_u64)
}

/// Runs a command with this standard input.
fn pipe(command: &mut Command, input: &[u8]) -> CommandOutput {
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("starts");
    let mut stdin = child.stdin.take().expect("is piped");
    let input = input.to_owned();
    let feed = std::thread::spawn(move || {
        // A command that fails does not read to the end.
        let _ = stdin.write_all(&input);
    });
    let ended = child.wait_with_output().expect("ends");
    feed.join().expect("is fed");
    let said = |bytes: Vec<u8>| String::from_utf8(bytes).expect("is text");
    CommandOutput { status: ended.status.code(), out: said(ended.stdout), err: said(ended.stderr) }
}

fn believe(arguments: &[&str], input: impl AsRef<[u8]>) -> CommandOutput {
    let (mut command, _files) = leo(&[&["believe", "-"], arguments].concat());
    pipe(&mut command, input.as_ref())
}

/// The differences between the robot and partner 1 at each instant.
fn differences(lines: &[Value]) -> BTreeMap<u64, Vec<String>> {
    let mut by_instant: BTreeMap<u64, Vec<String>> = BTreeMap::new();
    for line in lines {
        let Some(at_ns) = number(line, "/at_ns") else { continue };
        let output = by_instant.entry(at_ns / 1_000_000).or_default();
        if text(line, "/record") == "difference" {
            let percepts = line.pointer("/percepts").and_then(Value::as_object).expect("a map");
            output.extend(percepts.keys().cloned());
            output.sort();
            if percepts.is_empty() {
                output.push(format!("{:?} {:?}", number(line, "/robot_id"), number(line, "/partner_id")));
            }
        }
    }
    by_instant
}

#[test]
fn detections_of_two_detectors_become_the_perspective_of_one_partner() {
    let mut trace = format!("{HEADER}\n");
    for step in 0..10_u64 {
        // A person at 1.5 m looks at a block. One detector follows the face, the other one the body.
        let at_ns = step * 100_000_000;
        let block = r##"{"position_m": [0.6, 0, 0.03], "colour": "#e73f3f"}"##;
        let face = r#"{"kind": "person", "detection": 40, "position_m": [1.5, 0, 0.5], "orientation_xyzw": [0, 0, 1, 0]}"#;
        let body = r#"{"kind": "person", "detection": 7, "position_m": [1.4, 0.1, 0.4]}"#;
        trace += &format!("{{\"at_ns\": {at_ns}, \"observations\": [{block}, {face}]}}\n");
        trace += &format!("{{\"at_ns\": {at_ns}, \"source\": 1, \"observations\": [{body}]}}\n");
    }
    let mut output = believe(&["--json", "--partners", "2"], &trace);
    assert!(std::mem::take(&mut output.err).contains("which partner a detection belongs to"), "{output:?}");
    let lines = lines(&output);
    let present = |perspective| {
        lines.iter().any(|line| {
            text(line, "/record") == "perspective"
                && number(line, "/perspective") == Some(perspective)
                && line.pointer("/present") == Some(&Value::Bool(true))
        })
    };
    assert!(present(1) && !present(2), "{}", output.out);
    let summary = lines.last().expect("a summary");
    assert!(text(summary, "/refused/0/reason").contains("which partner a detection belongs to"), "{summary}");
    // Each detector's first sightings, until the person has a number.
    let refused = number(summary, "/refused/0/observations").unwrap_or_default();
    assert!((10..=14).contains(&refused), "{summary}");
    assert_eq!(number(summary, "/observations"), Some(30 - refused), "{summary}");
}

#[test]
fn changes_behind_a_partners_back_are_unknown_until_seen() {
    let output = run_leo(&["believe", MOVED, "--json"]);
    let lines = lines(&output);
    let differences = differences(&lines);
    let at = |millis: u64| differences.get(&millis).expect("an instant").as_slice();
    assert_eq!(differences.len(), 29);
    // The partner looks, and then looks away while nothing happens.
    assert!((0..=2000).step_by(200).all(|millis| at(millis).is_empty()), "{differences:?}");
    // The block is moved, then the button is pressed.
    assert!((2200..3600).step_by(200).all(|millis| at(millis) == ["position"]), "{differences:?}");
    assert!((3600..4400).step_by(200).all(|millis| at(millis) == ["on", "position"]), "{differences:?}");
    // The partner looks again.
    assert!((4400..=5600).step_by(200).all(|millis| at(millis).is_empty()), "{differences:?}");
    let apart = lines.iter().rfind(|line| line.pointer("/percepts/position/distance").is_some());
    let apart = apart.expect("a difference in place");
    assert_eq!(number(apart, "/at_ns"), Some(4_200_000_000));
    let apart = apart.pointer("/percepts/position/distance").and_then(Value::as_f64).expect("a distance");
    assert!((apart - 0.3).abs() < 0.01, "{apart}");
}

#[test]
fn every_belief_of_every_perspective_is_printed_with_its_named_percepts() {
    let lines = lines(&run_leo(&["believe", MOVED, "--json"]));
    let beliefs: Vec<&Value> = lines.iter().filter(|line| text(line, "/record") == "belief").collect();
    let red = |line: &&&Value| {
        text(line, "/percepts/colour/feature") == "red" && text(line, "/percepts/shape/feature") == "square"
    };
    assert_eq!(beliefs.iter().filter(red).filter(|line| number(line, "/perspective") == Some(0)).count(), 29);
    let his = beliefs.iter().filter(red).filter(|line| number(line, "/perspective") == Some(1));
    assert!(his.clone().count() >= 29 && his.clone().all(|line| number(line, "/robot_id") == Some(1)));
    // In the partner's frame the block is in front of the partner.
    let place = his.clone().next().and_then(|line| line.pointer("/percepts/position/feature/0"));
    assert!(place.and_then(Value::as_f64).is_some_and(|x| (x - 0.9).abs() < 1e-6), "{place:?}");
    let held = beliefs.iter().filter(|line| number(line, "/held_by") == Some(0)).count();
    assert!(held > 0);
    let summary = lines.last().expect("a summary");
    assert_eq!(text(summary, "/record"), "summary");
    assert_eq!((number(summary, "/frames"), number(summary, "/observations")), (Some(29), Some(87)));
    assert_eq!(number(summary, "/perspectives/1/beliefs"), Some(2));
}

#[test]
fn one_trace_gives_equal_output_and_less_output_keeps_the_rest() {
    let (one, again) = (run_leo(&["believe", MOVED, "--json"]), run_leo(&["believe", MOVED, "--json"]));
    assert_eq!(one.out, again.out);
    let (all, some) = (lines(&one), lines(&run_leo(&["believe", MOVED, "--json", "--every", "1000"])));
    let kept = |line: &&Value| number(line, "/at_ns").is_none_or(|at_ns| at_ns.is_multiple_of(1_000_000_000));
    assert_eq!(all.iter().filter(kept).collect::<Vec<_>>(), some.iter().collect::<Vec<_>>());
    assert!(some.len() * 4 < all.len());
    let (file, piped) = (run_leo(&["believe", MOVED]), believe(&[], read(MOVED)));
    assert_eq!((file.status, file.out), (piped.status, piped.out));
}

#[test]
fn an_mcap_trace_gives_the_same_beliefs_and_may_be_truncated() {
    // The story is repeated, so that the file has several chunks.
    let options = mcap::WriteOptions::new().profile("leo_trace/1").chunk_size(Some(128 << 10));
    let mut mcap = options.create(Cursor::new(Vec::new())).expect("writes");
    let channel_id = mcap.add_channel(0, "observations/0", "json", &BTreeMap::new()).expect("writes");
    let mut lines = format!("{HEADER}\n");
    let moved = read(MOVED);
    for (time, line) in (0..40_u64).flat_map(|time| moved.lines().skip(1).map(move |line| (time, line))) {
        let mut frame: Value = serde_json::from_str(line).expect("is JSON");
        let at_ns = number(&frame, "/at_ns").expect("a number") + time * 10_000_000_000;
        frame["at_ns"] = at_ns.into();
        let frame = frame.to_string();
        let header =
            mcap::records::MessageHeader { channel_id, sequence: 0, log_time: at_ns, publish_time: at_ns };
        mcap.write_to_known_channel(&header, frame.as_bytes()).expect("writes");
        lines += &format!("{frame}\n");
    }
    mcap.finish().expect("ends");
    let mcap = mcap.into_inner().into_inner();
    let (from_mcap, from_lines) = (believe(&[], &mcap), believe(&[], &lines));
    assert_eq!((from_mcap.status, &from_mcap.err), (Some(0), &String::new()));
    assert!(from_mcap.out.contains("1160 frames, 3480 observations\n"), "{}", from_mcap.out);
    assert_eq!(from_mcap.out, from_lines.out);
    let half = believe(&[], mcap.get(..mcap.len() / 2).expect("a half"));
    assert_eq!(half.status, Some(0), "{half:?}");
    assert_cut(&half, "whole frames were read");
    let output = |out: &str| out.split("What is believed").next().unwrap_or_default().trim_end().to_owned();
    assert!(
        from_mcap.out.starts_with(&output(&half.out)) && output(&half.out).lines().count() > 20,
        "{half:?}"
    );
    assert_ne!(half.out.lines().last(), from_mcap.out.lines().last(), "the end tells of it");
}

/// One warning on standard error says that the trace is cut short.
fn assert_cut(output: &CommandOutput, words: &str) {
    assert_eq!((output.status, output.err.lines().count()), (Some(0), 1), "{output:?}");
    assert!(output.err.contains("cut short") && output.err.contains(words), "{output:?}");
}

#[test]
fn a_killed_writers_trace_gives_whole_chunks_and_a_warning() {
    let options =
        mcap::WriteOptions::new().profile("leo_trace/1").compression(None).chunk_size(Some(2 << 10));
    let mut mcap = options.create(Cursor::new(Vec::new())).expect("writes");
    let channel_id = mcap.add_channel(0, "observations/0", "json", &BTreeMap::new()).expect("writes");
    for line in read(MOVED).lines().skip(1) {
        let at_ns = number(&serde_json::from_str(line).expect("is JSON"), "/at_ns").expect("a number");
        let header =
            mcap::records::MessageHeader { channel_id, sequence: 0, log_time: at_ns, publish_time: at_ns };
        mcap.write_to_known_channel(&header, line.as_bytes()).expect("writes");
    }
    mcap.finish().expect("ends");
    let mcap = mcap.into_inner().into_inner();
    let (mut chunks, mut at) = (Vec::new(), mcap::MAGIC.len());
    while let Some((&opcode, rest)) = mcap.get(at..).and_then(<[u8]>::split_first)
        && opcode != mcap::records::op::FOOTER
    {
        chunks.extend((opcode == mcap::records::op::CHUNK).then_some(at));
        let length = u64::from_le_bytes(*rest.first_chunk().expect("a length"));
        at += 9 + usize::try_from(length).expect("is in the file");
    }
    assert!(chunks.len() > 3, "{chunks:?}");
    let folder = tempfile::tempdir().expect("a folder");
    for (whole, at) in chunks.iter().copied().enumerate().take(3) {
        let cut = mcap.get(..at + 300).expect("is in the file").to_vec();
        let mut unclosed = cut.clone();
        // The lengths that a writer fills in when it closes the chunk.
        for place in [1..9, 25..37, 41..49] {
            unclosed.get_mut(at + place.start..at + place.end).expect("is in the file").fill(0xff);
        }
        let outputs = [&cut, &unclosed].map(|bytes| believe(&["--json"], bytes));
        let [as_cut, as_unclosed] = &outputs;
        assert_eq!(as_cut.out, as_unclosed.out);
        for output in &outputs {
            assert_cut(output, if whole == 0 { "no whole frame" } else { "were read" });
            let summary: Value =
                serde_json::from_str(output.out.lines().last().expect("a summary")).expect("is JSON");
            assert_eq!(summary.pointer("/cut_short"), Some(&Value::Bool(true)));
            assert_eq!(number(&summary, "/frames").is_some_and(|frames| frames > 0), whole > 0, "{summary}");
        }
        // As a source it is played, unless it has no frame.
        fs::write(folder.path().join("cut.mcap"), &unclosed).expect("writes");
        let source = "\n[[sensor.source]]\nname = \"recorded\"\nkind = \"trace\"\nfile = \"cut.mcap\"\n";
        let config = write(&folder, "leo.toml", &(read("config/leo.toml") + source));
        let output = run_leo(&["check", "--config", &config, "--seconds", "0"]);
        if whole == 0 {
            assert_refused(&output, 2, &["cut.mcap: ", "cut short", "no whole frame"]);
        } else {
            assert_ne!(output.status, Some(2), "{output:?}");
        }
    }
}

#[test]
fn the_text_report_has_a_timeline_and_the_final_beliefs() {
    let output = run_leo(&["believe", MOVED]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    let at = |time: &str| output.out.lines().filter(|line| line.starts_with(time)).collect::<Vec<_>>();
    // The robot sees the move and the button at once, the partner when they look again.
    for (time, agent, what) in [
        ("[   2.20 s]", "the teacher", "position"),
        ("[   3.60 s]", "Leo", "(0.60, 0.29, 0.03)"),
        ("[   4.40 s]", "the teacher", "2: on"),
    ] {
        let is_told = at(time).iter().any(|line| line.contains(agent) && line.ends_with(what));
        assert!(is_told, "{time} {agent} {what} is not in\n{}", output.out);
    }
    assert!(output.out.contains("29 frames, 87 observations\n"), "{}", output.out);
    insta::assert_snapshot!(output.out);
}

#[test]
fn partners_option_sets_the_perspectives() {
    let perspectives = |partners: &str| {
        let lines = lines(&run_leo(&["believe", MOVED, "--json", "--partners", partners]));
        let summary = lines.last().and_then(|line| line.pointer("/perspectives")).expect("a list").clone();
        let robot = lines.iter().filter(|line| number(line, "/perspective") == Some(0)).count();
        (summary.as_array().map(Vec::len), robot)
    };
    assert_eq!(perspectives("0"), (Some(1), 29 * 3));
    assert_eq!(perspectives("3"), (Some(4), 29 * 3));
    let output = run_leo(&["believe", MOVED, "--partners", "0"]);
    assert!(output.out.contains("--partners 1\n"), "{output:?}");
    // Nothing is reported about a partner who was never seen.
    let output = run_leo(&["believe", MOVED, "--partners", "2"]);
    let of_2 = output.out.lines().filter(|line| line.contains("partner 2")).collect::<Vec<_>>();
    assert!(of_2.len() == 1 && of_2[0].starts_with("partner 2"), "{output:?}");
}

#[test]
fn nested_beliefs_are_reported_by_their_path() {
    let files = tempfile::tempdir().expect("a folder");
    let flat = read("config/leo.toml");
    let deeper = flat.replacen("\ndepth = 1 ", "\ndepth = 2 ", 1);
    assert_ne!(flat, deeper);
    let config = write(&files, "leo.toml", &deeper);
    let lines = lines(&run_leo(&["believe", MOVED, "--json", "--config", &config]));
    let nested: Vec<&Value> = lines.iter().filter(|line| number(line, "/perspective") == Some(2)).collect();
    let paths: Vec<_> = nested.iter().filter_map(|line| line.pointer("/path")).collect();
    assert_eq!(paths.len(), 29);
    assert!(paths.iter().all(|path| **path == serde_json::json!([1, 0])), "{paths:?}");
    // While the partner looks away, their model of the robot lacks the change.
    let at_odds = nested.iter().filter(|line| text(line, "/record") == "difference").count();
    assert!(at_odds > 0 && nested.iter().any(|line| text(line, "/record") == "belief"));
}

#[test]
fn the_literal_paper_merges_two_similar_objects_into_one_belief() {
    let twin = r#"{"position_m": [0.6, 0.1, 0.03], "colour_rgb": [0.8, 0.05, 0.05]}"#;
    let frame = format!(r#"{{"at_ns": 1, "observations": [{twin}, {}]}}"#, twin.replace("0.1", "0.18"));
    let trace = format!("{HEADER}\n{frame}\n");
    let beliefs = |arguments: &[&str]| {
        let lines = lines(&believe(&[&["--json"], arguments].concat(), &trace));
        let summary = lines.last().expect("a summary").clone();
        (number(&summary, "/perspectives/0/beliefs"), summary.pointer("/literal").cloned())
    };
    assert_eq!(beliefs(&[]), (Some(2), Some(Value::Array(Vec::new()))));
    let (merged, literal) = beliefs(&["--literal"]);
    assert_eq!(merged, Some(1));
    let output = believe(&["--literal"], &trace);
    for setting in literal.as_ref().and_then(Value::as_array).expect("a list") {
        let setting = setting.as_str().expect("a text");
        assert!(output.out.contains(&format!("literal: {setting}\n")), "{setting}: {output:?}");
    }
    for setting in [
        "cannot_link_same_source_instant = false (was true)",
        "no_term_applies = \"zero\" (was \"infinite\")",
        "normalised = false (was false)",
    ] {
        assert!(output.out.contains(setting), "{setting}: {output:?}");
    }
}

#[test]
fn two_sources_observe_one_object_each_in_its_own_time() {
    let frame = |at_ns: u32, source: u32, y: f32| {
        format!(
            r#"{{"at_ns": {at_ns}, "source": {source}, "observations": [{{"position_m": [0.6, {y}, 0.03]}}]}}"#
        )
    };
    let frames =
        [frame(50, 0, 0.1), frame(50, 1, 0.12), frame(70, 1, 0.12), frame(60, 0, 0.1), frame(60, 1, 0.4)];
    let mut output = believe(&["--json"], format!("{HEADER}\n{}\n", frames.join("\n")));
    let warning = std::mem::take(&mut output.err);
    assert!(warning.lines().count() == 1 && warning.contains("1 of 5 observations was refused"), "{warning}");
    let lines = lines(&output);
    let beliefs: Vec<_> = lines
        .iter()
        .filter(|line| text(line, "/record") == "belief")
        .map(|line| (number(line, "/at_ns"), number(line, "/id"), number(line, "/observations")))
        .collect();
    // The first two frames count as one look. The last but one is late and used at its own time; the last is
    // stale.
    assert_eq!(
        beliefs,
        [(Some(50), Some(1), Some(2)), (Some(70), Some(1), Some(3)), (Some(70), Some(1), Some(4))]
    );
    let summary = lines.last().expect("a summary");
    assert_eq!((number(summary, "/frames"), number(summary, "/refused/0/observations")), (Some(4), Some(1)));
    assert_eq!(number(summary, "/earlier"), Some(1));
}

#[test]
fn a_trace_of_which_nothing_could_be_used_is_an_error() {
    let nothing = r#"{"position_m": [0.6, null, 0.03]}"#;
    let trace = format!("{HEADER}\n{{\"at_ns\": 5, \"observations\": [{nothing}, {nothing}]}}\n");
    for arguments in [&[][..], &["--json"]] {
        let output = believe(arguments, &trace);
        assert_eq!((output.status, output.err.lines().count()), (Some(1), 1), "{output:?}");
        for fact in ["standard input", "2 observations were refused", "`position_m`", "line 2"] {
            assert!(output.err.contains(fact), "{fact} is not in {output:?}");
        }
        assert!(!output.out.is_empty(), "the report is printed all the same");
    }
}

#[test]
fn times_that_are_no_nanoseconds_are_warned_of() {
    let frames = |per_second: f64| {
        let frame = |index: u32| {
            let at = (f64::from(index) * 0.05 * per_second).round();
            format!("{{\"at_ns\": {at}, \"observations\": [{{\"position_m\": [0.6, 0.1, 0.03]}}]}}\n")
        };
        format!("{HEADER}\n{}", (0..40).map(frame).collect::<String>())
    };
    for (per_second, unit) in [(1e3, "in milliseconds?"), (1e6, "in microseconds?")] {
        let output = believe(&[], frames(per_second));
        assert!(output.status == Some(0) && output.err.contains(unit), "{output:?}");
    }
    assert_eq!(believe(&[], frames(1e9)).err, "");
}

#[test]
fn partners_have_their_configured_names() {
    let set = ["--set", "belief.names=[\"Ann\"]"];
    let output = run_leo(&[&["believe", MOVED], &set[..]].concat());
    assert!(output.out.contains("Ann believes in") && !output.out.contains("partner 1"), "{output:?}");
    let learned = run_leo(&[&["learn", "config/examples/squares.jsonl"], &set[..]].concat());
    assert!(learned.out.contains("Ann") && !learned.out.contains("partner 1"), "{learned:?}");
}

#[test]
fn an_empty_trace_is_warned_of_and_is_not_an_error() {
    let output = believe(&[], HEADER);
    assert_eq!((output.status, output.out.as_str()), (Some(0), "0 frames, 0 observations\n"));
    assert!(output.err.contains("it has no frames"), "{output:?}");
    let output = believe(&["--json"], HEADER);
    let [summary] = &lines(&CommandOutput { err: String::new(), ..output })[..] else {
        panic!("more than a summary")
    };
    assert_eq!((number(summary, "/frames"), summary.pointer("/first_at_ns")), (Some(0), Some(&Value::Null)));
}

#[test]
fn refused_and_overflowed_observations_are_reported_at_the_end() {
    let block = r#"{"position_m": [0.6, 0.1, 0.03]}"#;
    let many = vec![block; 70].join(", ");
    let trace = format!(
        "{HEADER}\n{{\"at_ns\": 5, \"observations\": [{}]}}\n{{\"at_ns\": 5, \"observations\": [{block}]}}\n\
         {{\"at_ns\": 6, \"observations\": [{many}]}}\n{{\"at_ns\": 7, \"observations\": [",
        block.replace("0.1", "null")
    );
    let output = believe(&[], &trace);
    assert_eq!((output.status, output.err.lines().count()), (Some(0), 2), "{output:?}");
    assert!(output.err.contains("cut short"), "{output:?}");
    assert!(output.err.contains("2 of 72 observations were refused"), "{output:?}");
    for fact in [
        ("1 observation refused", "`position_m`", "line 2)"),
        ("1 observation refused", "`at_ns`", "line 3)"),
        ("6 observations", "buffers.max_objects", ""),
    ] {
        let (count, key, place) = fact;
        let is_told = |line: &str| line.starts_with(count) && line.contains(key) && line.ends_with(place);
        assert!(output.out.lines().any(is_told), "{fact:?} is not in\n{}", output.out);
    }
    let sum = output.out.lines().rev().take_while(|line| !line.is_empty()).collect::<Vec<_>>();
    insta::assert_snapshot!(sum.into_iter().rev().collect::<Vec<_>>().join("\n"));
}

#[test]
fn dropped_beliefs_are_reported_with_their_perspective() {
    // Never more observations at once than the capacity, but more beliefs.
    let row = |at_ns: u64, y: f64| {
        let block = |index: u32| format!("{{\"position_m\": [{}, {y}, 0.03]}}", f64::from(index) * 0.3);
        let blocks: Vec<String> = (0..40).map(block).collect();
        format!("{{\"at_ns\": {at_ns}, \"observations\": [{}]}}\n", blocks.join(", "))
    };
    let trace = format!("{HEADER}\n{}{}", row(5_000_000, 0.0), row(10_000_000, 0.5));
    let output = believe(&[], &trace);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    let line = "Leo believes in 64 things\n";
    assert!(output.out.contains(line), "{line} is not in\n{}", output.out);
    let left_out = output.out.lines().find(|line| line.starts_with("  16 ")).expect("a line");
    assert!(left_out.contains("buffers.max_objects"), "{left_out}");
}

#[test]
fn an_invalid_trace_is_refused_in_one_line() {
    let files = tempfile::tempdir().expect("a folder");
    let file = |name: &str, text: &str| write(&files, name, text);
    let mut wording = String::new();
    for (file, words) in [
        ("/nowhere/trace.jsonl".to_owned(), ["/nowhere/trace.jsonl", "No such file"]),
        ("config".to_owned(), ["config", "directory"]),
        (file("empty.jsonl", ""), ["empty.jsonl", "empty"]),
        (file("table.csv", "time,x\n1,2\n"), ["table.csv", "leo_trace"]),
        (file("newer.jsonl", "{\"leo_trace\": 2}\n"), ["newer.jsonl", "version 2"]),
        (
            file("wrong.jsonl", &format!("{HEADER}\n{{\"at_ns\": 5, \"observation\": []}}\n")),
            ["wrong.jsonl: line 2, column 26, observation: ", "`observations`?"],
        ),
    ] {
        let output = run_leo(&["believe", &file]);
        assert_refused(&output, 2, &words);
        wording += &redacted(&output.err, &[(&files.path().display().to_string(), "[files]")]);
        assert_refused(&run_leo(&["believe", &file, "--json"]), 2, &words);
    }
    let output = believe(&[], "nothing of the kind");
    assert_refused(&output, 2, &["leo_trace"]);
    insta::assert_snapshot!(wording + &output.err);
    // Everything before the error is reported.
    let frame = r#"{"at_ns": 5, "observations": [{"position_m": [0, 0, 0]}]}"#;
    let output = believe(&["--json"], format!("{HEADER}\n{frame}\n{{}}\n"));
    assert_eq!((output.status, output.out.lines().count()), (Some(2), 3), "{output:?}");
    assert!(output.err.contains("line 3, ") && output.err.lines().count() == 1, "{output:?}");
}

#[test]
fn bad_usage_of_believe_is_reported_with_a_remedy() {
    let cases: [(&[&str], &str); 5] = [
        (&["believe"], "<TRACE>"),
        (&["believe", MOVED, "--every", "0"], "above 0"),
        (&["believe", MOVED, "--every", "-5"], "above 0"),
        (&["believe", MOVED, "--partners", "1000"], "0..=64"),
        (&["believe", MOVED, "--config", "/nowhere/leo.toml"], "/nowhere/leo.toml"),
    ];
    for (arguments, word) in cases {
        let output = run_leo(arguments);
        assert_eq!((output.status, output.out.as_str()), (Some(2), ""), "{arguments:?} {output:?}");
        assert!(output.err.contains(word), "{arguments:?} {output:?}");
    }
}

#[test]
fn a_closed_pipe_is_success_and_a_full_disk_is_not() {
    // More than the capacity of a pipe, so that the command writes after it was closed.
    let frame =
        |at: usize| format!("{{\"at_ns\": {at}, \"observations\": [{{\"position_m\": [0, 0, 0]}}]}}\n");
    let trace: String = std::iter::once(format!("{HEADER}\n")).chain((1..2000).map(frame)).collect();
    let files = tempfile::tempdir().expect("a folder");
    let file = write(&files, "long.jsonl", &trace);
    let (mut command, _folder) = leo(&["believe", &file, "--json"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    let mut first = [0; 20];
    let mut out = child.stdout.take().expect("is piped");
    out.read_exact(&mut first).expect("says something");
    drop(out);
    let ended = child.wait_with_output().expect("ends");
    assert_eq!((ended.status.code(), ended.stderr.as_slice()), (Some(0), &[][..]), "{ended:?}");

    let (mut command, _folder) = leo(&["believe", &file]);
    let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("is there");
    let ended = command.stdout(full).output().expect("ends");
    let err = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(1), "{err}");
    assert!(err.starts_with("leo: ") && err.lines().count() == 1, "{err}");
    insta::assert_snapshot!(err);
}

/// The `nth` code block of a language in `docs/traces.md`.
fn block(kind: &str, nth: usize) -> String {
    let page = read("docs/traces.md");
    let rest = page.split(&format!("```{kind}\n")).nth(1 + nth).expect("a block");
    rest.split("```").next().expect("its end").to_owned()
}

#[test]
fn an_mcap_trace_made_as_documented_gives_the_same_beliefs() {
    let Some(python) = venv::interpreter("mcap-ros2-support==0.5.7", "mcap.writer") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let made = folder.path().join("made.mcap");
    let mut python = Command::new(python);
    python.args(["-c", &block("python", 1)]).arg(&made);
    let output = pipe(&mut python, read(MOVED).as_bytes());
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    let (of_it, of_lines) =
        (run_leo(&["believe", made.to_str().expect("text")]), run_leo(&["believe", MOVED]));
    assert_eq!((of_it.status, of_it.out), (of_lines.status, of_lines.out));
}

#[test]
fn the_detector_example_works_as_documented() {
    let mut python = Command::new("python3");
    python.args(["-c", &block("python", 0)]);
    match Command::new("python3").arg("--version").output() {
        Ok(version) if version.status.success() => {}
        _ => {
            skip::skip("there is no python3 here to convert a detector's CSV with");
            return;
        }
    }
    let trace = pipe(&mut python, block("csv", 0).as_bytes());
    assert_eq!((trace.status, trace.err.as_str()), (Some(0), ""), "{trace:?}");
    let output = believe(&[], &trace.out);
    assert_eq!((output.status, output.out), (Some(0), block("text", 1)));
    // The format example of the page is valid.
    let output = believe(&[], block("json", 0));
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join("shared/trace/src/schema.json").exists());
}
