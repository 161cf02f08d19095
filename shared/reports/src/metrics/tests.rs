use std::collections::BTreeSet;

use message::{
    BusHealth, Event, EventKind, Health, JointCause, JointMode, JointState, LinkHealth, PerspectiveHealth,
    Process, ProcessState, SourceHealth, Text,
};

use super::*;
use crate::lesson::LessonReport;

/// A robot with all readings.
fn readings() -> Readings {
    let mut health = Health::default();
    health.set_state(ProcessState::Running);
    (health.incarnation, health.period_ns, health.overruns, health.missing_rights) = (3, 5_000_000, 7, 4);
    for nanos in [20_000, 20_000, 70_000, 3_000_000_000] {
        health.wakeup.record(nanos);
    }
    health.execution.record(1);
    health.latency.record(1);
    let mut source = SourceHealth { frames: 12, silent: 1, ..SourceHealth::default() };
    source.name = Text::new("a \"camera\"\\\n");
    let mut bus = BusHealth { name: Text::new("torso"), missed: 5, quarantined: 1, ..BusHealth::default() };
    (bus.alerts, bus.restarts, bus.watchdogs) = (11, 12, 13);
    (bus.refusals, bus.duplicates, bus.hang_ups) = (14, 15, 16);
    bus.exchange.record(1);
    let mut link = LinkHealth { is_up: 1, clock_error_ns: 150_000, overtaken: 8, ..LinkHealth::default() };
    link.delay.record(1);
    let joint = |index| JointState::unread(index, JointMode::Quarantined, JointCause::Silent);
    Readings {
        processes: [(Process::Sensor, health)].into(),
        sources: vec![source],
        buses: vec![bus],
        perspectives: vec![PerspectiveHealth {
            steps: 2,
            beliefs: 20,
            over_capacity: 5,
            ..PerspectiveHealth::default()
        }],
        link: Some(link),
        joints: vec![joint(0), joint(1).with_condition(41.5, 11.9).with_reading(1, -0.5, 0.0, 0.25)],
        joint_locks: 4,
        goals_limited: 5,
        goals_refused: 6,
        read_at_ns: 7,
        joint_names: vec!["torso_yaw_joint".to_owned()],
        tasks: vec![TaskReading {
            name: "task 1".into(),
            examples: 2,
            hypotheses: [("robot".into(), 2)].into(),
        }],
        store_bytes: Some(4096),
    }
}

#[test]
fn readings_are_exported_with_their_labels() {
    let text = openmetrics(&readings());
    for line in [
        "leo_process_running{process=\"sensor\"} 1",
        "leo_process_rate_hertz{process=\"sensor\"} 200",
        "leo_process_restarts_total{process=\"sensor\"} 2",
        "leo_process_overruns_total{process=\"sensor\"} 7",
        "leo_process_missing_right{process=\"sensor\",right=\"memory\"} 1",
        "leo_process_missing_right{process=\"sensor\",right=\"priority\"} 0",
        "leo_wakeup_max_seconds{process=\"sensor\"} 3",
        "leo_wakeup_since_start_seconds_count{process=\"sensor\"} 4",
        "leo_source_silent{source=\"a \\\"camera\\\"\\\\\\n\"} 1",
        "leo_bus_errors_total{bus=\"torso\",error=\"missed\"} 5",
        "leo_bus_quarantined_joints{bus=\"torso\"} 1",
        "leo_bus_incidents_total{bus=\"torso\",incident=\"alert\"} 11",
        "leo_bus_incidents_total{bus=\"torso\",incident=\"restart\"} 12",
        "leo_bus_incidents_total{bus=\"torso\",incident=\"watchdog\"} 13",
        "leo_bus_incidents_total{bus=\"torso\",incident=\"refusal\"} 14",
        "leo_bus_incidents_total{bus=\"torso\",incident=\"duplicate_id\"} 15",
        "leo_bus_incidents_total{bus=\"torso\",incident=\"hang_up\"} 16",
        "leo_link_up 1",
        "leo_link_clock_error_seconds 0.00015",
        "leo_link_overtaken_frames_total 8",
        "leo_link_delay_since_start_seconds_count{direction=\"received\"} 1",
        "leo_joints{mode=\"quarantined\"} 2",
        "leo_joints_with_fault{cause=\"silent\"} 2",
        "leo_joints_by_arming{arming=\"disarmed\"} 2",
        "leo_joints_by_arming{arming=\"armed\"} 0",
        "leo_joints_by_link{link=\"unknown\"} 2",
        "leo_joints_by_power{power=\"unknown\"} 2",
        "leo_joints_by_motion{motion=\"idle\"} 2",
        "leo_joint_locks_total 4",
        "leo_goals_limited_total 5",
        "leo_goals_refused_total 6",
        "leo_joint_fault_info{joint=\"torso_yaw_joint\",link=\"unknown\",power=\"unknown\",arming=\"disarmed\",arming_cause=\"not-started\",motion=\"idle\"} 1",
        "leo_joint_position_radians{joint=\"1\"} -0.5",
        "leo_joint_temperature_celsius{joint=\"1\"} 41.5",
        "leo_task_hypotheses{task=\"task 1\",perspective=\"robot\"} 2",
        "leo_store_bytes 4096",
        "leo_perspective_over_capacity_total{perspective=\"[]\"} 5",
    ] {
        assert!(text.lines().any(|found| found == line), "{line}\n{text}");
    }
    assert!(
        !text.contains("NaN") && !text.contains("_radians{joint=\"torso_yaw_joint\"}"),
        "a joint that was not read has no reading"
    );
}

#[test]
fn each_bucket_counts_exactly_the_values_below_its_bound() {
    let text = openmetrics(&readings());
    let bucket = |le: &str| {
        let start = format!("leo_wakeup_seconds_bucket{{process=\"sensor\",le=\"{le}\"}} ");
        text.lines().find_map(|line| line.strip_prefix(&start)).map(str::to_owned)
    };
    let told =
        ["0.000016384", "0.000032768", "0.000065536", "0.000131072", "0.268435456", "+Inf"].map(bucket);
    let should = ["0", "2", "2", "3", "3", "4"].map(|count| Some(count.to_owned()));
    assert_eq!(told, should, "{text}");
}

#[test]
fn a_robot_without_readable_boards_still_gives_a_page() {
    let text = openmetrics(&Readings::default());
    assert!(text.starts_with("# TYPE leo_build info\n") && text.ends_with("# EOF\n"));
    assert_eq!(text.lines().filter(|line| line.starts_with("# TYPE")).count(), 1, "{text}");
}

#[test]
fn every_family_is_announced_once_and_before_its_samples() {
    let text = openmetrics(&readings());
    let mut seen = Vec::new();
    for line in text.lines() {
        if let Some(name) = line.strip_prefix("# TYPE ").and_then(|rest| rest.split(' ').next()) {
            assert!(!seen.contains(&name), "{name} comes twice");
            seen.push(name);
        } else if !line.starts_with('#') {
            let last = seen.last().expect("announced");
            assert!(line.starts_with(last), "{line} within {last}");
        }
    }
    assert!(seen.len() > 30, "{seen:?}");
}

/// The names of the samples in a text.
fn names(text: &str) -> BTreeSet<&str> {
    let words = text.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_');
    words.filter(|word| word.starts_with("leo_")).collect()
}

#[test]
fn every_dashboard_query_is_exported_and_every_metric_is_documented() {
    let text = openmetrics(&readings());
    let samples: String =
        text.lines().filter(|line| !line.starts_with('#')).map(|line| format!("{line}\n")).collect();
    let told = names(&samples);
    let dashboard: serde_json::Value =
        serde_json::from_str(include_str!("../../../../package/grafana.json")).expect("JSON");
    let panels = dashboard["panels"].as_array().expect("panels");
    let targets = panels.iter().filter_map(|panel| panel["targets"].as_array()).flatten();
    let mut queries = 0;
    for query in targets.map(|target| target["expr"].as_str().expect("a query")) {
        let asked = names(query);
        assert!(!asked.is_empty() && asked.is_subset(&told), "`{query}` asks for what is not told");
        queries += 1;
    }
    assert!(queries > 20, "only {queries} queries were seen");

    let mut manual = names(include_str!("../../../../docs/operations.md"));
    manual.extend(names(include_str!("../../../../docs/more_than_one_machine.md")));
    let families: BTreeSet<&str> =
        text.lines().filter_map(|line| line.strip_prefix("# TYPE ")?.split(' ').next()).collect();
    let unknown: Vec<_> =
        manual.iter().filter(|name| !told.contains(*name) && !families.contains(*name)).collect();
    assert!(unknown.is_empty(), "the manual speaks of {unknown:?}");
    let stems = families.iter().filter(|name| !name.contains("_since_start_") && !name.contains("_max_"));
    let silent: Vec<_> = stems
        .filter(|name| !manual.iter().any(|word| word.strip_suffix("_total").unwrap_or(word) == **name))
        .collect();
    assert!(silent.is_empty(), "the manual does not speak of {silent:?}");
}

#[test]
fn hypotheses_are_counted_by_task_and_perspective() {
    let mut report = LessonReport::default();
    report.add(&Event { examples: 2, ..Event::new(EventKind::DemonstrationEnded, "task 1", "") });
    for perspective in [0, 0, 1] {
        report.add(&Event { perspective, ..Event::new(EventKind::Hypothesis, "task 1", "all") });
    }
    let read = TaskReading::all(&report);
    assert_eq!((read.len(), read[0].name.as_str(), read[0].examples), (1, "task 1", 2));
    assert_eq!(read[0].hypotheses, [("human".to_owned(), 1), ("robot".to_owned(), 2)].into());
}
