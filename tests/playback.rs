//! A trace as a source of a running robot: its beliefs match `leo believe`.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "a test fails by panicking")]

#[path = "supervision/robot.rs"]
#[expect(dead_code, reason = "the tests of the supervisor use the rest")]
mod robot;

use belief::percepts::Percepts;
use message::{Difference, Divergences, Feature};
use rustix::process::Signal;
use serde_json::Value;
use transport::{Domain, Node, OverflowPolicy, Queues};

use robot::{Robot, left_behind, leo, wait_until};

/// A block is moved and a button pressed while the partner looks away.
const MOVED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/config/traces/moved.jsonl");
/// As in `leo.toml`: all ports of a domain have the same queues.
const QUEUES: Queues = Queues { frames: 4, overflow_policy: OverflowPolicy::DropOldest };

/// The differences between partner 1 and the robot at one instant, as text: identities, percept, and both
/// features.
type State = Vec<String>;

/// A feature as text; numbers in full precision.
fn feature(feature: Option<Feature>) -> String {
    match feature {
        Some(Feature::Vector([x, y, z])) => format!("{x:?} {y:?} {z:?}"),
        Some(Feature::Number(number)) => format!("{number:?}"),
        None | Some(Feature::None | Feature::Symbol(_) | Feature::Orientation(_)) => format!("{feature:?}"),
    }
}

/// As [`feature`], from JSON.
fn written(feature: &Value) -> String {
    // Converted to single precision, as in the robot.
    let single = |number: &Value| format!("{number}").parse::<f32>().map(|number| format!("{number:?}"));
    match feature {
        Value::Array(numbers) => {
            numbers.iter().map(|number| single(number).expect("a number")).collect::<Vec<_>>().join(" ")
        }
        Value::Number(_) => single(feature).expect("a number"),
        Value::Null | Value::Bool(_) | Value::String(_) | Value::Object(_) => feature.to_string(),
    }
}

fn push_new(states: &mut Vec<State>, mut state: State) {
    state.sort();
    if states.last() != Some(&state) {
        states.push(state);
    }
}

/// The successive states that `leo believe` reports.
fn output() -> Vec<State> {
    let output = leo(&["believe", MOVED, "--json"]).output().expect("runs");
    let lines = String::from_utf8(output.stdout).expect("is text");
    let (mut states, mut state, mut at) = (Vec::new(), State::new(), None);
    for line in lines.lines() {
        let line: Value = serde_json::from_str(line).expect("is JSON");
        if line["at_ns"] != Value::Null && at.replace(line["at_ns"].clone()) != Some(line["at_ns"].clone()) {
            push_new(&mut states, std::mem::take(&mut state));
        }
        if line["record"] == "difference" {
            let who = format!("{} {}", line["robot_id"], line["partner_id"]);
            let about = line["percepts"].as_object().expect("a map");
            state.extend(about.iter().map(|(percept, is)| {
                format!("{who} {percept}: {}, {}", written(&is["robot"]), written(&is["partner"]))
            }));
        }
    }
    push_new(&mut states, state);
    states
}

/// The same state, as the belief process publishes it.
fn published(differences: &[Difference], percepts: &Percepts) -> State {
    let id = |id: Option<u64>| id.map_or("null".to_owned(), |id| id.to_string());
    let tell = |difference: &Difference| {
        let who = format!("{} {}", id(difference.one()), id(difference.other()));
        let about = difference.aspects().iter().map(move |aspect| {
            let percept = percepts.percepts.get(usize::from(aspect.percept)).expect("configured");
            format!("{who} {}: {}, {}", percept.name, feature(aspect.one()), feature(aspect.other()))
        });
        about.collect::<Vec<_>>()
    };
    differences.iter().flat_map(tell).collect()
}

#[test]
fn a_running_robot_and_leo_believe_agree_about_a_trace() {
    let output = output();
    assert!(output.len() > 10 && output.last() == Some(&State::new()), "{output:#?}");
    let percepts = Percepts::builtin();
    let robot = Robot::ready("playback", &[("kind", &format!("\"trace\"\nfile = {MOVED:?}"))]);
    let domain = Domain::at(robot.domain()).expect("a domain");
    let node = Node::join(&domain, "observer", 1, QUEUES).expect("joins");
    let mut differences = node.subscriber::<Divergences>(Some(1)).expect("a free reader");

    // A late or slow reader may miss states, but sees no others.
    let mut seen: Vec<State> = Vec::new();
    let over = wait_until(|| {
        while let Some(frame) = differences.receive().expect("works") {
            push_new(&mut seen, published(frame.entries(), &percepts));
        }
        let last = robot.rows().iter().find(|row| row["process"] == "sensor").cloned().unwrap_or_default();
        last["sources"][0]["frames"] == 29 && seen.last() == Some(&State::new()) && seen.len() > 1
    });
    assert!(over, "{seen:#?}\n{}", robot.said());
    let mut expected = output.iter();
    for state in &seen {
        assert!(expected.any(|output| output == state), "{state:?}\nof {seen:#?}\nis not in {output:#?}");
    }
    assert!(seen.len() > output.len() / 2, "{seen:#?}");
    assert!(wait_until(|| robot.said().contains("the trace has ended")), "{}", robot.said());

    drop((differences, node));
    let domain = robot.domain().to_owned();
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{status}\n{said}");
    assert_eq!(left_behind(&domain), [""; 0]);
}
