//! An unlisted process publishes on a topic whose writer has died, with real processes.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "a test fails by panicking")]

#[path = "../supervision/robot.rs"]
#[expect(dead_code, reason = "the tests of the supervisor use the rest")]
mod robot;
mod rogue;
mod slots;

use std::fs;
use std::path::Path;
use std::process::Stdio;

use clock::{Duration, Instant};
use message::{
    ActsAnswered, Beliefs, Events, Hop, JointGoals, JointStates, Observations, Percepts, Scene, TeacherActs,
    Utterances,
};
use rustix::process::Signal;
use transport::{Domain, Node, TopicPorts};

use robot::{Robot, leo, pause, signal, wait_until};
use rogue::{FALSE_PLACE_M, GOAL_OFFSET_RAD, Rogue};

/// Number of kills of the learner.
const KILLS: usize = 10;
/// Minimum number of topics that the rogue process must obtain, so that the test is not vacuous.
const MIN_TAKEN: usize = 3;
/// Maximum motion of a joint that holds its position, in radians.
const STILL_RAD: f64 = 0.05;

/// Task 1 with a demonstration that begins in an hour, so that no joint has a reason to move.
fn quiet_lesson(folder: &Path) -> String {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("config/lessons/task1.toml"));
    let text = text.expect("a lesson");
    let head = text.split("script = [").next().expect("a head");
    let script = "script = [\n{ at_s = 3500.0, who = 1, say = \"Leo, I can teach you to do task 1\" },\n\
                  { at_s = 3550.0, who = 1, say = \"Task 1 is done\" },\n]\n";
    let file = folder.join("quiet.toml");
    fs::write(&file, format!("{head}{script}")).expect("writes");
    file.display().to_string()
}

/// The row of a process in `leo top`.
fn row(robot: &Robot, process: &str) -> serde_json::Value {
    robot.rows().into_iter().find(|row| row["process"] == process).unwrap_or_default()
}

/// Kills a process and opens its topic for writing, if that succeeds before the restarted process has it.
fn take_place<T: TopicPorts>(
    robot: &Robot,
    node: &Node,
    victim: &str,
    number: Option<u32>,
) -> Option<Rogue<T>> {
    let mut before = None;
    let lives = wait_until(|| {
        before = robot.processes().get(victim).copied();
        before.is_some()
    });
    assert!(lives, "`{victim}` does not run\n{}", robot.said());
    signal(before.expect("lives"), Signal::KILL);
    let mut rogue = None;
    let give_up = clock::now() + Duration::from_secs(20);
    while rogue.is_none() && clock::now() < give_up {
        rogue = Rogue::open(node, number);
        let is_back = || row(robot, victim)["state"] == "running" && robot.processes().contains_key(victim);
        if rogue.is_none()
            && robot.processes().get(victim).is_some_and(|pid| Some(*pid) != before)
            && is_back()
        {
            break;
        }
    }
    rogue
}

/// Publishes on a killed process's topic until a reader has refused it. Returns whether the topic was
/// obtained.
fn is_refused<T: TopicPorts>(
    robot: &Robot,
    node: &Node,
    (victim, number): (&str, Option<u32>),
    reader: &str,
    entry: T::Entry,
) -> bool {
    let Some(mut rogue) = take_place::<T>(robot, node, victim, number) else { return false };
    let before = row(robot, reader);
    let refused = |row: &serde_json::Value| row["unlisted_frames"].as_u64().unwrap_or(0);
    let is_refused = wait_until(|| {
        rogue.publish(T::Head::default(), &[entry]);
        let row = row(robot, reader);
        // A restarted reader counts from zero.
        refused(&row) > refused(&before) || (row["pid"] != before["pid"] && refused(&row) > 0)
    });
    assert!(is_refused, "`{reader}` takes {} of process {}\n{}", T::NAME, std::process::id(), robot.said());
    assert_eq!(row(robot, reader)["unlisted_pid"], std::process::id(), "{}", robot.said());
    true
}

#[test]
fn an_impostor_of_a_dead_process_is_refused_and_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = quiet_lesson(folder.path());
    let patient = [("max_deaths", "1000000"), ("max_backoff_ms", "40.0")];
    let robot = Robot::with("writers", &patient, &["--lesson", &lesson]);
    assert!(wait_until(|| robot.said().contains("the robot runs")), "{}", robot.said());
    let domain = Domain::at(robot.domain()).expect("a domain");
    let node = Node::join(&domain, "rogue", 1, rogue::QUEUES).expect("joins");

    goals_are_not_followed(&robot, &node);
    percepts_are_not_believed(&robot, &node);
    a_learner_started_by_hand_is_refused(&robot);

    let tries = [
        is_refused::<Beliefs>(&robot, &node, ("belief", Some(0)), "learner", rogue::belief()),
        is_refused::<Beliefs>(&robot, &node, ("belief", Some(1)), "learner", rogue::belief()),
        is_refused::<Utterances>(&robot, &node, ("simulator", None), "learner", rogue::utterance()),
        is_refused::<Scene>(&robot, &node, ("simulator", None), "console", rogue::scene_object()),
        is_refused::<ActsAnswered>(&robot, &node, ("simulator", None), "console", rogue::answer()),
        is_refused::<Observations>(&robot, &node, ("simulator", Some(0)), "sensor", rogue::observation()),
        is_refused::<JointStates>(&robot, &node, ("motor", None), "learner", rogue::joint_state()),
        is_refused::<TeacherActs>(&robot, &node, ("console", None), "simulator", rogue::act()),
        is_refused::<Events>(&robot, &node, ("learner", None), "console", rogue::event()),
    ];
    assert!(tries.iter().filter(|taken| **taken).count() >= MIN_TAKEN, "{tries:?}\n{}", robot.said());
    assert!(robot.works(), "{}", robot.said());
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{status}\n{said}");
}

/// Kills the learner repeatedly and publishes goals in its place.
fn goals_are_not_followed(robot: &Robot, node: &Node) {
    let mut joints = node.subscriber::<JointStates>(None).expect("a free reader");
    // The learner's stamp on the last accepted goals, and the commanded positions.
    let mut look = || {
        let frame = joints.newest().expect("works")?;
        let places: Option<Vec<f64>> =
            frame.entries().iter().map(message::JointState::command_position_rad).collect();
        Some((frame.head().hop_time(Hop::Decided).map(Instant::from_nanos), places?))
    };
    let mut begun = None;
    let follows = wait_until(|| {
        begun = look().filter(|(decided, places)| decided.is_some() && places.len() == 65);
        begun.is_some()
    });
    assert!(follows, "the learner's goals are not followed\n{}", robot.said());
    let (_, rest) = begun.expect("follows");
    let mut taken = 0;
    for _kill in 0..KILLS {
        let killed_at = clock::now();
        let mut rogue = take_place::<JointGoals>(robot, node, "learner", None);
        let tried = rogue.as_ref().map(|_| clock::now());
        taken += usize::from(rogue.is_some());
        let mut moved = 0;
        let is_back = wait_until(|| {
            if let Some(rogue) = &mut rogue {
                rogue.publish_goals(&rest);
            }
            let Some((decided, places)) = look() else { return false };
            let distances = places.iter().zip(&rest).map(|(place, rest)| (place - rest).abs());
            moved = moved.max(distances.filter(|distance| *distance > STILL_RAD).count());
            // Goals of the rogue process have no stamp.
            let is_new = decided.is_some_and(|decided| decided > killed_at + Duration::from_millis(50));
            let has_tried = tried.is_none_or(|tried| clock::now().since(tried) > Duration::from_secs(1));
            moved > 0 || (is_new && has_tried)
        });
        assert_eq!(moved, 0, "joints moved by {GOAL_OFFSET_RAD} rad for process {}", std::process::id());
        assert!(is_back, "the new learner's goals are not followed\n{}", robot.said());
    }
    assert!(taken >= MIN_TAKEN, "the place was taken {taken} times");
    let motor = row(robot, "motor");
    assert_eq!(motor["unlisted_pid"], std::process::id(), "{motor}");
    assert!(motor["unlisted_frames"].as_u64() > Some(0), "{motor}");
    let told =
        format!("process {} publishes, and the supervisor's roster does not name it", std::process::id());
    let times = || {
        let said = robot.said();
        said.lines().filter(|line| line.contains(&told) && line.contains("`motor` refuses")).count()
    };
    // The supervisor reports each process once for each reader.
    assert!(wait_until(|| times() > 0), "{}", robot.said());
    assert_eq!(times(), 1, "{}", robot.said());
}

/// A second learner beside the supervisor's reports that it is refused.
fn a_learner_started_by_hand_is_refused(robot: &Robot) {
    let mut learner = leo(&["learner", "--incarnation", "99", "--domain"]);
    let mut learner = learner.arg(robot.domain()).stderr(Stdio::piped()).spawn().expect("starts");
    let is_refused = wait_until(|| row(robot, "motor")["unlisted_pid"] == learner.id());
    let _dead = learner.kill();
    let said = learner.wait_with_output().expect("ends").stderr;
    let said = String::from_utf8_lossy(&said);
    assert!(is_refused, "{said}\n{}", robot.said());
    assert!(said.contains("the robot refuses its frames"), "{said}");
}

/// Kills the sensor process and publishes a non-existing object in its place.
fn percepts_are_not_believed(robot: &Robot, node: &Node) {
    let mut beliefs = node.subscriber::<Beliefs>(Some(0)).expect("a free reader");
    let mut is_believed = || {
        let mut is_believed = false;
        while let Some(frame) = beliefs.receive().expect("works") {
            is_believed |= frame.entries().iter().any(rogue::is_of_false_place);
        }
        is_believed
    };
    let mut taken = 0;
    for _kill in 0..KILLS {
        let Some(mut rogue) = take_place::<Percepts>(robot, node, "sensor", None) else { continue };
        taken += 1;
        let end = clock::now() + Duration::from_millis(500);
        while clock::now() < end {
            rogue.publish_percepts();
            assert!(!is_believed(), "an object at {FALSE_PLACE_M:?} is believed in");
            pause(Duration::from_millis(5));
        }
    }
    assert!(taken >= MIN_TAKEN, "the place was taken {taken} times");
    let belief = row(robot, "belief");
    assert_eq!(belief["unlisted_pid"], std::process::id(), "{belief}");
}
