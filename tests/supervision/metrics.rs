//! The metrics of a running robot, checked with a parser of another project.

use std::io::Write as _;
use std::process::{Command, Stdio};

use crate::robot::{PROCESSES, Robot, leo, wait_until};
use crate::venv;

/// The strict reference parser of the format. It raises on a malformed line, and prints the numbers of
/// families and samples and some samples.
const PARSE: &str = "
import sys
from prometheus_client.openmetrics.parser import text_string_to_metric_families as parse
families = list(parse(sys.stdin.read()))
print(len(families), sum(len(family.samples) for family in families))
for family in families:
    for sample in family.samples:
        if sample.name == 'leo_process_running' or sample.name == 'leo_bus_joints':
            print(sample.name, *sample.labels.values(), sample.value)
";

fn openmetrics(robot: &Robot) -> String {
    let output = leo(&["top", "--openmetrics", "--domain"]).arg(robot.domain()).output().expect("runs");
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn metrics_of_a_running_robot_are_in_the_format_to_the_letter() {
    let Some(python) = venv::interpreter("prometheus-client==0.24.1", "prometheus_client") else { return };
    let robot = Robot::ready("metrics", &[]);
    let mut text = String::new();
    // All joints were read, and every process has completed cycles.
    let complete = wait_until(|| {
        text = openmetrics(&robot);
        text.matches("leo_joint_temperature_celsius{").count() == 65
            && text.matches("leo_execution_since_start_seconds_count{").count() == PROCESSES.len()
    });
    assert!(complete, "{text}\n{}", robot.said());
    let mut parser = Command::new(python)
        .args(["-c", PARSE])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("starts");
    parser.stdin.take().expect("piped").write_all(text.as_bytes()).expect("takes it");
    let parsed = parser.wait_with_output().expect("ends");
    assert!(parsed.status.success(), "the parser refuses it\n{text}");
    let said = String::from_utf8_lossy(&parsed.stdout);
    let mut lines = said.lines();
    let counts: Vec<usize> =
        lines.next().unwrap_or_default().split(' ').filter_map(|count| count.parse().ok()).collect();
    assert!(matches!(counts[..], [families, samples] if families > 40 && samples > 400), "{counts:?}");
    let mut lines: Vec<&str> = lines.collect();
    lines.sort_unstable();
    let joints: f64 = lines
        .iter()
        .filter(|line| line.starts_with("leo_bus_joints"))
        .filter_map(|line| line.rsplit(' ').next()?.parse::<f64>().ok())
        .sum();
    assert!((joints - 65.0).abs() < 0.5, "{lines:?}");
    let running: Vec<&str> = lines
        .iter()
        .filter_map(|line| line.strip_prefix("leo_process_running ")?.strip_suffix(" 1"))
        .collect();
    assert_eq!(running, PROCESSES, "{said}");
    assert!(text.contains("{joint=\"torso_yaw_joint\"}"), "{text}");
    robot.stop(rustix::process::Signal::TERM);
}
