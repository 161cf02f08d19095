//! A misbehaving external source, with real processes.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod garbage;
#[path = "../supervision/robot.rs"]
#[expect(dead_code, reason = "the tests of the supervisor use the rest")]
mod robot;

use clock::Duration;
use message::{Belief, Beliefs, EventKind, Events, Feature, Loss, Observations};
use rustix::process::Signal;
use transport::{Domain, Node, OverflowPolicy, Queues};

use garbage::Garbage;
use robot::{Robot, pause, wait_until};

/// As in `leo.toml`: queues and frame capacity of a domain.
const QUEUES: Queues = Queues { frames: 4, overflow_policy: OverflowPolicy::DropOldest };
const CAPACITY: usize = 64;
/// Number of the position percept in `percepts.toml`.
const POSITION: u16 = 0;

fn place(belief: &Belief) -> Option<[f32; 3]> {
    match belief.percept(POSITION)?.feature()? {
        Feature::Vector(place) => Some(place),
        Feature::None | Feature::Symbol(_) | Feature::Number(_) | Feature::Orientation(_) => None,
    }
}

/// The sensor process's row of `leo top`.
fn sensor(robot: &Robot) -> serde_json::Value {
    robot.rows().into_iter().find(|row| row["process"] == "sensor").unwrap_or_default()
}

#[test]
fn a_garbage_flood_leaves_lesson_and_beliefs_intact() {
    let liar = "name = \"liar\"\nkind = \"external\"\nrate_hz = 1000.0";
    let robot = Robot::ready("liar", &[("[[sensor.source]]", liar)]);
    let domain = Domain::at(robot.domain()).expect("a domain");
    let node = Node::join(&domain, "liar", 1, QUEUES).expect("joins");
    let mut events = node.subscriber::<Events>(None).expect("a free reader");
    let mut beliefs = [0, 1].map(|number| node.subscriber::<Beliefs>(Some(number)).expect("a free reader"));
    let mut publisher = node.publisher::<Observations>(Some(1), 10 * CAPACITY).expect("a free writer");

    let mut garbage = Garbage::new(clock::now());
    let (mut result, mut sent, mut frames, mut believed) = (None, 0, 0, 0);
    let mut patience = 3;
    while result.is_none() && patience > 0 {
        patience -= i32::from(!wait_until(|| {
            // Bursts of more frames than the queue holds, with a short pause because the robot shares the
            // machine.
            for _burst in 0..3 {
                for _frame in 0..6 {
                    sent += u64::from(garbage.send(&mut publisher, clock::now()));
                }
                pause(Duration::from_millis(2));
            }
            while let Some(frame) = events.receive().expect("works") {
                let ended =
                    frame.entries().iter().find(|event| event.kind() == Some(EventKind::PerformanceEnded));
                result = result.take().or(ended.map(|event| event.text.as_str().to_owned()));
            }
            for subscriber in &mut beliefs {
                while let Some(frame) = subscriber.receive().expect("works") {
                    frames += 1;
                    assert!(frame.entries().len() <= CAPACITY);
                    believed += frame.entries().iter().map(assert_sound).count();
                }
            }
            result.is_some()
        }));
    }
    assert_eq!(result.as_deref(), Some("filled 5 of 5"), "{}", robot.said());
    assert!(
        sent > 1000 && frames > 1000 && believed > 10_000,
        "{sent} lies, {frames} frames, {believed} beliefs"
    );

    // Everything was counted by reason and reported once.
    let row = sensor(&robot);
    for loss in Loss::ALL.iter().filter(|loss| **loss != Loss::Unreadable) {
        assert!(row["sources"][1]["losses"][loss.name()].as_u64() > Some(0), "{}: {row}", loss.name());
    }
    let drops = ["overtaken", "missed"].map(|drop| row["sources"][0]["losses"][drop].as_u64().unwrap_or(0));
    let lost = row["sources"][0]["losses"].as_object().map_or(0, serde_json::Map::len);
    assert_eq!(lost, drops.iter().filter(|count| **count > 0).count(), "the simulator suffered: {row}");
    assert_eq!((&row["restarts"], &row["state"]), (&0.into(), &"running".into()), "{row}");
    assert_eq!(robot.said().matches("`position_m` must be finite").count(), 1, "{}", robot.said());

    drop((events, beliefs, publisher, node));
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{status}\n{said}");
}

/// Checks that a belief is about a thing of the lesson: finite values, position on the table.
fn assert_sound(belief: &Belief) {
    for remembered in belief.percepts() {
        assert!(remembered.feature().is_some(), "{remembered:?}");
        assert!((0.0..=1.0).contains(&remembered.matching) && (0.0..=1.0).contains(&remembered.confidence));
    }
    let place = place(belief).expect("a thing has a place");
    assert!(place.iter().all(|coordinate| coordinate.abs() < 3.0), "{place:?}");
}
