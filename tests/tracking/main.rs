//! `leo evaluate` over synthetic scenes, and its measures beside those of TrackEval and motmetrics.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "a test fails by panicking")]

mod refusals;
mod scenes;
#[path = "../sources/venv.rs"]
mod venv;

use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use tempfile::TempDir;

use scenes::{Files, PERFECT, SCENES};

/// Two programs compute in another order.
const TOLERANCE: f64 = 1e-6;
/// The cut-off of the scene on a table, in metres.
const CUT_OFF_M: f64 = 0.1;

/// Output and exit status of `leo evaluate`.
#[derive(Debug)]
struct Evaluated {
    status: Option<i32>,
    out: String,
    err: String,
}

fn evaluate(arguments: &[&str]) -> Evaluated {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leo"));
    command.arg("evaluate").args(arguments).env_clear().stdin(Stdio::null());
    let output = command.output().expect("runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("is text");
    Evaluated { status: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

/// The JSON document of a successful evaluation.
fn document(arguments: &[&str]) -> Value {
    let output = evaluate(&[arguments, &["--json"]].concat());
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    serde_json::from_str(&output.out).expect("is JSON")
}

/// A folder with files in it.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn file(&self, name: &str) -> String {
        self.0.path().join(name).display().to_string()
    }

    fn write(&self, name: &str, text: &str) -> String {
        fs::write(self.file(name), text).expect("writes");
        self.file(name)
    }

    /// The truth and the detections of a scene.
    fn scene(&self, files: &Files) -> [String; 2] {
        [self.write("gt.txt", &files.truth), self.write("det.txt", &files.detections)]
    }
}

/// Identities and numbers of each frame in a CSV of the MOT Challenge.
fn rows(text: &str) -> BTreeMap<u64, Vec<Value>> {
    let mut frames: BTreeMap<u64, Vec<Value>> = BTreeMap::new();
    for line in text.lines() {
        let columns: Vec<f64> = line.split(',').map(|column| column.parse().expect("a number")).collect();
        let [frame, id] = [0, 1].map(|column: usize| {
            columns
                .get(column)
                .and_then(|number| format!("{number}").parse::<u64>().ok())
                .expect("a whole number")
        });
        frames.entry(frame).or_default().push(json!([id, columns.get(2..6).expect("a box")]));
    }
    frames
}

/// A scene evaluated by Leo: its document, and the sequence for the other programs.
fn scene_in_pixels(files: &Files) -> (Value, Value) {
    let folder = Folder::new();
    let [truth, detections] = folder.scene(files);
    let saved = folder.file("hypotheses.txt");
    let document = document(&[
        "--truth",
        &truth,
        "--detections",
        &detections,
        "--frame-rate",
        "25",
        "--announce-after",
        "1",
        "--save-hypotheses",
        &saved,
    ]);
    let (mut objects, mut hypotheses) =
        (rows(&files.truth), rows(&fs::read_to_string(&saved).expect("is written")));
    let last = *objects.last_key_value().expect("frames").0;
    let frame = |frame| {
        let of = |frames: &mut BTreeMap<u64, Vec<Value>>| frames.remove(&frame).unwrap_or_default();
        json!({ "objects": of(&mut objects), "hypotheses": of(&mut hypotheses) })
    };
    let frames: Vec<Value> = (1..=last).map(frame).collect();
    let sequence = json!({ "frames": frames, "cut_off_m": null });
    (document["perspectives"][0].clone(), sequence)
}

/// Blocks on a table, and a partner that looks away in the middle third: the truth and the trace. One block is moved all
/// the time, and another one while the partner looks away.
fn table() -> [String; 2] {
    let mut truth = String::from("{\"leo_truth\": 1, \"title\": \"a table\"}\n");
    let mut trace = String::from("{\"leo_trace\": 1}\n");
    for frame in 0..30_u32 {
        let is_turned = (10..20).contains(&frame);
        let moved = f64::from(frame.clamp(10, 14) - 10) * 0.02;
        let (at_ns, time) = (frame * 100_000_000, f64::from(frame));
        let blocks = [[0.6, -0.4 + 0.01 * time, 0.03], [0.6 + moved, 0.3, 0.03], [0.8, 0.0, 0.03]];
        let seen_by: &[u16] = if is_turned { &[0] } else { &[0, 1] };
        let objects = (1..).zip(blocks).map(|(id, position_m): (u32, [f64; 3])| {
            json!({ "id": id, "position_m": position_m, "seen_by": seen_by })
        });
        let frame_of_truth = json!({ "at_ns": at_ns, "objects": objects.collect::<Vec<_>>() });
        truth += &format!("{frame_of_truth}\n");
        let look = if is_turned { [0, 0, 0, 1] } else { [0, 0, 1, 0] };
        let person = json!({
            "kind": "person", "partner": 1, "position_m": [1.5, 0.0, 0.55], "orientation_xyzw": look,
        });
        // A camera that is 2 mm off to either side.
        let error = if frame.is_multiple_of(2) { 0.002 } else { -0.002 };
        let seen = blocks.map(|[x, y, z]| json!({ "position_m": [x + error, y - error, z] }));
        let observations: Vec<Value> = std::iter::once(person).chain(seen).collect();
        trace += &format!("{}\n", json!({ "at_ns": at_ns, "observations": observations }));
    }
    [truth, trace]
}

/// The table evaluated by Leo: for each of two perspectives its document, and its sequence for the other programs.
fn table_in_metres() -> Vec<(Value, Value)> {
    let folder = Folder::new();
    let [truth_text, trace_text] = table();
    let (truth, trace) = (folder.write("truth.jsonl", &truth_text), folder.write("trace.jsonl", &trace_text));
    let saved = folder.file("hypotheses.jsonl");
    let cut_off = CUT_OFF_M.to_string();
    let document = document(&["--truth", &truth, &trace, "--cut-off", &cut_off, "--save-hypotheses", &saved]);
    let parse = |text: &str| -> Vec<Value> {
        text.lines().skip(1).map(|line| serde_json::from_str(line).expect("is JSON")).collect()
    };
    let (truths, hypotheses) = (parse(&truth_text), parse(&fs::read_to_string(&saved).expect("is written")));
    let instance = |of: &Value| json!([of["id"], of["position_m"]]);
    let list = |of: &Value| of.as_array().expect("a list").clone();
    let of_agent = |agent: u64| {
        let frames = truths.iter().map(|frame| {
            let is_seen = |object: &Value| list(&object["seen_by"]).contains(&json!(agent));
            let objects = list(&frame["objects"]);
            let objects: Vec<Value> = objects.iter().filter(|object| is_seen(object)).map(instance).collect();
            let beliefs = hypotheses
                .iter()
                .find(|line| line["at_ns"] == frame["at_ns"] && line["perspective"] == agent)
                .map(|line| list(&line["hypotheses"]).iter().map(instance).collect::<Vec<_>>());
            json!({ "objects": objects, "hypotheses": beliefs.expect("a line of each frame") })
        });
        json!({ "frames": frames.collect::<Vec<_>>(), "cut_off_m": CUT_OFF_M })
    };
    let perspectives = document["perspectives"].as_array().expect("a list").clone();
    assert_eq!(perspectives.len(), 2, "{document}");
    perspectives.into_iter().zip([0, 1].map(of_agent)).collect()
}

/// Every sequence with a name: Leo's document, and the input of the other programs.
fn sequences() -> Vec<(String, Value, Value)> {
    let scenes = SCENES.iter().map(|scene| {
        let (document, sequence) = scene_in_pixels(&scene.files());
        (scene.name.to_owned(), document, sequence)
    });
    let table = table_in_metres().into_iter().enumerate();
    let table =
        table.map(|(agent, (document, sequence))| (format!("table, agent {agent}"), document, sequence));
    scenes.chain(table).collect()
}

/// The measures of the sequences by another program.
fn reference(python: &PathBuf, tool: &str, sequences: &[(String, Value, Value)]) -> Vec<Value> {
    let input: Vec<&Value> = sequences.iter().map(|(_, _, sequence)| sequence).collect();
    let input = serde_json::to_vec(&input).expect("is written");
    let mut command = Command::new(python);
    command.args(["-W", "ignore", "-c", include_str!("reference.py"), tool]);
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    let mut stdin = child.stdin.take().expect("is piped");
    let feed = std::thread::spawn(move || {
        // A program that fails does not read to the end.
        let _ = stdin.write_all(&input);
    });
    let output = child.wait_with_output().expect("ends");
    feed.join().expect("is fed");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    // A program may print before its result.
    let text = String::from_utf8(output.stdout).expect("is text");
    serde_json::from_str(text.lines().last().expect("a line")).expect("is JSON")
}

/// Compares every measure of every sequence that the other program has. Returns how many there are.
fn compare(sequences: &[(String, Value, Value)], reference: &[Value]) -> usize {
    let (mut compared, mut differing) = (0, Vec::new());
    for ((name, ours, _), theirs) in sequences.iter().zip(reference) {
        for (group, measures) in theirs.as_object().expect("groups") {
            for (measure, expected) in measures.as_object().expect("measures") {
                let expected = expected.as_f64().expect("a number");
                let measured = ours[group][measure].as_f64().unwrap_or(f64::NAN);
                compared += 1;
                // NaN fails the comparison.
                let is_equal = (measured - expected).abs() <= TOLERANCE;
                if !is_equal {
                    differing.push(format!("{name}: {group}.{measure} is {measured}, and theirs {expected}"));
                }
            }
        }
    }
    assert!(differing.is_empty(), "{}", differing.join("\n"));
    compared
}

#[test]
fn the_measures_equal_those_of_trackeval() {
    let Some(python) = venv::interpreter("trackeval==1.3.0", "trackeval") else { return };
    let sequences = sequences();
    let reference = reference(&python, "trackeval", &sequences);
    assert_eq!(compare(&sequences, &reference), sequences.len() * 22);
}

#[test]
fn the_measures_equal_those_of_motmetrics() {
    let Some(python) = venv::interpreter("motmetrics==1.4.0", "motmetrics") else { return };
    let sequences = sequences();
    let reference = reference(&python, "motmetrics", &sequences);
    assert_eq!(compare(&sequences, &reference), sequences.len() * 17);
}

#[test]
fn a_perfect_detector_gives_perfect_detection_measures() {
    let (measures, _) = scene_in_pixels(&PERFECT.files());
    let clear = &measures["clear_mot"];
    assert_eq!(
        (clear["misses"].as_u64(), clear["false_positives"].as_u64()),
        (Some(0), Some(0)),
        "{measures}"
    );
    assert_eq!(measures["object_instances"], measures["hypothesis_instances"]);
}

#[test]
fn a_scene_is_reproducible_and_errors_of_the_detector_count() {
    let mut misses = BTreeMap::new();
    for scene in SCENES {
        let [files, again] = [scene.files(), scene.files()];
        assert_eq!((&files.truth, &files.detections), (&again.truth, &again.detections), "{}", scene.name);
        let (measures, _) = scene_in_pixels(&files);
        let of = |count: &str| measures["clear_mot"][count].as_u64().expect("a count");
        misses.insert(scene.name, (of("misses"), of("false_positives")));
    }
    assert!(misses["misses"].0 > 10 && misses["occlusion"].0 > 10 && misses["crowd"].0 > 10, "{misses:?}");
    assert!(misses["false detections"].1 > 10 && misses["crowd"].1 > 10, "{misses:?}");
}

#[test]
fn each_perspective_is_compared_with_what_its_agent_sees() {
    let [(robot, _), (partner, _)]: [(Value, Value); 2] =
        table_in_metres().try_into().expect("two perspectives");
    for (measures, instances) in [(&robot, 90), (&partner, 60)] {
        let clear = &measures["clear_mot"];
        assert_eq!(measures["object_instances"], instances, "{measures}");
        assert_eq!((&clear["misses"], &clear["false_positives"]), (&json!(0), &json!(0)), "{measures}");
        assert!(clear["motp_m"].as_f64().is_some_and(|motp_m| motp_m < 0.02), "{measures}");
    }
}

#[test]
fn remembered_beliefs_are_compared_with_objects_seen_before() {
    let folder = Folder::new();
    let [truth, trace] = table();
    let (truth, trace) = (folder.write("truth.jsonl", &truth), folder.write("trace.jsonl", &trace));
    let remembered = document(&["--truth", &truth, &trace, "--cut-off", "0.05", "--remembered"]);
    let [robot, partner] = [0, 1].map(|index: usize| remembered["perspectives"][index].clone());
    assert_eq!((&robot["object_instances"], &partner["object_instances"]), (&json!(90), &json!(90)));
    assert_eq!(robot["clear_mot"]["misses"], json!(0), "{robot}");
    // The partner remembers where the two blocks were that are moved behind their back.
    let misses = partner["clear_mot"]["misses"].as_u64().expect("a count");
    assert!((5..=20).contains(&misses), "{partner}");
    assert_eq!(partner["clear_mot"]["misses"], partner["clear_mot"]["false_positives"], "{partner}");
}

#[test]
fn the_saved_trace_gives_the_same_measures() {
    let folder = Folder::new();
    let scene = SCENES.last().expect("a scene");
    let [truth, detections] = folder.scene(&scene.files());
    let saved = folder.file("trace.jsonl");
    let arguments = ["--truth", &truth, "--frame-rate", "25", "--pixel", "0.01"];
    let from_detections =
        document(&[&arguments[..], &["--detections", &detections, "--save-trace", &saved]].concat());
    // What is announced when depends on whether there are detections, unless it is said.
    let from_trace = document(&[&arguments[..], &[&saved, "--announce-after", "3"]].concat());
    assert_eq!(from_trace, from_detections);
    assert!(from_trace["perspectives"][0]["clear_mot"]["matches"].as_u64() > Some(100), "{from_trace}");
}
