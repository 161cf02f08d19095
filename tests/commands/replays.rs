//! `leo replay`: replayed output is bit-identical, and every difference is named.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Read as _;
use std::process::Stdio;
use std::thread;

use clock::Duration;
use geometry::Pose;
use message::{Recording, TopicId};
use recording::{Channel, Frame, Subject, Time, Writer};

use crate::acts::{comes_true, movements};
use crate::assert_refused;
use crate::harness::{CommandOutput, Leo, leo, read, run_leo, short_lesson, wait_until, write};
use crate::recordings::{equal, file, frames, recorded};

/// Writes a lockstep recording of a lesson with these frames.
fn rewritten(frames: &[Frame], to: &str) {
    let subject = Subject::load(None, Time::Lockstep, None, Pose::identity(), "a test").expect("built in");
    let mut writer = Writer::new(File::create(to).expect("makes"), &subject).expect("begins");
    frames.iter().for_each(|frame| writer.write(frame).expect("writes"));
    writer.finish().expect("ends");
}

/// Records a lesson to `to` and checks that its replay is bit-identical: beliefs of every perspective,
/// differences, events and joint goals.
fn comes_back(lesson: &str, config: Option<&str>, to: &str) {
    let mut arguments = vec!["teach", lesson, "--record", to];
    // The file of another lesson may exist.
    arguments.push("--force");
    arguments.extend(config.iter().flat_map(|config| ["--config", config]));
    let output = run_leo(&arguments);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{lesson}: {output:?}");
    let output = run_leo(&["replay", to]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{lesson}: {output:?}");
    assert!(!output.out.contains("not compared"), "{lesson}: {output:?}");
    let frames = frames(to);
    let mut counts: BTreeMap<TopicId, usize> = BTreeMap::new();
    for frame in frames.iter().filter(|frame| frame.topic.row().recording == Recording::Derived) {
        *counts.entry(frame.topic).or_default() += 1;
    }
    for topic in [
        TopicId::Beliefs(0),
        TopicId::Beliefs(1),
        TopicId::Divergences(1),
        TopicId::Events,
        TopicId::JointGoals,
    ] {
        assert!(counts.get(&topic).is_some_and(|&count| count > 1), "{lesson}: {counts:?}");
    }
    for (topic, count) in counts {
        assert_eq!(equal(&output, &Channel(topic).to_string()), Some(count), "{lesson}: {topic}\n{output:?}");
    }
}

/// Checks that every act of others was predicted exactly once, and correctly. Returns the number of acts.
fn is_foreseen(lesson: &str, recording: &str) -> usize {
    let mut acts = 0;
    for (movements, act) in movements(&frames(recording)) {
        let comes_true = match (movements.as_slice(), &act) {
            ([], None) => true,
            ([movement], Some(act)) => comes_true(movement, act),
            _ => false,
        };
        assert!(comes_true, "{lesson}: {movements:?}, then {act:?}");
        acts += usize::from(act.is_some());
    }
    acts
}

/// Lessons that need a changed `leo.toml`, with the change that `docs/lessons.md` describes.
const OTHERWISE: [(&str, &str, &str); 5] = [
    ("a_slip", "\nnoise = 0.0 ", "\nnoise = 0.05 "),
    ("the_far_ones", "\nlanguage = \"paper\"", "\nlanguage = \"extended\""),
    ("three_of_them", "\nlanguage = \"paper\"", "\nlanguage = \"extended\""),
    ("two_teachers", "\npartners = 1 ", "\npartners = 2 "),
    ("you_do_not_know_that_i_saw", "\ndepth = 1 ", "\ndepth = 2 "),
];

/// A text with exactly one replacement.
fn changed(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "{from}");
    text.replace(from, to)
}

/// Number of tests among which the built-in lessons are divided. The list is the program's, so that no lesson
/// is missed. The tests run in parallel, none too long for a CI runner.
const PARTS: usize = 4;

/// Checks replay and prediction for every lesson of a part.
fn part_comes_back(part: usize) {
    let folder = tempfile::tempdir().expect("a folder");
    let to = file(&folder, "lesson.mcap");
    let mut names: Vec<&str> = config::lesson::LIBRARY.iter().map(|(name, _)| *name).collect();
    assert!(OTHERWISE.iter().all(|(lesson, ..)| names.contains(lesson)), "{names:?}");
    names.sort_unstable();
    let mut acts = 0;
    for name in names.into_iter().skip(part).step_by(PARTS) {
        let otherwise = OTHERWISE.iter().find(|(lesson, ..)| *lesson == name);
        let config = otherwise
            .map(|(_, from, to)| write(&folder, "leo.toml", &changed(&read("config/leo.toml"), from, to)));
        let lesson = format!("config/lessons/{name}.toml");
        let robot =
            config::Robot::load(config.as_deref().map(std::path::Path::new)).expect("a configuration");
        let needs = config::lesson::Lesson::load(lesson.as_ref()).expect("a lesson").needs;
        assert_eq!((needs.lacking(&robot.leo), needs.is_empty()), (None, otherwise.is_none()), "{name}");
        comes_back(&lesson, config.as_deref(), &to);
        acts += is_foreseen(&lesson, &to);
    }
    assert!(acts > 0, "no act was seen");
}

#[test]
fn lessons_of_part_1_of_4_are_replayed_bit_by_bit() {
    part_comes_back(0);
}

#[test]
fn lessons_of_part_2_of_4_are_replayed_bit_by_bit() {
    part_comes_back(1);
}

#[test]
fn lessons_of_part_3_of_4_are_replayed_bit_by_bit() {
    part_comes_back(2);
}

#[test]
fn lessons_of_part_4_of_4_are_replayed_bit_by_bit() {
    part_comes_back(3);
}

#[test]
fn a_lesson_with_another_seed_differs_and_is_replayed_bit_by_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = changed(&short_lesson(), "position_sd_m = 0.003", "position_sd_m = 0.02");
    let seen = [1, 2].map(|seed| {
        let lesson = changed(&lesson, "seed = 2006", &format!("seed = {seed}"));
        let to = file(&folder, "seed.mcap");
        comes_back(&write(&folder, "seed.toml", &lesson), None, &to);
        let percepts = frames(&to).into_iter().filter(|frame| frame.topic == TopicId::Percepts);
        percepts.map(|frame| frame.bytes).collect::<Vec<_>>()
    });
    assert!(seen[0] != seen[1], "the seed changes nothing");
}

#[test]
fn recordings_are_reproducible_and_replay_differences_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = write(&folder, "short.toml", &short_lesson());
    let [one, other, wrong] = ["1.mcap", "2.mcap", "wrong.mcap"].map(|name| file(&folder, name));
    let output = recorded(&lesson, &one);
    assert_eq!(output.out, recorded(&lesson, &other).out);
    assert_eq!(output.out, run_leo(&["teach", &lesson]).out, "recording changes nothing of the lesson");
    assert!(fs::read(&one).expect("reads") == fs::read(&other).expect("reads"), "the bytes differ");

    // Recording a replay gives the same file again.
    let output = run_leo(&["replay", &one, "--record", &other, "--force"]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    assert!(fs::read(&one).expect("reads") == fs::read(&other).expect("reads"), "the bytes differ");
    assert_refused(&run_leo(&["replay", &one, "--record", &one]), 2, &["is read by this command"]);

    // Flips one bit of the teacher's modelled beliefs: the confidence of the second percept of the first
    // belief.
    let right = frames(&one);
    let nth = |topic: TopicId, nth: usize| {
        let found = right.iter().enumerate().filter(|(_, frame)| frame.topic == topic).nth(nth);
        found.map(|(index, _)| index).expect("there are so many")
    };
    let index = nth(TopicId::Beliefs(1), 1000);
    let mut changed = right.clone();
    changed[index].bytes[280 + 88 + 40 + 16] ^= 1;
    rewritten(&changed, &wrong);
    let output = run_leo(&["replay", &wrong]);
    assert_eq!(output.status, Some(1), "{output:?}");
    assert_eq!(equal(&output, "leo/beliefs/1"), Some(1000), "{output:?}");
    let at = Duration::from_nanos(right[index].at_ns - right[0].at_ns);
    let at = format!("{:.3} s", at.as_secs_f64());
    for words in [
        "leo/beliefs/1, frame 1001, at ",
        &at,
        ": entries[0].percepts[1].confidence: recorded ",
        ", replayed ",
    ] {
        assert!(output.err.contains(words), "{words}: {output:?}");
    }
    // Windows before and after the difference compare equal.
    for window in [["--to", "4"], ["--from", "6"]] {
        let output = run_leo(&[&["replay", wrong.as_str()][..], &window].concat());
        assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{window:?} {output:?}");
        assert!(equal(&output, "leo/beliefs/1").is_some_and(|frames| frames > 500), "{output:?}");
    }

    // One frame too few, then one too many.
    let index = nth(TopicId::Divergences(1), 500);
    let mut fewer = right.clone();
    fewer.remove(index);
    rewritten(&fewer, &wrong);
    let output = run_leo(&["replay", &wrong]);
    assert_eq!(output.status, Some(1), "{output:?}");
    assert!(output.err.contains("leo/divergences/1, frame 50"), "{output:?}");
    let mut more = right.clone();
    more.insert(index, right[index].clone());
    rewritten(&more, &wrong);
    let output = run_leo(&["replay", &wrong]);
    assert_eq!(output.status, Some(1), "{output:?}");
    assert!(output.err.contains("leo/divergences/1, frame 50"), "{output:?}");

    // A changed observation changes the teacher's beliefs, for which it is perceived again. The robot's own
    // percepts are taken from the recording.
    let mut other_percepts = right.clone();
    other_percepts[nth(TopicId::Percepts, 300)].bytes[size_of::<message::PerceptHead>() + 24] ^= 0x40;
    rewritten(&other_percepts, &wrong);
    let output = run_leo(&["replay", &wrong]);
    assert_eq!(output.status, Some(1), "{output:?}");
    assert!(output.err.contains("leo/beliefs/1, frame 301"), "{output:?}");

    // The last third of the file is missing.
    let bytes = fs::read(&one).expect("reads");
    fs::write(&wrong, &bytes[..bytes.len() * 2 / 3]).expect("writes");
    let output = run_leo(&["replay", &wrong]);
    assert_eq!((output.status, output.err.lines().count()), (Some(0), 1), "{output:?}");
    assert!(output.err.contains("is truncated") && output.out.contains("truncated"), "{output:?}");
    assert!(equal(&output, "leo/beliefs/0").is_some_and(|frames| frames > 500), "{output:?}");

    // The writer was killed before its first chunk was whole.
    let mut chunk = mcap::MAGIC.len();
    while bytes[chunk] != mcap::records::op::CHUNK {
        let length = u64::from_le_bytes(*bytes[chunk + 1..].first_chunk().expect("a length"));
        chunk += 9 + usize::try_from(length).expect("is in the file");
    }
    fs::write(&wrong, &bytes[..chunk + 300]).expect("writes");
    let output = run_leo(&["replay", &wrong]);
    assert_eq!((output.status, output.err.lines().count()), (Some(0), 1), "{output:?}");
    assert!(output.err.contains("cut short") && output.err.contains("no whole frame"), "{output:?}");
}

/// A replay at a multiple of real time.
struct Pace {
    output: CommandOutput,
    /// The reported lines without their times.
    lines: Vec<String>,
    /// The lesson time at which each line was read at the earliest.
    kept: Vec<Duration>,
    lasted: Duration,
}

/// Replays a recording with `--speed` and a window, and reads the output meanwhile.
fn paced(recording: &str, speed: f64, window: &[(&str, Duration)]) -> Pace {
    let mut arguments =
        vec!["replay".to_owned(), recording.to_owned(), "--speed".to_owned(), speed.to_string()];
    for (option, at) in window {
        arguments.extend([(*option).to_owned(), at.as_secs_f64().to_string()]);
    }
    let (command, files) = leo(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    let began = clock::now();
    let replay = Leo::start(command, files);
    let (mut lines, mut kept) = (Vec::new(), Vec::new());
    // The result is reported at the end, in lines without a time.
    let ended = wait_until(|| {
        let out = replay.said("out");
        let read = clock::now().since(began).mul_f64(speed);
        let output = out.lines().filter_map(|line| line.split_once(" s] "));
        for (_, line) in output.skip(lines.len()) {
            lines.push(line.to_owned());
            kept.push(read);
        }
        out.contains(" s were played") || !replay.said("err").is_empty()
    });
    assert!(ended, "{}", replay.said("out"));
    let lasted = clock::now().since(began).mul_f64(speed);
    Pace { output: replay.end(), lines, kept, lasted }
}

#[test]
fn a_replay_keeps_its_speed_from_the_start_point() {
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = write(&folder, "short.toml", &short_lesson());
    let to = file(&folder, "short.mcap");
    recorded(&lesson, &to);
    let frames = frames(&to);
    let began_ns = frames[0].at_ns;
    let at = |frame: &Frame| Duration::from_nanos(frame.at_ns - began_ns);
    let of = |topic: TopicId| frames.iter().filter(move |frame| frame.topic == topic);
    let end = of(TopicId::Utterances).map(at).max().expect("something is said");
    let margin = Duration::from_millis(10);

    // Once at real time, and once from the middle at a quarter of it. Then only the last sentence, so slowly
    // that a timed start would exceed the time-out of these tests.
    let middle = Duration::from_secs(4);
    let windows: [(f64, Vec<(&str, Duration)>); 3] = [
        (1.0, Vec::new()),
        (0.25, vec![("--from", middle)]),
        (0.005, vec![("--from", end - margin), ("--to", end + margin)]),
    ];
    let replays = windows.map(|(speed, window)| {
        let to = to.clone();
        let of_window = window.clone();
        (window, thread::spawn(move || paced(&to, speed, &of_window)))
    });
    let mut whole: Vec<String> = Vec::new();
    for (window, replay) in replays {
        let Pace { output, lines, kept, lasted } = replay.join().expect("is told");
        assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{window:?} {output:?}");
        let bound = |name: &str| window.iter().find(|(option, _)| *option == name).map(|(_, at)| *at);
        let (from, to) = (bound("--from").unwrap_or_default(), bound("--to").unwrap_or(Duration::MAX));
        let is_in = |frame: &&Frame| at(frame) >= from && at(frame) <= to;

        // No line appears before its time. An utterance is received one step of 5 ms earlier, and times are
        // reported in hundredths of a second.
        let turns = || of(TopicId::Percepts).filter(is_in).map(at);
        let first = turns().min().expect("some");
        let tells = |frame: &&Frame| matches!(frame.topic, TopicId::Utterances | TopicId::Events);
        let instants: Vec<Duration> = frames.iter().filter(tells).filter(is_in).map(at).collect();
        let begin = instants[0];
        assert_eq!(lines.len(), output.out.matches(" s] ").count());
        for (line, kept) in output.out.lines().zip(kept) {
            let since = line[1..].split_once(" s] ").expect("an instant").0.trim().parse().expect("seconds");
            let due = begin + Duration::from_secs_f64(since);
            assert!(kept + 2 * margin + first >= due, "{window:?} {kept:?} {line}");
        }
        let last = turns().max().expect("some");
        assert!(lasted >= last - first, "{window:?} lasted {lasted:?}");

        // The window is reported and compared as in a full replay.
        assert_eq!(
            equal(&output, "leo/beliefs/1"),
            Some(of(TopicId::Beliefs(1)).filter(is_in).count()),
            "{output:?}"
        );
        assert!(lines.len() >= instants.len().min(2), "{output:?}");
        if whole.is_empty() {
            whole.clone_from(&lines);
        }
        assert!(whole.ends_with(&lines), "{window:?} {lines:#?}\n{whole:#?}");
        assert_eq!(window.is_empty(), whole.len() == lines.len());
    }
}

#[test]
fn a_replay_ends_when_its_output_is_closed_unless_it_records() {
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = write(&folder, "short.toml", &short_lesson());
    let to = file(&folder, "short.mcap");
    recorded(&lesson, &to);
    // So slowly that the whole replay would exceed the time-out of these tests.
    let (mut command, _files) = leo(&["replay", &to, "--speed", "0.005", "--from", "1.25"]);
    let mut replay = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    drop(replay.stdout.take());
    let mut status = None;
    wait_until(|| {
        status = replay.try_wait().expect("ours");
        status.is_some()
    });
    if status.is_none() {
        replay.kill().expect("ours");
    }
    assert_eq!(status.and_then(|status| status.code()), Some(0));
    let mut said = String::new();
    replay.stderr.take().expect("piped").read_to_string(&mut said).expect("reads");
    assert_eq!(said, "");

    let again = file(&folder, "again.mcap");
    let (mut command, _files) = leo(&["replay", &to, "--speed", "100", "--record", &again]);
    let mut replay = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("starts");
    drop(replay.stdout.take());
    replay.wait().expect("ours");
    let percepts = |file: &str| frames(file).iter().filter(|frame| frame.topic == TopicId::Percepts).count();
    assert_eq!(percepts(&again), percepts(&to));
}

/// An attached configuration file is refused with the name of the recording and the file.
#[test]
fn a_recording_with_an_invalid_body_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let wrong = file(&folder, "wrong.mcap");
    let mut subject =
        Subject::load(None, Time::Lockstep, None, Pose::identity(), "a test").expect("built in");
    for (name, from, to, words) in [
        ("leo.urdf", "lower=\"-0.8\"", "lower=\"-0.9\"", "wrong.mcap/leo.urdf"),
        ("leo.toml", "[belief]", "[relief]", "wrong.mcap/leo.toml"),
    ] {
        let whole = subject.files.clone();
        let text = subject.files.iter_mut().find(|(file, _)| *file == name).expect("is there");
        assert!(text.1.contains(from), "{name}");
        text.1 = text.1.replacen(from, to, 1);
        let writer = Writer::new(File::create(&wrong).expect("makes"), &subject).expect("begins");
        writer.finish().expect("ends");
        assert_refused(&run_leo(&["replay", &wrong]), 2, &[words]);
        subject.files = whole;
    }
}
