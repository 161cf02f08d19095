//! What a document tells its reader to do between two commands, or takes for granted.

use super::documents::blocks;
use super::session::Session;
use super::trial::Trial;
use crate::harness::read;

/// The mock servo bus as the documents name it, and what its name begins with.
const MOCK_BUS: [&str; 2] = ["/tmp/leo-mock-bus-XXXXXX", "/tmp/leo-mock-bus-"];
/// The table of the simulator in `leo.toml`.
const SIMULATOR: &str = "[[sensor.source]]\nname = \"simulator\"\nkind = \"simulator\"\n";

/// Adds the buses of the tutorial, its only TOML block.
pub(super) fn add_buses(session: &mut Session) {
    let blocks = blocks(&read("docs/tutorials/robot_engineer.md"));
    let buses = blocks.iter().find(|block| block.language == "toml").expect("the buses");
    session.append("bench/motor.toml", &format!("\n{}", buses.text));
}

/// Finds out where the mock servo buses are.
pub(super) fn name_mock_bus(session: &mut Session) {
    let [example, prefix] = MOCK_BUS;
    let said = session.said();
    let name = said.split(prefix).nth(1).and_then(|rest| rest.split('/').next()).expect("a path");
    session.rename(example, format!("{prefix}{name}"));
}

/// Writes the paths of the two buses into the configuration.
pub(super) fn name_devices(session: &mut Session) {
    for bus in ["bench_neck", "bench_eye"] {
        let named = |device: &str| format!("name = \"{bus}\"\ndevice = \"{device}\"");
        let device = session.named(&format!("{}/bus-{bus}", MOCK_BUS[0]));
        session.edit("bench/motor.toml", &named("mock"), &named(&device));
    }
}

/// Makes the trace the only source of the robot.
pub(super) fn play_the_trace(session: &mut Session) {
    let source = "[[sensor.source]]\nname = \"recorded\"\nkind = \"trace\"\nfile = \"traces/lamp.jsonl\"\n";
    assert!(read("docs/tutorials/source_writer.md").contains(source), "the document has another source");
    session.edit("played/leo.toml", SIMULATOR, source);
}

/// Adds the second source behind the simulator.
pub(super) fn add_camera(session: &mut Session) {
    let source = "[[sensor.source]]\nname = \"camera\"\nkind = \"external\"\nrate_hz = 30.0\n";
    assert!(read("docs/tutorials/source_writer.md").contains(source), "the document has another source");
    session.edit("camera/leo.toml", SIMULATOR, &format!("{SIMULATOR}\n{source}"));
}

/// Starts the robot that the document takes for granted, and names it to its observers: other robots may run here, and
/// other programs may have the port.
pub(super) fn start_a_robot(session: &mut Session) {
    let domain = format!("/dev/shm/leo-recorded-{}", std::process::id());
    session.run(&format!("leo run --stay --domain {domain}"), &Trial::Stays("I can teach you to do task 1"));
    for (line, more) in [("leo record --black-box", ""), ("leo view", " --listen 127.0.0.1:0")] {
        session.rename(line, format!("{line}{more} --domain {domain}"));
    }
}

/// Writes a trace for the truth of the document, and one pedestrian as the MOT Challenge writes it.
pub(super) fn write_detections(session: &mut Session) {
    let trace = "{\"leo_trace\": 1}\n\
        {\"at_ns\": 0, \"observations\": [{\"position_m\": [0.6, 0.1, 0.03]}, {\"position_m\": [0.6, -0.2, 0.03]}]}\n\
        {\"at_ns\": 100000000, \"observations\": []}\n";
    session.write("trace.jsonl", trace);
    session.write("gt.txt", "1,1,10,20,30,40,1,1,1\n");
    session.write("det.txt", "1,-1,10,20,30,40,0.9,-1,-1,-1\n");
}

/// Writes the trace that stands for the reader's own.
pub(super) fn write_trace(session: &mut Session) {
    session.write("trace.jsonl", &read("config/traces/moved.jsonl"));
}

/// The cone of the teacher is narrower.
pub(super) fn expect_narrow_cone(session: &mut Session) {
    session.expect_in("narrow/perspective.toml", "\ncone_half_angle_deg = 20.0");
}
