//! A remote console, with the learner on the robot.

use rustix::process::{Signal, kill_process};

use crate::machine::{Machine, wait_until};
use crate::{Side, alone, free_port, keys_or_skip};

/// What a console prints when earlier learned tasks are replayed to it.
const REMEMBERS: &str = "remembers task 1: 2 examples";

#[test]
fn a_restarted_remote_console_gets_the_learned_tasks() {
    let _alone = alone();
    let Some(keys) = keys_or_skip("DNS:localhost") else { return };
    let port = free_port();
    let console = |side: Side| side.with("remote_processes", "[\"console\"]");
    let away = console(Side::remote(&format!("quic/localhost:{port}")).keyed(keys.path(), "remote"));
    let away = Machine::ready(None, "link-ears", &away.changes());
    let robot = console(Side::robot(&format!("quic/127.0.0.1:{port}")).keyed(keys.path(), "robot"));
    let robot = Machine::ready(None, "link-mind", &robot.changes());
    assert!(robot.process("learner").is_some() && robot.process("console").is_none());
    assert!(away.process("learner").is_none() && away.process("console").is_some());
    assert!(wait_until(|| away.stdout().contains("2 examples of task 1 so far")), "{}", away.stdout());
    // The console received these events live, without a replay.
    assert_eq!(away.stdout().matches("remembers task").count(), 0, "{}", away.stdout());

    let learner = robot.process("learner");
    for times in 1..=2 {
        let console = away.process("console").expect("lives");
        kill_process(console, Signal::KILL).expect("lives");
        assert!(
            wait_until(|| away.stdout().matches(REMEMBERS).count() == times),
            "{times}\n{}\n{}",
            away.stdout(),
            robot.said()
        );
        assert_ne!(away.process("console"), Some(console));
    }
    // No other process had to restart for it.
    assert_eq!(robot.process("learner"), learner);
    assert_eq!(away.count("leo_link_sessions_total"), 1, "{}", away.said());
}
