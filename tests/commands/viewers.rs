//! Recordings in other programs.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use message::{Events, Scene, TopicId, Utterances};
use recording::{Channel, Frame, Reader};
use tempfile::TempDir;

use crate::harness::{short_lesson, write};
use crate::recordings::{file, frames, recorded};
use crate::venv;

#[test]
fn the_viewer_layout_shows_only_existing_channels() {
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
    // The summary at the end has the uncompressed names of all channels.
    for topic in topics {
        let named =
            [&u32::try_from(topic.len()).expect("short").to_le_bytes()[..], topic.as_bytes()].concat();
        assert!(recording.windows(named.len()).any(|bytes| bytes == named), "{topic}");
    }
}

/// A recording of a short lesson: its path and its frames.
fn lesson(folder: &TempDir) -> (String, Vec<Frame>) {
    let lesson = write(folder, "short.toml", &short_lesson());
    let to = file(folder, "short.mcap");
    recorded(&lesson, &to);
    let frames = frames(&to);
    (to, frames)
}

/// What readers must find in a recording of a lesson.
#[derive(Default)]
struct Expected {
    /// Number of messages of each channel.
    messages: BTreeMap<String, usize>,
    /// Total number of transforms in `/tf`.
    transforms: usize,
}

impl Expected {
    fn of(frames: &[Frame]) -> Self {
        let of = |topic: TopicId| frames.iter().filter(move |frame| frame.topic == topic);
        let mut messages: BTreeMap<String, usize> = BTreeMap::new();
        for frame in frames {
            *messages.entry(Channel(frame.topic).to_string()).or_default() += 1;
        }
        // 50 of 250 joint frames and of 200 scene frames per second are exported: in simulated time every
        // fifth and every fourth.
        let bodies = of(TopicId::JointStates).step_by(5).count();
        let scenes: Vec<usize> = of(TopicId::Scene)
            .step_by(4)
            .map(|frame| frame.read::<Scene>().expect("a scene").1.len())
            .collect();
        let said = of(TopicId::Utterances).map(|frame| frame.read::<Utterances>().expect("words").1.len());
        let told = of(TopicId::Events).map(|frame| frame.read::<Events>().expect("events").1.len());
        messages.extend(
            [
                ("/joint_states", of(TopicId::JointStates).count()),
                ("/robot_description", 1),
                ("/scene", scenes.len()),
                ("/beliefs/leo", of(TopicId::Beliefs(0)).step_by(4).count()),
                ("/beliefs/the_teacher", of(TopicId::Beliefs(1)).step_by(4).count()),
                ("/tf", bodies + scenes.len()),
                ("/log", said.sum::<usize>() + told.sum::<usize>()),
            ]
            .map(|(topic, count)| (topic.to_owned(), count)),
        );
        let body = config::Robot::load(None).expect("is built in").urdf;
        let links = body.matches("<link name=").count();
        assert!(
            links > 65 && scenes.len() > 100 && messages.values().all(|&count| count > 0),
            "{messages:?}"
        );
        Self { messages, transforms: bodies * links + scenes.iter().sum::<usize>() }
    }
}

/// Opens a recording with generic readers: counts the messages of each topic, decodes the ROS 2 ones, and
/// reads beliefs by their schema.
const PYTHON: &str = r#"
import json, struct, sys
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

counts, decoded, beliefs, metadata, tf, transforms, robot = {}, {}, [], {}, set(), 0, ""
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
            transforms += len(value.transforms)
            tf.update((link.header.frame_id, link.child_frame_id) for link in value.transforms)
        elif channel.topic == "/robot_description":
            robot = value.data
        elif channel.topic == "/log":
            log = [value.level, value.name, value.msg]
        elif channel.topic == "/beliefs/leo":
            cubes = [[mark.scale.x, mark.pose.position.z, mark.color.a] for mark in value.markers if mark.ns == "beliefs"]
assert sum(counts.values()) == statistics.message_count
json.dump({"counts": counts, "decoded": decoded, "beliefs": beliefs, "metadata": metadata, "files": files,
    "joints": joints, "tf": sorted(tf), "transforms": transforms, "robot": len(robot), "log": log, "cubes": cubes}, sys.stdout)
"#;

#[test]
fn generic_mcap_readers_open_a_recording() {
    let Some(python) = venv::interpreter("mcap-ros2-support==0.5.7", "mcap_ros2.decoder") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let script = write(&folder, "read.py", PYTHON);
    let (to, frames) = lesson(&folder);
    let output = run(Command::new(python).args([&script, &to]));
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("is JSON");

    let expected = Expected::of(&frames);
    assert_eq!(found["counts"], serde_json::json!(expected.messages));
    let (leos, others): (BTreeMap<_, _>, BTreeMap<_, _>) =
        expected.messages.iter().partition(|(topic, _)| topic.starts_with("leo/"));
    assert_eq!(leos.len(), 8 + 1, "{leos:?}");
    for (topic, number) in leos {
        let counted = found["metadata"]["leo.counts"][topic].as_str().expect("is counted");
        assert_eq!(counted, format!("{number} written, 0 dropped"));
    }
    // Every message for viewers matches its schema.
    assert_eq!(found["decoded"], serde_json::json!(others));
    assert_eq!(found["transforms"], expected.transforms);
    assert_eq!(found["metadata"]["leo"]["time"], "lockstep");
    assert_eq!(
        found["files"],
        serde_json::json!(["leo.toml", "leo.urdf", "motor.toml", "percepts.toml", "perspective.toml"])
    );
    // Every frame of beliefs, read by its schema only.
    let beliefs = found["beliefs"].as_array().expect("a list");
    let ours: Vec<_> = frames.iter().filter(|frame| frame.topic == TopicId::Beliefs(0)).collect();
    assert!(!ours.is_empty() && beliefs.len() == ours.len(), "{} of {} frames", beliefs.len(), ours.len());
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

/// Reads a truncated recording up to its end and counts the messages of each channel.
const UP_TO_THE_CUT: &str = r#"
import json, sys
from mcap.exceptions import EndOfFile
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader

topics, counts, is_cut = {}, {}, False
with open(sys.argv[1], "rb") as file:
    try:
        for record in StreamReader(file, validate_crcs=True).records:
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message):
                topic = topics[record.channel_id]
                counts[topic] = counts.get(topic, 0) + 1
    except EndOfFile:
        is_cut = True
json.dump({"counts": counts, "is_cut": is_cut}, sys.stdout)
"#;

#[test]
fn a_truncated_recording_is_readable_by_other_tools_too() {
    let Some(python) = venv::interpreter("mcap-ros2-support==0.5.7", "mcap.stream_reader") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let script = write(&folder, "cut.py", UP_TO_THE_CUT);
    let (to, whole) = lesson(&folder);
    let written = fs::metadata(&to).expect("is there").len();
    fs::File::options().write(true).open(&to).expect("opens").set_len(written / 3 * 2).expect("is cut");

    let mut reader = Reader::open(Path::new(&to)).expect("is a recording");
    let frames: Vec<Frame> = reader.by_ref().map(|frame| frame.expect("is whole")).collect();
    assert!(
        reader.is_cut() && frames.len() > whole.len() / 2 && frames.len() < whole.len(),
        "{}",
        frames.len()
    );
    let mut ours: BTreeMap<String, usize> = BTreeMap::new();
    for frame in &frames {
        *ours.entry(Channel(frame.topic).to_string()).or_default() += 1;
    }
    let output = run(Command::new(python).args([&script, &to]));
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("is JSON");
    assert_eq!(found["is_cut"], true);
    let theirs = found["counts"].as_object().expect("counts");
    let (theirs, views): (BTreeMap<_, _>, BTreeMap<_, _>) =
        theirs.iter().partition(|(topic, _)| topic.starts_with("leo/"));
    assert_eq!(serde_json::json!(theirs), serde_json::json!(ours));
    assert!(ours.len() > 5 && views.len() > 5, "{ours:?} {views:?}");
}

/// Counts the non-static rows of each entity that a viewer created from a recording.
const ROWS: &str = r"
import collections, json, sys
from rerun.chunk import RrdReader

rows = collections.Counter()
for chunk in RrdReader(sys.argv[1]).stream():
    if not chunk.is_static:
        rows[str(chunk.entity_path)] += chunk.num_rows
json.dump(rows, sys.stdout)
";

#[test]
fn a_common_viewer_shows_every_message_of_every_channel() {
    let Some(python) = venv::interpreter("rerun-sdk==0.41.0", "rerun.chunk") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let script = write(&folder, "rows.py", ROWS);
    let (to, frames) = lesson(&folder);
    let Expected { mut messages, transforms } = Expected::of(&frames);
    let rerun = |arguments: &[&str]| {
        // The viewer's usage data goes to the temporary folder.
        let mut viewer = Command::new(beside(&python, "rerun"));
        run(viewer.args(arguments).env("HOME", folder.path()).env_remove("XDG_CONFIG_HOME"))
    };

    let checked = String::from_utf8(rerun(&["mcap", "check", &to]).stdout).expect("is text");
    for topic in messages.keys() {
        let is_of_it = |line: &&str| line.split_whitespace().nth(3) == Some(topic);
        let said = checked.lines().find(is_of_it).unwrap_or_else(|| panic!("{topic}\n{checked}"));
        assert!(said.starts_with("ok ") && said.ends_with(" \u{2014}"), "{checked}");
    }

    let shown = file(&folder, "short.rrd");
    rerun(&["mcap", "convert", &to, "--output", &shown]);
    let output = run(Command::new(python).args([&script, &shown]));
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("is JSON");
    // The viewer creates one row for each transform, and plots of the joints.
    messages.insert("/tf".to_owned(), transforms);
    for of in ["position", "velocity", "effort"] {
        messages.insert(format!("/joint_states/{of}"), messages["/joint_states"]);
    }
    let rows: BTreeMap<String, usize> = messages
        .into_iter()
        .map(|(topic, count)| (format!("/{}", topic.trim_start_matches('/')), count))
        .collect();
    assert_eq!(found, serde_json::json!(rows));
}

/// A program of the same virtual environment as its interpreter.
fn beside(python: &Path, program: &str) -> PathBuf {
    python.with_file_name(program)
}

/// Runs a command that must succeed.
fn run(command: &mut Command) -> Output {
    let output = command.output().expect("runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}
