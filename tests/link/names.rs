//! Several robots in one network, each with its remote machine.

use std::path::Path;

use crate::machine::{Machine, wait_until};
use crate::{Side, alone, free_port, keys_or_skip};

/// A robot with its remote machine, and the task that it is taught.
struct Pair {
    robot: Machine,
    away: Machine,
    task: &'static str,
}

impl Pair {
    fn has_learned(&self) -> bool {
        self.away.stdout().contains(&format!("2 examples of {} so far", self.task))
    }
}

#[test]
fn two_robots_of_one_network_connect_only_to_their_own_machines() {
    let _alone = alone();
    let Some(keys) = keys_or_skip("DNS:localhost") else { return };
    let ports = [free_port(), free_port()];
    // Each machine can reach both robots and has keys for both; only the robot's name distinguishes them.
    let everybody = ports.map(|port| format!("\"quic/localhost:{port}\"")).join(", ");
    let everybody = format!("[{everybody}]");
    let pair = |name: &str, port, lesson, task| {
        let named = |side: Side, key| side.keyed(keys.path(), key).with("robot", &format!("\"{name}\""));
        let away = named(Side::remote("quic/localhost:1"), "remote").with("connect", &everybody);
        let robot = named(Side::robot(&format!("quic/127.0.0.1:{port}")), "robot");
        let lesson = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/lessons").join(lesson);
        let lesson = ["--lesson", lesson.to_str().expect("is text")];
        let away = Machine::start(None, &format!("link-{name}-away"), &away.changes());
        let robot = Machine::start_with(None, &format!("link-{name}"), &robot.changes(), &lesson);
        Pair { robot: robot.when_ready(), away: away.when_ready(), task }
    };
    let [first, second] = ports;
    let mut pairs = [pair("ada", first, "task1.toml", "task 1"), pair("bea", second, "task2.toml", "task 2")];

    for pair in &pairs {
        let Pair { robot, away, .. } = pair;
        assert!(wait_until(|| pair.has_learned()), "{}\n{}\n{}", away.stdout(), away.said(), robot.said());
    }
    for pair in &pairs {
        let said = format!("{}\nThe other machine:\n{}", pair.robot.said(), pair.away.said());
        for machine in [&pair.robot, &pair.away] {
            assert_eq!(machine.count("leo_link_up"), 1, "{said}");
            // No message of another robot even arrived.
            assert_eq!(machine.count("leo_link_refused_total"), 0, "{said}");
            assert_eq!(machine.count("leo_link_sessions_total"), 1, "{said}");
            assert!(!machine.said().contains("a second machine claims"), "{said}");
        }
    }
    let [ada, bea] = &pairs;
    for (pair, other) in [(ada, bea), (bea, ada)] {
        assert!(!pair.away.stdout().contains(other.task), "{}", pair.away.stdout());
    }
    for pair in &mut pairs {
        for machine in [&mut pair.away, &mut pair.robot] {
            let (status, said) = machine.stop();
            assert!(status.success(), "{status}\n{said}");
        }
        let learned = pair.away.learned();
        assert_eq!(learned.keys().collect::<Vec<_>>(), [pair.task], "{learned:?}");
    }
}
