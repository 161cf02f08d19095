//! The emergency stop and the death of the motor process, seen in the joints' motion.

use std::collections::BTreeMap;
use std::fs;
use std::process::Stdio;

use clock::{Duration, Instant};
use message::{JointCause, JointMode, JointState, JointStates};
use rustix::process::Signal;
use transport::{Domain, FrameSubscriber, Node, OverflowPolicy, Queues};

use super::robot::{Robot, leo, signal, wait_until};
use testkit::robot::{is_alive, left_behind};

const JOINTS: usize = 65;
/// Configured soft start: a speed limit after torque is switched on.
const SOFT_START: Duration = Duration::from_secs(1);
const SOFT_START_RAD_S: f64 = 0.5;
/// Resolution of a position.
const COUNT_RAD: f64 = std::f64::consts::TAU / 4096.0;

/// Observes the joints of a robot.
struct Joints {
    subscriber: FrameSubscriber<JointStates>,
    _node: Node,
}

impl Joints {
    fn of(robot: &Robot) -> Self {
        let domain = Domain::at(robot.domain()).expect("a domain");
        let queues = Queues { frames: 4, overflow_policy: OverflowPolicy::DropOldest };
        let node = Node::join(&domain, "observer", 1, queues).expect("joins");
        Self { subscriber: node.subscriber(None).expect("a free reader"), _node: node }
    }

    /// The newest states since the last call.
    fn newest(&mut self) -> Vec<JointState> {
        self.newest_of().1
    }

    /// The newest states with the time of their cycle.
    fn newest_of(&mut self) -> (Instant, Vec<JointState>) {
        let frame = self.subscriber.newest().expect("works");
        let of = |at_ns, states: &[JointState]| (Instant::from_nanos(at_ns), states.to_vec());
        frame.map_or_else(|| of(0, &[]), |frame| of(frame.head().valid_at_ns, frame.entries()))
    }

    /// Waits for states in which a condition holds.
    fn until(&mut self, robot: &Robot, what: &str, holds: impl Fn(&[JointState]) -> bool) -> Vec<JointState> {
        let mut states = Vec::new();
        let seen = wait_until(|| {
            states = self.newest();
            states.len() == JOINTS && holds(&states)
        });
        assert!(seen, "not {what}\n{}", robot.said());
        states
    }
}

fn all_are(mode: JointMode, cause: JointCause) -> impl Fn(&[JointState]) -> bool {
    move |states| states.iter().all(|joint| joint.mode() == Some(mode) && joint.cause() == Some(cause))
}

fn moves(joint: &JointState) -> bool {
    joint.present_velocity_rad_s().is_some_and(|velocity| velocity.abs() > 0.2)
}

fn motor_of(robot: &Robot) -> i32 {
    robot.processes().get("motor").copied().expect("the motor process runs")
}

fn stop(robot: &Robot, arguments: &[&str]) -> (Option<i32>, String) {
    let mut command = leo(&["emergency-stop", "--domain"]);
    let output = command.arg(robot.domain()).args(arguments).output().expect("runs");
    (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Arms a robot: a released stop only permits arming.
fn arm(robot: &Robot) {
    let mut output = String::new();
    let armed = wait_until(|| {
        let arming = leo(&["arm", "--domain"]).arg(robot.domain()).output().expect("runs");
        output = String::from_utf8_lossy(&arming.stderr).into_owned();
        arming.status.success()
    });
    assert!(armed, "not armed: {output}\n{}", robot.said());
}

/// One test with one robot, because a process can join one domain only.
#[test]
fn no_stop_of_the_motor_makes_a_joint_jump() {
    let robot = Robot::ready("emergency", &[]);
    let mut joints = Joints::of(&robot);
    let following = all_are(JointMode::Following, JointCause::None);
    joints.until(&robot, "following", &following);
    for _death in 0..3 {
        killed_in_motion(&robot, &mut joints);
    }
    joints.until(&robot, "following", &following);
    stopped_by_command(&robot, &mut joints);
    arm(&robot);
    joints.until(&robot, "following", &following);
    stopped_by_signal(&robot, &mut joints);
    arm(&robot);
    joints.until(&robot, "following", &following);
    signal(robot.pid(), Signal::TERM);
    joints.until(&robot, "limp at the end", all_are(JointMode::Limp, JointCause::Stopped));
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{said}");
}

/// Joint metrics from `leo top`, because this process can join one domain only.
fn metrics(robot: &Robot) -> String {
    let output = leo(&["top", "--openmetrics", "--domain"]).arg(robot.domain()).output().expect("runs");
    String::from_utf8(output.stdout).expect("is text")
}

fn until_told(robot: &Robot, line: &str) {
    let output = wait_until(|| metrics(robot).lines().any(|output| output == line));
    assert!(output, "not {line}\n{}\n{}", metrics(robot), robot.said());
}

#[test]
fn a_stop_stays_after_the_robots_end_until_it_is_released() {
    let name = "stays-stopped";
    let (following, limp) = ("leo_joints{mode=\"following\"} 65", "leo_joints{mode=\"limp\"} 65");
    let robot = Robot::ready(name, &[]);
    until_told(&robot, following);
    let (status, said) = stop(&robot, &["--reason", "a hand is in the arm"]);
    assert_eq!(status, Some(0), "{said}\n{}", robot.said());
    let (status, _) = robot.stop(Signal::KILL);
    assert!(!status.success());

    // It starts in the domain of the killed one; the learner's goals have no effect.
    let robot = Robot::ready(name, &[]);
    assert!(robot.works(), "{}", robot.said());
    until_told(&robot, limp);
    until_told(&robot, "leo_joints_with_fault{cause=\"emergency\"} 65");
    let said = robot.said();
    let warned =
        said.lines().filter(|line| line.contains("before this start (a hand is in the arm)")).count();
    assert!(warned == 1 && said.contains("leo emergency-stop --release"), "{said}");
    let (status, said) = stop(&robot, &[]);
    assert_eq!(status, Some(0), "stopped twice: {said}\n{}", robot.said());

    // A regular end keeps only the stop, which can be released without a robot.
    let domain = robot.domain().to_owned();
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{said}");
    assert_eq!(left_behind(&domain).len(), 1);
    let left = fs::read_dir(&domain).expect("is kept").flatten().map(|entry| entry.file_name());
    assert_eq!(left.collect::<Vec<_>>(), ["emergency-stop"]);
    let robot = Robot::ready(name, &[]);
    until_told(&robot, limp);
    assert_eq!(stop(&robot, &["--release"]).0, Some(0));
    until_told(&robot, "leo_joints_by_arming{arming=\"disarmed\"} 65");
    until_told(&robot, limp);
    arm(&robot);
    until_told(&robot, following);

    assert_eq!(stop(&robot, &[]).0, Some(0));
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{said}");
    let released = leo(&["emergency-stop", "--release", "--domain"]).arg(&domain).output().expect("runs");
    let said = String::from_utf8_lossy(&released.stdout).into_owned();
    assert_eq!((released.status.code(), said), (Some(0), format!("{}: released\n", domain.display())));
    assert_eq!(left_behind(&domain), [""; 0]);
}

#[test]
fn a_stop_is_confirmed_with_short_queues_and_many_onlookers() {
    let robot = Robot::ready("looked-at", &[("queue_depth", "1")]);
    let folder = tempfile::tempdir().expect("a folder");
    let mut recorders: Vec<_> = (0..4)
        .map(|number| {
            let file = folder.path().join(format!("{number}.mcap"));
            let mut command = leo(&["record", "--domain"]);
            let recorder =
                command.arg(robot.domain()).arg(&file).stdout(Stdio::null()).spawn().expect("starts");
            (file, recorder)
        })
        .collect();
    for (file, _) in &recorders {
        let records = || fs::metadata(file).is_ok_and(|file| file.len() > 100_000);
        assert!(wait_until(records), "does not record\n{}", robot.said());
    }
    let (status, said) = stop(&robot, &[]);
    assert_eq!(status, Some(0), "{said}\n{}", robot.said());
    assert!(said.contains("65 servos"), "{said}");
    assert_eq!(stop(&robot, &["--release"]).0, Some(0));
    for (_, recorder) in &mut recorders {
        recorder.kill().and_then(|()| recorder.wait()).expect("ours");
    }
}

/// The stop is confirmed, outlives the motor process, and ends on release.
fn stopped_by_command(robot: &Robot, joints: &mut Joints) {
    let limp = all_are(JointMode::Limp, JointCause::Emergency);
    let (status, said) = stop(robot, &["--reason", "somebody's hair is in the arm"]);
    assert_eq!(status, Some(0), "{said}\n{}", robot.said());
    assert!(said.contains("65 servos"), "{said}");
    joints.until(robot, "limp", &limp);
    assert!(wait_until(|| robot.said().contains("EMERGENCY STOP (somebody's hair is in the arm)")));
    let motor = motor_of(robot);
    signal(motor, Signal::KILL);
    assert!(wait_until(|| robot.processes().get("motor").is_some_and(|&pid| pid != motor)));
    joints.until(robot, "limp again", &limp);
    let (status, said) = stop(robot, &["--release"]);
    assert_eq!(status, Some(0), "{said}");
    assert_eq!(stop(robot, &["--release"]).1.trim().rsplit(": ").next(), Some("was not raised"));
}

/// The signal stops the joints and creates the stop file.
fn stopped_by_signal(robot: &Robot, joints: &mut Joints) {
    signal(motor_of(robot), Signal::USR1);
    joints.until(robot, "limp", all_are(JointMode::Limp, JointCause::Emergency));
    let file = robot.domain().join("emergency-stop");
    assert!(wait_until(|| fs::read_to_string(&file).is_ok_and(|why| why.contains("SIGUSR1"))));
    fs::remove_file(&file).expect("anybody who may stop it may release it");
}

/// Checks how joints are taken up, from the commands of each cycle, independent of this test's timing.
#[derive(Default)]
struct TakenUp {
    /// The last cycle in which each joint had no command.
    idle: BTreeMap<u32, Instant>,
    /// Time and value of each joint's last command since then.
    commanded: BTreeMap<u32, (Instant, f64)>,
    first: usize,
    steps: usize,
}

impl TakenUp {
    fn check(&mut self, at: Instant, joint: &JointState) {
        let name = joint.joint;
        let Some(command_rad) = joint.command_position_rad() else {
            self.idle.insert(name, at);
            self.commanded.remove(&name);
            return;
        };
        let Some(&idle) = self.idle.get(&name) else { return };
        let Some((before, from_rad)) = self.commanded.insert(name, (at, command_rad)) else {
            let stands_rad = joint.present_position_rad().expect("was read, or would not follow");
            // The command may have moved on since then, with the servo following.
            let since = at.since(idle) + at.since(Instant::from_nanos(joint.sampled_at_ns));
            let off_rad = (command_rad - stands_rad).abs();
            let max_rad = 2.0 * (COUNT_RAD + SOFT_START_RAD_S * since.as_secs_f64());
            assert!(off_rad <= max_rad, "joint {name} jumps by {off_rad} of {max_rad} rad");
            self.first += 1;
            return;
        };
        if at > before && at <= idle + SOFT_START {
            let speed = (command_rad - from_rad).abs() / at.since(before).as_secs_f64();
            assert!(speed <= SOFT_START_RAD_S * (1.0 + 1e-6), "joint {name} is sent on at {speed} rad/s");
            self.steps += 1;
        }
    }
}

/// The servos hold position when the motor process dies, and are taken up there slowly.
fn killed_in_motion(robot: &Robot, joints: &mut Joints) {
    joints.until(robot, "moving", |states| {
        states.iter().any(moves) && states.iter().all(|joint| joint.mode() == Some(JointMode::Following))
    });
    let motor = motor_of(robot);
    signal(motor, Signal::KILL);
    // Readings of the old process's last cycle must not count for the new one.
    assert!(wait_until(|| !is_alive(motor)));
    let killed_at = clock::now();
    // Until then the servos continue to their last goal; then their watchdogs stop them.
    let stopped_at = killed_at + Duration::from_millis(600);
    // A former position of each joint, and since when it follows again.
    let mut last: BTreeMap<u32, (u64, f64)> = BTreeMap::new();
    let mut since: BTreeMap<u32, u64> = BTreeMap::new();
    let (mut checked, mut taken_up) = (0, TakenUp::default());
    let done = wait_until(|| {
        let (of, states) = joints.newest_of();
        for joint in states {
            if of >= killed_at {
                taken_up.check(of, &joint);
            }
            let Some(position_rad) = joint.present_position_rad() else { continue };
            let at = joint.sampled_at_ns;
            if joint.mode() == Some(JointMode::Following) && at >= killed_at.as_nanos() {
                since.entry(joint.joint).or_insert(at);
            }
            if at < stopped_at.as_nanos() {
                continue;
            }
            // During start-up and the first second of following.
            let is_soft = since.get(&joint.joint).is_none_or(|first| at < first + 1_000_000_000);
            let &mut (before, from) = last.entry(joint.joint).or_insert((at, position_rad));
            // Timestamps are less accurate than positions, so speed is measured over 0.1 s.
            if at >= before + 100_000_000 && is_soft {
                let speed = (position_rad - from).abs() / seconds(before, at);
                assert!(speed < 0.6, "joint {} goes on at {speed} rad/s", joint.joint);
                last.insert(joint.joint, (at, position_rad));
                checked += 1;
            }
        }
        since.len() == JOINTS && clock::now() > killed_at + Duration::from_secs(3)
    });
    assert!(done && checked > 300, "{checked} readings\n{}", robot.said());
    let TakenUp { first, steps, .. } = taken_up;
    assert!(first > JOINTS / 2 && steps > 300, "{first} joints were seen to be taken up, in {steps} steps");
}

fn seconds(from_ns: u64, until_ns: u64) -> f64 {
    Instant::from_nanos(until_ns).since(Instant::from_nanos(from_ns)).as_secs_f64()
}
