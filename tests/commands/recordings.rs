//! `leo teach --record`, `leo record` and `leo replay`: what is in the file, and what comes of it.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use geometry::Pose;
use recording::{Buffer, Frame, Reader, Subject, Time, Writer};
use tempfile::TempDir;

use crate::assert_refused;
use crate::house::{Leo, Told, leo, read, short_lesson, tell, wait_until, write};

#[path = "../sources/venv.rs"]
mod venv;

/// A file in a folder, by its path.
fn file(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}

/// Records a lesson, which succeeds and says nothing on standard error.
fn recorded(lesson: &str, to: &str) -> Told {
    let told = tell(&["teach", lesson, "--record", to]);
    assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{told:?}");
    told
}

fn frames(file: &str) -> Vec<Frame> {
    let reader = Reader::open(Path::new(file)).expect("is a recording");
    reader.map(|frame| frame.expect("is whole")).collect()
}

/// Writes a recording of a lesson in lockstep time with these frames.
fn rewritten(frames: &[Frame], to: &str) {
    let subject = Subject::load(None, Time::Lockstep, None, Pose::identity(), "a test").expect("built in");
    let mut writer = Writer::new(File::create(to).expect("makes"), &subject).expect("begins");
    frames.iter().for_each(|frame| writer.write(frame).expect("writes"));
    writer.finish().expect("ends");
}

/// How many frames of a buffer a replay found equal.
fn equal(told: &Told, buffer: &str) -> Option<usize> {
    let line = told.out.lines().find(|line| line.split_whitespace().next() == Some(buffer))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// A lesson comes back bit by bit: what is believed of every perspective, how they differ, what is learned,
/// and where the joints shall be. The recording's file is `to`.
fn comes_back(lesson: &str, config: Option<&str>, to: &str) {
    let mut arguments = vec!["teach", lesson, "--record", to];
    arguments.extend(config.iter().flat_map(|config| ["--config", config]));
    let told = tell(&arguments);
    assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{lesson}: {told:?}");
    let told = tell(&["replay", to]);
    assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{lesson}: {told:?}");
    assert!(!told.out.contains("not compared"), "{lesson}: {told:?}");
    let mut counts: BTreeMap<Buffer, usize> = BTreeMap::new();
    for frame in frames(to).iter().filter(|frame| frame.buffer.is_made_of_others()) {
        *counts.entry(frame.buffer).or_default() += 1;
    }
    for buffer in
        [Buffer::Beliefs(0), Buffer::Beliefs(1), Buffer::Divergences(1), Buffer::Events, Buffer::JointGoals]
    {
        assert!(counts.get(&buffer).is_some_and(|&count| count > 1), "{lesson}: {counts:?}");
    }
    for (buffer, count) in counts {
        assert_eq!(equal(&told, &buffer.to_string()), Some(count), "{lesson}: {buffer}\n{told:?}");
    }
}

/// Lessons that need another `leo.toml` than the one that comes with the program to show what they show, and
/// what is otherwise in it, as `docs/lessons.md` says.
const OTHERWISE: [(&str, &str, &str); 5] = [
    ("a_slip", "\nnoise = 0.0 ", "\nnoise = 0.05 "),
    ("the_far_ones", "\nlanguage = \"paper\"", "\nlanguage = \"extended\""),
    ("three_of_them", "\nlanguage = \"paper\"", "\nlanguage = \"extended\""),
    ("two_teachers", "\npartners = 1 ", "\npartners = 2 "),
    ("you_do_not_know_that_i_saw", "\ndepth = 1 ", "\ndepth = 2 "),
];

/// A text with one thing changed in it.
fn changed(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "{from}");
    text.replace(from, to)
}

/// Parts of the lessons, of which each is a test below: the list is the program's, so that no lesson is
/// forgotten, and the parts run side by side, none for so long that a runner gives it up.
const PARTS: usize = 4;

/// Every lesson of a part comes back.
fn part_comes_back(part: usize) {
    let folder = tempfile::tempdir().expect("a folder");
    let to = file(&folder, "lesson.mcap");
    let mut names: Vec<&str> = config::lesson::LIBRARY.iter().map(|(name, _)| *name).collect();
    assert!(OTHERWISE.iter().all(|(lesson, ..)| names.contains(lesson)), "{names:?}");
    names.sort_unstable();
    for name in names.into_iter().skip(part).step_by(PARTS) {
        let otherwise = OTHERWISE.iter().find(|(lesson, ..)| *lesson == name);
        let config = otherwise
            .map(|(_, from, to)| write(&folder, "leo.toml", &changed(&read("config/leo.toml"), from, to)));
        comes_back(&format!("config/lessons/{name}.toml"), config.as_deref(), &to);
    }
}

#[test]
fn the_layout_for_viewers_shows_channels_that_there_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = write(&folder, "short.toml", &short_lesson());
    let to = file(&folder, "short.mcap");
    recorded(&lesson, &to);
    let recording = fs::read(&to).expect("reads");
    let layout = Path::new(env!("CARGO_MANIFEST_DIR")).join("package/viewer-layout.json");
    let layout: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(layout).expect("reads")).expect("JSON");
    let panels = layout["configById"].as_object().expect("panels");
    let mut topics: Vec<String> = Vec::new();
    for panel in panels.values() {
        topics.extend(panel["topics"].as_object().into_iter().flat_map(|topics| topics.keys().cloned()));
        topics.extend(panel["topicToRender"].as_str().map(str::to_owned));
        topics.extend(panel["layers"]["leo"]["topic"].as_str().map(str::to_owned));
        let paths = panel["paths"].as_array().into_iter().flatten();
        topics.extend(paths.filter_map(|path| Some(path["value"].as_str()?.split_once('.')?.0.to_owned())));
    }
    assert!(topics.len() > 5, "{topics:?}");
    // The names of all channels stand, not compressed, in the summary at the end.
    for topic in topics {
        let named =
            [&u32::try_from(topic.len()).expect("short").to_le_bytes()[..], topic.as_bytes()].concat();
        assert!(recording.windows(named.len()).any(|bytes| bytes == named), "{topic}");
    }
}

#[test]
fn every_lesson_of_a_first_part_is_replayed_bit_by_bit() {
    part_comes_back(0);
}

#[test]
fn every_lesson_of_a_second_part_is_replayed_bit_by_bit() {
    part_comes_back(1);
}

#[test]
fn every_lesson_of_a_third_part_is_replayed_bit_by_bit() {
    part_comes_back(2);
}

#[test]
fn every_lesson_of_a_fourth_part_is_replayed_bit_by_bit() {
    part_comes_back(3);
}

#[test]
fn with_another_seed_and_more_noise_a_lesson_is_another_and_is_replayed_bit_by_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = changed(&short_lesson(), "position_sigma_m = 0.003", "position_sigma_m = 0.02");
    let seen = [1, 2].map(|seed| {
        let lesson = changed(&lesson, "seed = 2006", &format!("seed = {seed}"));
        let to = file(&folder, "seed.mcap");
        comes_back(&write(&folder, "seed.toml", &lesson), None, &to);
        let percepts = frames(&to).into_iter().filter(|frame| frame.buffer == Buffer::Percepts);
        percepts.map(|frame| frame.bytes).collect::<Vec<_>>()
    });
    assert!(seen[0] != seen[1], "the seed changes nothing");
}

#[test]
fn a_recording_is_the_same_bytes_every_time_and_every_difference_of_a_replay_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = write(&folder, "short.toml", &short_lesson());
    let [one, other, wrong] = ["1.mcap", "2.mcap", "wrong.mcap"].map(|name| file(&folder, name));
    let told = recorded(&lesson, &one);
    assert_eq!(told.out, recorded(&lesson, &other).out);
    assert_eq!(told.out, tell(&["teach", &lesson]).out, "recording changes nothing of the lesson");
    assert!(fs::read(&one).expect("reads") == fs::read(&other).expect("reads"), "the bytes differ");

    // Of a replay it is the same file once more.
    let told = tell(&["replay", &one, "--record", &other]);
    assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{told:?}");
    assert!(fs::read(&one).expect("reads") == fs::read(&other).expect("reads"), "the bytes differ");
    assert_refused(&tell(&["replay", &one, "--record", &one]), 2, &["write over what is played"]);

    // One bit of what the teacher was taken to believe: the confidence in the second percept of the
    // first belief.
    let right = frames(&one);
    let nth = |buffer: Buffer, nth: usize| {
        let found = right.iter().enumerate().filter(|(_, frame)| frame.buffer == buffer).nth(nth);
        found.map(|(index, _)| index).expect("there are so many")
    };
    let index = nth(Buffer::Beliefs(1), 1000);
    let mut changed = right.clone();
    changed[index].bytes[280 + 40 + 40 + 16] ^= 1;
    rewritten(&changed, &wrong);
    let told = tell(&["replay", &wrong]);
    assert_eq!(told.status, Some(1), "{told:?}");
    assert_eq!(equal(&told, "leo/beliefs/1"), Some(1000), "{told:?}");
    let at = std::time::Duration::from_nanos(right[index].at_ns - right[0].at_ns);
    let at = format!("{:.3} s", at.as_secs_f64());
    for words in [
        "leo/beliefs/1, frame 1001, at ",
        &at,
        ": entries[0].percepts[1].confidence: recorded ",
        ", replayed ",
    ] {
        assert!(told.err.contains(words), "{words}: {told:?}");
    }
    // Before it, nothing is wrong; and behind it, what is compared is right.
    for window in [["--to", "4"], ["--from", "6"]] {
        let told = tell(&[&["replay", wrong.as_str()][..], &window].concat());
        assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{window:?} {told:?}");
        assert!(equal(&told, "leo/beliefs/1").is_some_and(|frames| frames > 500), "{told:?}");
    }

    // A frame too few, and one too many.
    let index = nth(Buffer::Divergences(1), 500);
    let mut fewer = right.clone();
    fewer.remove(index);
    rewritten(&fewer, &wrong);
    let told = tell(&["replay", &wrong]);
    assert_eq!(told.status, Some(1), "{told:?}");
    assert!(told.err.contains("leo/divergences/1, frame 50"), "{told:?}");
    let mut more = right.clone();
    more.insert(index, right[index].clone());
    rewritten(&more, &wrong);
    let told = tell(&["replay", &wrong]);
    assert_eq!(told.status, Some(1), "{told:?}");
    assert!(told.err.contains("leo/divergences/1, frame 50"), "{told:?}");

    // A thing that was observed elsewhere is believed elsewhere from the teacher's perspective, for which
    // it is perceived anew; the robot's own percept of it is as it was.
    let mut other_percepts = right.clone();
    other_percepts[nth(Buffer::Percepts, 300)].bytes[size_of::<message::PerceptHead>() + 24] ^= 0x40;
    rewritten(&other_percepts, &wrong);
    let told = tell(&["replay", &wrong]);
    assert_eq!(told.status, Some(1), "{told:?}");
    assert!(told.err.contains("leo/beliefs/1, frame 301"), "{told:?}");

    // Without its last third.
    let bytes = fs::read(&one).expect("reads");
    fs::write(&wrong, &bytes[..bytes.len() * 2 / 3]).expect("writes");
    let told = tell(&["replay", &wrong]);
    assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{told:?}");
    assert!(told.out.contains("the file ends in the middle, after "), "{told:?}");
    assert!(equal(&told, "leo/beliefs/0").is_some_and(|frames| frames > 500), "{told:?}");

    // In the time of the machine it is the same, and it is told.
    let told = tell(&["replay", &one, "--speed", "20"]);
    assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{told:?}");
    assert!(told.out.contains("the teacher: \"") && told.out.contains("frames equal"), "{told:?}");
}

#[test]
fn what_cannot_be_recorded_or_replayed_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = write(&folder, "short.toml", &short_lesson());
    let text = write(&folder, "notes.txt", "these are no frames of anything\n");
    assert_refused(&tell(&["replay", &text]), 2, &["notes.txt is no recording of Leo", "leo teach"]);
    assert_refused(&tell(&["replay", "/nowhere/x.mcap"]), 2, &["/nowhere/x.mcap"]);
    let both = ["teach", &lesson, &lesson, "--record", "x.mcap"];
    assert_refused(&tell(&both), 2, &["--record holds one lesson"]);
    assert_refused(&tell(&["teach", &lesson, "--record", "/nowhere/x.mcap"]), 1, &["/nowhere/x.mcap"]);
    // The disk is full from the first byte on.
    assert_refused(&tell(&["teach", &lesson, "--record", "/dev/full"]), 1, &["/dev/full", "No space left"]);
    for (arguments, words) in [
        (["replay", &text, "--speed", "-1"], "from 0.001 to 1000"),
        (["replay", &text, "--from", "NaN"], "above 0"),
        (["record", &text, "--domain", "/dev/shm/leo-nobody-is-here"], "leo run"),
    ] {
        let told = tell(&arguments);
        assert_eq!((told.status, told.out.as_str()), (Some(2), ""), "{arguments:?} {told:?}");
        assert!(told.err.contains(words), "{arguments:?} {told:?}");
    }
    let crossed = ["replay", text.as_str(), "--from", "5", "--to", "4"];
    assert_refused(&tell(&crossed), 2, &["--to must be after --from"]);
}

#[test]
fn a_disk_that_fills_up_leaves_what_was_written() {
    if !rustix::process::getuid().is_root() {
        eprintln!("skipped: only root can mount a small disk");
        return;
    }
    let (command, files) = leo(&[]);
    let to = files.path().join("disk/x.mcap").display().to_string();
    let script = "mkdir \"${1%/*}\"; mount -t tmpfs -o size=2m tmpfs \"${1%/*}\" || exit 77
        \"$0\" teach config/lessons/task1.toml --record \"$1\"; echo \"taught: $?\"
        \"$0\" replay \"$1\"; echo \"replayed: $?\"";
    let mut inside = Command::new("unshare");
    inside.args(["-m", "sh", "-c", script]).arg(command.get_program()).arg(&to);
    inside.current_dir(env!("CARGO_MANIFEST_DIR")).stdin(std::process::Stdio::null());
    let told = Leo::start(inside, files).end();
    if told.status == Some(77) || told.err.contains("unshare") {
        eprintln!("skipped: no mount namespace of its own here: {}", told.err);
        return;
    }
    assert!(
        told.err.contains("No space left on device") && told.err.contains("read up to there"),
        "{told:?}"
    );
    assert_eq!(told.err.lines().count(), 1, "{told:?}");
    assert!(told.out.contains("taught: 1") && told.out.contains("replayed: 0"), "{told:?}");
    assert!(equal(&told, "leo/beliefs/1").is_some_and(|frames| frames > 100), "{told:?}");
}

/// A running robot, by the folder of its domain.
struct Robot(Leo, PathBuf);

fn robot() -> Robot {
    let (command, files) = leo(&["run"]);
    let robot = Leo::start(command, files);
    assert!(wait_until(|| robot.said("out").contains("the teacher:")), "{}", robot.said("err"));
    let domain = robot.domain();
    Robot(robot, domain)
}

/// Records onto a disk of its own, of forty megabytes of which six are free, and then onto what is left of it;
/// the disk goes with the script, a copy of the file stays.
const ONTO_A_SMALL_DISK: &str = "mount -t tmpfs -o size=40m tmpfs \"$1\" || exit 77
    head -c 34m /dev/zero > \"$1/others\"
    \"$0\" record \"$1/full.mcap\" --domain \"$3\"; status=$?
    df --output=avail \"$1\" | tail -1
    \"$0\" record \"$1/again.mcap\" --domain \"$3\"; test ! -e \"$1/again.mcap\" || exit 3
    \"$0\" record \"$1/last.mcap\" --last 5 --for 1 --domain \"$3\"; test ! -e \"$1/last.mcap\" || exit 4
    cp \"$1/full.mcap\" \"$2\"; exit $status";

#[test]
fn a_disk_without_room_ends_the_recording_with_one_error_and_not_the_robot_and_some_is_left() {
    let folder = tempfile::tempdir().expect("a folder");
    let Robot(robot, domain) = robot();
    let [disk, copy] = ["disk", "copy.mcap"].map(|name| file(&folder, name));
    fs::create_dir(&disk).expect("makes");
    let told = Command::new("unshare")
        .args(["--mount", "sh", "-c", ONTO_A_SMALL_DISK, env!("CARGO_BIN_EXE_leo"), &disk, &copy])
        .arg(&domain)
        .output();
    let has_disk = |told: &Output| told.status.code() != Some(77) && !told.stderr.starts_with(b"unshare:");
    let Some(told) = told.ok().filter(has_disk) else {
        eprintln!("SKIPPED: needs `unshare --mount` and the right to mount a tmpfs");
        return;
    };
    assert_eq!(told.status.code(), Some(1), "{told:?}");
    let err = String::from_utf8_lossy(&told.stderr);
    let [ended, refused, last] = err.lines().collect::<Vec<_>>()[..] else { panic!("{err}") };
    for (said, name) in [(ended, "full.mcap"), (refused, "again.mcap"), (last, "last.mcap")] {
        assert!(said.contains(name) && said.contains("less than 3 MB of its disk are free"), "{said}");
    }
    let left_kb: u64 = String::from_utf8_lossy(&told.stdout).trim().parse().expect("kilobytes");
    assert!(left_kb > 500, "{left_kb} kB are left to others");
    let mut reader = Reader::open(Path::new(&copy)).expect("is a recording");
    let read = reader.by_ref().inspect(|frame| assert!(frame.is_ok(), "{frame:?}")).count();
    assert!(read > 500 && !reader.is_cut(), "{read}");
    // The robot runs on, and can be recorded.
    let whole = file(&folder, "whole.mcap");
    let told = tell(&["record", &whole, "--for", "1", "--domain", &domain.display().to_string()]);
    assert_eq!(told.status, Some(0), "{told:?}");
    assert!(frames(&whole).len() > 500);
    robot.interrupt();
    let told = robot.end();
    assert_eq!(told.status, Some(0), "{told:?}");
    assert!(!told.out.contains("starts anew") && !told.err.contains("starts anew"), "{told:?}");
}

#[test]
fn a_running_robot_is_recorded_and_notices_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let Robot(robot, domain) = robot();
    let domain = domain.display().to_string();
    let [whole, killed, to_the_end] = ["1.mcap", "2.mcap", "3.mcap"].map(|name| file(&folder, name));
    let record = |to: &str| {
        let (command, files) = leo(&["record", to, "--domain", &domain]);
        Leo::start(command, files)
    };
    let holds = |to: &str, count: usize| {
        wait_until(|| Reader::open(Path::new(to)).is_ok_and(|reader| reader.flatten().count() > count))
    };

    // Two at once; one is killed, and what it wrote can be read.
    let (first, second) = (record(&whole), record(&killed));
    assert!(holds(&killed, 500), "{}", second.said("err"));
    second.kill();
    let mut reader = Reader::open(Path::new(&killed)).expect("is a recording");
    assert!(reader.by_ref().all(|frame| frame.is_ok()) && reader.is_cut());

    // Ctrl-C ends the other one.
    assert!(holds(&whole, 500), "{}", first.said("err"));
    first.interrupt();
    let told = first.end();
    assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{told:?}");
    assert!(told.out.contains("leo/beliefs/1 ") && told.out.contains("dropped"), "{told:?}");
    let mut reader = Reader::open(Path::new(&whole)).expect("is a recording");
    assert_eq!(reader.about().map(|about| about.time), Some(Time::Wall));
    let count = reader.by_ref().filter(Result::is_ok).count();
    assert!(!reader.is_cut());
    let said: usize =
        told.out.lines().filter_map(|line| line.split_whitespace().nth(1)?.parse::<usize>().ok()).sum();
    assert_eq!(said, count, "{told:?}");

    // A full disk ends the recording, and the robot goes on.
    let full = tell(&["record", "/dev/full", "--domain", &domain]);
    assert_refused(&full, 1, &["/dev/full", "No space left"]);

    // What was recorded in the machine's time is played, and nothing is claimed of it.
    let told = tell(&["replay", &whole]);
    assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{told:?}");
    assert!(told.out.contains("nothing was compared: "), "{told:?}");
    // What the processes make of it is the same every time.
    let again = file(&folder, "again.mcap");
    let told = tell(&["replay", &whole, "--record", &again]);
    assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{told:?}");
    let told = tell(&["replay", &again]);
    assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{told:?}");
    assert!(equal(&told, "leo/beliefs/1").is_some_and(|frames| frames > 50), "{told:?}");
    assert!(!told.out.contains("not compared"), "{told:?}");

    // With the robot, the recording ends.
    // and so does one that keeps the last while in memory: it is written down then.
    let last = file(&folder, "last.mcap");
    let (command, files) = leo(&["record", &last, "--domain", &domain, "--last", "1"]);
    let third = record(&to_the_end);
    let fourth = Leo::start(command, files);
    assert!(holds(&to_the_end, 8000), "{}", third.said("err"));
    assert!(!Path::new(&last).exists());
    robot.interrupt();
    for recorder in [third, fourth] {
        let told = recorder.end();
        assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{told:?}");
    }
    let lasts = |file: &str| {
        let instants: Vec<u64> = frames(file)
            .iter()
            .filter(|frame| frame.buffer == Buffer::Percepts)
            .map(|frame| frame.at_ns)
            .collect();
        (instants.len(), instants.iter().max().copied().expect("some"))
    };
    let ((all, until), (some, until_then)) = (lasts(&to_the_end), lasts(&last));
    assert!(some < all && some > 100, "{some} of {all}");
    assert!(until.abs_diff(until_then) < 1_000_000_000, "{until} {until_then}");
    // A busy machine may have told the robot of itself; nobody of it died.
    let ended = robot.end();
    assert_eq!(ended.status, Some(0), "{ended:?}");
    assert!(!ended.err.contains("died") && !ended.err.contains("killed"), "{ended:?}");
}

/// Opens a recording with readers that know nothing of Leo: counts the messages of every topic, decodes
/// those of ROS 2, and reads a belief by what its schema says.
const PYTHON: &str = r#"
import json, struct, sys
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

counts, decoded, beliefs, metadata, tf, robot = {}, {}, [], {}, set(), ""
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
    assert reader.get_header().profile == "ros2"
    statistics = reader.get_summary().statistics
    for record in reader.iter_metadata():
        metadata[record.name] = record.metadata
    files = sorted(attachment.name for attachment in reader.iter_attachments())
    for schema, channel, message in reader.iter_messages():
        counts[channel.topic] = counts.get(channel.topic, 0) + 1
        if channel.topic == "leo/beliefs/0":
            lines = schema.data.decode().splitlines()
            sizes = dict(line.split(": ") for line in lines if line.endswith(" bytes"))
            head, entry = (int(sizes[name].split()[0]) for name in schema.name.split("+"))
            at_ns, sequence = struct.unpack_from("<QQ", message.data)
            beliefs.append([at_ns, sequence, (len(message.data) - head) / entry])
    ros = [topic for topic in counts if topic.startswith("/")]
    for schema, channel, message, value in reader.iter_decoded_messages(topics=ros):
        decoded[channel.topic] = decoded.get(channel.topic, 0) + 1
        if channel.topic == "/joint_states":
            joints = [len(value.name), len(value.position), len(value.velocity)]
        elif channel.topic == "/tf":
            tf.update((link.header.frame_id, link.child_frame_id) for link in value.transforms)
        elif channel.topic == "/robot_description":
            robot = value.data
        elif channel.topic == "/log":
            log = [value.level, value.name, value.msg]
        elif channel.topic == "/beliefs/leo":
            cubes = [[mark.scale.x, mark.pose.position.z, mark.color.a] for mark in value.markers if mark.ns == "beliefs"]
assert sum(counts.values()) == statistics.message_count
json.dump({"counts": counts, "decoded": decoded, "beliefs": beliefs, "metadata": metadata, "files": files,
    "joints": joints, "tf": sorted(tf), "robot": len(robot), "log": log, "cubes": cubes}, sys.stdout)
"#;

#[test]
fn readers_that_know_nothing_of_leo_open_a_recording() {
    let Some(python) = venv::interpreter("mcap-ros2-support==0.5.7", "mcap_ros2.decoder") else {
        eprintln!("SKIPPED: no python3 with venv and the package mcap-ros2-support here");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = write(&folder, "short.toml", &short_lesson());
    let script = write(&folder, "read.py", PYTHON);
    let to = file(&folder, "short.mcap");
    recorded(&lesson, &to);
    let output = Command::new(python).args([&script, &to]).output().expect("runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("is JSON");

    let frames = frames(&to);
    let count = |buffer: Buffer| frames.iter().filter(|frame| frame.buffer == buffer).count();
    let topics = found["counts"].as_object().expect("an object");
    let leos = topics.keys().filter(|topic| topic.starts_with("leo/"));
    assert_eq!(leos.count(), 8 + 1, "{topics:?}");
    for (topic, number) in topics.iter().filter(|(topic, _)| topic.starts_with("leo/")) {
        let buffer = Buffer::of_topic(topic).expect("a buffer");
        assert_eq!(number.as_u64(), u64::try_from(count(buffer)).ok(), "{topic}");
        let counted = found["metadata"]["leo.counts"][topic].as_str().expect("is counted");
        assert_eq!(counted, format!("{number} written, 0 dropped"));
    }
    assert_eq!(found["metadata"]["leo"]["time"], "lockstep");
    assert_eq!(
        found["files"],
        serde_json::json!(["leo.toml", "leo.urdf", "motor.toml", "percepts.toml", "perspective.toml"])
    );
    // Every belief frame by its schema alone.
    let beliefs = found["beliefs"].as_array().expect("a list");
    let ours = frames.iter().filter(|frame| frame.buffer == Buffer::Beliefs(0));
    for (theirs, ours) in beliefs.iter().zip(ours) {
        let (_, entries) = ours.read::<message::Beliefs>().expect("beliefs");
        assert_eq!(
            theirs,
            &serde_json::json!([
                ours.at_ns,
                ours.sequence,
                f64::from(u32::try_from(entries.len()).expect("fits"))
            ])
        );
    }

    // What viewers show.
    let decoded = |topic: &str| found["decoded"][topic].as_u64().unwrap_or(0);
    assert_eq!(decoded("/joint_states"), u64::try_from(count(Buffer::JointStates)).expect("fits"));
    assert_eq!(decoded("/robot_description"), 1);
    let beliefs = u64::try_from(count(Buffer::Beliefs(0))).expect("fits");
    for topic in ["/beliefs/leo", "/beliefs/the_teacher", "/scene"] {
        // 200 a second are shown 50 times a second.
        assert!(decoded(topic).abs_diff(beliefs / 4) <= 1, "{topic}: {} of {beliefs}", decoded(topic));
    }
    let said = count(Buffer::Utterances) + count(Buffer::Events);
    assert!(decoded("/log") >= u64::try_from(said).expect("fits"), "{found}");
    assert_eq!(found["joints"], serde_json::json!([65, 65, 65]));
    assert_eq!(found["log"][0], 20);
    assert!(found["robot"].as_u64() > Some(10_000));
    let links: Vec<(&str, &str)> = found["tf"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|link| Some((link[0].as_str()?, link[1].as_str()?)))
        .collect();
    assert!(links.len() > 70 && links.contains(&("world", "base_link")), "{links:?}");
    assert!(links.iter().any(|(parent, child)| *parent == "world" && child.starts_with("scene/")));
    assert!(links.iter().any(|(_, child)| *child == "left_grasp"), "{links:?}");
    let cubes = found["cubes"].as_array().expect("a list");
    assert!(cubes.len() > 3, "{cubes:?}");
    assert!(
        cubes.iter().all(|cube| cube[0].as_f64().is_some_and(|size| size > 0.005 && size < 1.0)),
        "{cubes:?}"
    );
}

/// The recorder of a process that goes on: started, asked and stopped, and again.
#[test]
fn a_process_records_and_goes_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let Robot(robot, domain) = robot();
    let domain = transport::Domain::at(&domain).expect("a domain");
    // It has a place of its own in the domain, too.
    let queues = transport::Queues { frames: 1, delivery: transport::Delivery::Newest };
    let node = transport::Node::join(&domain, "test", 1, queues).expect("joins");
    for name in ["1.mcap", "2.mcap"] {
        let to = file(&folder, name);
        let subject = Subject::load(None, Time::Wall, None, Pose::identity(), "a test").expect("built in");
        let recorder = recording::Recorder::start(&domain, subject, Path::new(&to)).expect("starts");
        assert!(
            wait_until(|| recorder.counts().of(Buffer::Beliefs(1)).written > 100 || recorder.has_ended())
        );
        assert!(!recorder.has_ended());
        let counts = recorder.stop().expect("is whole");
        let read = u64::try_from(frames(&to).len()).expect("fits");
        assert_eq!(counts.total().written, read);
    }
    let subject = Subject::load(None, Time::Wall, None, Pose::identity(), "a test").expect("built in");
    let full = recording::Recorder::start(&domain, subject, Path::new("/dev/full")).expect_err("is refused");
    assert!(full.to_string().contains("/dev/full"), "{full}");
    // What was last is written down whenever it is asked for.
    let subject = Subject::load(None, Time::Wall, None, Pose::identity(), "a test").expect("built in");
    let recorder =
        recording::Recorder::keep(&domain, subject, std::time::Duration::from_secs(60), usize::MAX);
    let recorder = recorder.expect("starts");
    for name in ["3.mcap", "4.mcap"] {
        let seen = recorder.counts().of(Buffer::Beliefs(1)).written;
        assert!(wait_until(|| recorder.counts().of(Buffer::Beliefs(1)).written > seen + 100));
        let to = file(&folder, name);
        let saved = recorder.last().expect("is kept").write(Path::new(&to)).expect("is written");
        assert_eq!(saved, u64::try_from(frames(&to).len()).expect("fits"));
    }
    assert!(recorder.last().expect("is kept").write(Path::new("/dev/full")).is_err());
    recorder.stop().expect("ends");
    drop(node);
    robot.interrupt();
    assert_eq!(robot.end().status, Some(0));
}
