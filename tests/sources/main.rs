//! External sources, and readers of beliefs, in other languages, with real processes.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod python;
mod readers;
#[path = "../supervision/robot.rs"]
#[expect(dead_code, reason = "the tests of the supervisor use the rest")]
mod robot;
mod venv;

use std::sync::{Mutex, MutexGuard, PoisonError};

use message::{Belief, Beliefs, Feature};
use rustix::process::Signal;
use transport::{Domain, FrameSubscriber, Node, OverflowPolicy, Queues};

use python::Python;
use robot::{Robot, wait_until};
use testkit::robot::left_behind;

/// As in `leo.toml`: all ports of a domain have the same queues.
const QUEUES: Queues = Queues { frames: 4, overflow_policy: OverflowPolicy::DropOldest };
/// Number of the position percept in `percepts.toml`.
const POSITION: u16 = 0;

/// Longer than the culling time in `percepts.toml`.
const FORGOTTEN_AFTER_NS: u64 = 1_000_000_000;

/// Centre of the example's circle, in the frame of the source and in the base frame.
const CENTRE: [&str; 3] = ["1.0", "0.5", "1.0"];
const CENTRE_BASE_M: [f32; 3] = [-0.5, 1.0, 1.5];
const RADIUS_M: f32 = 0.1;
const CAMERA: &str = "name = \"camera\"\nkind = \"external\"\nrate_hz = 50.0\nposition_sd_m = 0.01\n\
    frame = { position_m = [0.0, 0.0, 0.5], heading_deg = 90.0 }";

/// Until it is dropped, no other test of this process has a robot. A process can join one domain only, so these tests
/// take turns with one of the same name.
fn one_robot() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn place(belief: &Belief) -> Option<[f32; 3]> {
    match belief.percept(POSITION)?.feature()? {
        Feature::Vector(place) => Some(place),
        Feature::None | Feature::Symbol(_) | Feature::Number(_) | Feature::Orientation(_) => None,
    }
}

/// Whether a belief is in the example's block.
fn is_of_the_example(belief: &Belief) -> bool {
    place(belief).is_some_and(|place| {
        let off: Vec<f32> = place.iter().zip(CENTRE_BASE_M).map(|(is, centre)| is - centre).collect();
        let [x, y, z] = off.as_slice() else { return false };
        (x.hypot(*y) - RADIUS_M).abs() < 0.03 && z.abs() < 0.01
    })
}

/// The belief in the example's block, once it is the only one in the newest frame and `is_wanted` accepts the
/// frame's timestamp and the belief; `None` on time-out.
fn believed(
    beliefs: &mut FrameSubscriber<Beliefs>,
    is_wanted: impl Fn(u64, &Belief) -> bool,
) -> Option<Belief> {
    let mut found = None;
    let came = wait_until(|| {
        beliefs.newest().expect("works").is_some_and(|frame| {
            let mut of_it = frame.entries().iter().filter(|belief| is_of_the_example(belief));
            found = of_it.next().filter(|_| of_it.next().is_none()).copied();
            found.is_some_and(|belief| is_wanted(frame.head().header.valid_at_ns, &belief))
        })
    });
    found.filter(|_| came)
}

/// The sensor process's row of `leo top`.
fn sensor(robot: &Robot) -> serde_json::Value {
    robot.rows().into_iter().find(|row| row["process"] == "sensor").unwrap_or_default()
}

/// Whether the example's source is silent.
fn is_silent(robot: &Robot) -> Option<bool> {
    let row = sensor(robot);
    let camera = row.pointer("/sources/1").filter(|source| source["name"] == "camera")?;
    camera["silent"].as_bool()
}

#[test]
fn a_killed_python_source_is_reported_and_reconnects() {
    let _alone = one_robot();
    let Some(python) = Python::find() else { return };
    let robot = Robot::ready("sources", &[("[[sensor.source]]", CAMERA)]);
    let domain = Domain::at(robot.domain()).expect("a domain");
    let node = Node::join(&domain, "observer", 1, QUEUES).expect("joins");
    let mut beliefs = node.subscriber::<Beliefs>(Some(0)).expect("a free reader");

    let mut example = python.observe(robot.domain(), &CENTRE);
    let first =
        believed(&mut beliefs, |_, _| true).unwrap_or_else(|| panic!("{}\n{}", example.said(), robot.said()));
    // The belief keeps its identity between the frames of the source too.
    let mut newest = first;
    let stays = wait_until(|| {
        if let Some(belief) = believed(&mut beliefs, |_, _| true) {
            assert_eq!(belief.id, first.id);
            newest = belief;
        }
        newest.observations > first.observations + 100
    });
    assert!(stays, "{first:?}\n{newest:?}");
    let row = sensor(&robot);
    assert_eq!((&row["refused"], is_silent(&robot)), (&0.into(), Some(false)), "{row}");
    assert!(row["sources"][1]["observations"].as_u64() > Some(100), "{row}");

    // After the source's process is killed, the robot reports it and keeps the belief. The simulator's frames
    // are no evidence, since it never saw the block.
    example.kill();
    assert!(wait_until(|| is_silent(&robot) == Some(true)), "{}", robot.said());
    assert!(wait_until(|| robot.said().contains("camera")), "{}", robot.said());
    let kept = believed(&mut beliefs, |at_ns, belief| at_ns > belief.perceived_at_ns + FORGOTTEN_AFTER_NS);
    assert_eq!(kept.map(|kept| kept.id), Some(first.id), "{}", robot.said());

    // A restarted source replaces the dead one, and its observations count.
    let mut example = python.observe(robot.domain(), &CENTRE);
    let again = believed(&mut beliefs, |at_ns, belief| at_ns < belief.perceived_at_ns + FORGOTTEN_AFTER_NS);
    assert!(again.is_some(), "{}", example.said());
    assert!(wait_until(|| is_silent(&robot) == Some(false)), "{}", robot.said());
    assert_eq!(sensor(&robot)["restarts"], 0);

    // It ends with the robot and leaves nothing behind.
    drop((beliefs, node));
    let domain = robot.domain().to_owned();
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{status}\n{said}");
    assert!(wait_until(|| example.has_ended()), "the example goes on");
    assert!(example.said().contains("the robot has ended"), "{}", example.said());
    assert_eq!(left_behind(&domain), [""; 0]);
}
