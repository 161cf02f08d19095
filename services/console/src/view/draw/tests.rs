use std::collections::BTreeMap;

use message::{BusHealth, Health, JointMode, ProcessState, Text};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use reports::metrics::Readings;

use super::super::rows::rows;
use super::super::screen::ESCAPE;
use super::*;

/// A robot of two processes, a bus, and a joint in trouble.
fn readings() -> Readings {
    let health = |overruns, wakeup| {
        let mut health = Health::default();
        health.set_state(ProcessState::Running);
        (health.incarnation, health.overruns, health.period_ns) = (1, overruns, 5_000_000);
        health.wakeup.record(wakeup);
        health.latency.record(2 * wakeup);
        health
    };
    let joint = |index, cause| JointState::unread(index, JointMode::Quarantined, cause);
    Readings {
        processes: [(Process::Sensor, health(1, 90_000)), (Process::Motor, health(70, 40_000))].into(),
        buses: vec![BusHealth {
            name: Text::new("torso"),
            lost: 1,
            missed: 9,
            alerts: 2,
            hang_ups: 3,
            ..BusHealth::default()
        }],
        joints: vec![joint(0, JointCause::None), joint(1, JointCause::Silent).with_condition(41.0, 11.5)],
        joint_names: vec!["one".to_owned(), "torso_yaw_joint".to_owned()],
        ..Readings::default()
    }
}

/// The screen on a terminal of 80 columns after some keys.
fn shown(screen: &mut Screen, keys: &[char]) -> Vec<String> {
    for key in keys {
        assert!(screen.press(*key));
    }
    let mut terminal = Terminal::new(TestBackend::new(80, 24)).unwrap();
    terminal.draw(|frame| draw(frame, screen)).unwrap();
    let buffer = terminal.backend().buffer().clone();
    let line = |y| (0..80).map(|x| buffer[(x, y)].symbol()).collect::<String>().trim_end().to_owned();
    (0..24).map(line).collect()
}

fn seen() -> Screen {
    let mut screen = Screen::default();
    let readings = readings();
    let rows = rows(&readings, &BTreeMap::new());
    screen.update(readings, rows);
    screen
}

/// The first words of the rows of the table.
fn order(lines: &[String]) -> Vec<&str> {
    lines[2..4].iter().filter_map(|line| line.split_whitespace().next()).collect()
}

#[test]
fn the_table_fits_and_sorts_by_the_worst() {
    let mut screen = seen();
    let lines = shown(&mut screen, &[]);
    assert!(
        lines[1].starts_with("process   state       Hz wake50 wake99") && lines[1].ends_with("re"),
        "{lines:?}"
    );
    assert_eq!(order(&lines), ["sensor", "motor"]);
    assert!(lines[23].starts_with("q quit") && lines[23].ends_with("help"), "{lines:?}");
    assert_eq!(order(&shown(&mut screen, &['s'])), ["sensor", "motor"], "by wake-up");
    let lines = shown(&mut screen, &['s', 's']);
    assert!(lines[0].contains("age p99") && lines[2].contains(" 180 "), "{lines:?}");
    assert_eq!(order(&lines), ["sensor", "motor"]);
    let lines = shown(&mut screen, &['s']);
    assert!(lines[0].contains("overruns"), "{lines:?}");
    assert_eq!(order(&lines), ["motor", "sensor"]);
    assert_eq!(order(&shown(&mut screen, &['r'])), ["sensor", "motor"]);
}

#[test]
fn a_frozen_screen_is_not_updated() {
    let mut screen = seen();
    assert!(shown(&mut screen, &[' '])[0].contains("FROZEN"));
    screen.update(Readings::default(), Vec::new());
    assert_eq!(order(&shown(&mut screen, &[])), ["sensor", "motor"]);
    shown(&mut screen, &[' ']);
    screen.update(Readings::default(), Vec::new());
    assert!(order(&shown(&mut screen, &[])).is_empty());
}

#[test]
fn the_selected_process_has_its_histogram_wherever_it_is_sorted() {
    let mut screen = seen();
    let lines = shown(&mut screen, &['↓', '↓', 'h']);
    assert!(
        lines[0].contains("motor: wake-up, execution and age") && lines[1].starts_with("wake-up: 1 cycles"),
        "{lines:?}"
    );
    assert!(lines[1].contains("execution: 0 cycles") && lines[1].contains("age: 1 cycles"), "{lines:?}");
    assert!(lines[2].starts_with("<    66 µs █████████ 1"), "{lines:?}");
    let lines = shown(&mut screen, &['s', 's', 's', 's']);
    assert!(lines[0].contains("motor:"), "{lines:?}");
    let lines = shown(&mut screen, &['h', '↑', '↓', 'h']);
    assert!(lines[0].contains("sensor:"), "{lines:?}");
}

#[test]
fn buses_and_joints_in_trouble_have_pages_of_their_own() {
    let mut screen = seen();
    let lines = shown(&mut screen, &['b']);
    assert!(
        lines[2].starts_with("torso") && lines[2].contains("LOST") && lines[2].contains(" 9 "),
        "{lines:?}"
    );
    assert_eq!(lines[3].split_whitespace().collect::<Vec<_>>().join(" "), "torso 2 alerts, 3 hang-ups");
    let lines = shown(&mut screen, &['j']);
    let words: Vec<&str> = lines[2].split_whitespace().collect();
    assert_eq!(words, ["torso_yaw_joint", "quarantined", "silent", "41.0", "11.5"]);
    let should = "  link unknown, power unknown, disarmed: not-started, idle; never read";
    assert_eq!((lines[3].as_str(), lines[4].as_str()), (should, ""), "only those in trouble");
    assert!(lines[0].ends_with("joints in trouble   2 disarmed: not-started"), "{lines:?}");
    let lines = shown(&mut screen, &['?']);
    assert!(lines[1].starts_with("q, Ctrl-C"), "{lines:?}");
    assert_eq!(order(&shown(&mut screen, &[ESCAPE])), ["sensor", "motor"]);
    assert!(!screen.press('q'));
}

#[test]
fn an_ended_robot_and_an_unknown_one_are_drawn() {
    let mut screen = Screen::default();
    screen.is_running = false;
    assert!(shown(&mut screen, &[])[0].contains("ENDED"));
    for key in ['↑', '↓', 'h', 'b', 'j'] {
        shown(&mut screen, &[key]);
    }
}
