//! What programs of others find in a recording.

use std::fs;
use std::path::Path;
use std::process::Command;

use recording::Buffer;

use crate::house::{short_lesson, write};
use crate::recordings::{file, frames, recorded};

#[path = "../sources/venv.rs"]
mod venv;

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
