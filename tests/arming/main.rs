//! `leo arm` with a fake robot of health boards only, and with a real one. A process can join one domain
//! only, so these tests have their own process.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;

use message::{
    JointArming, JointCause, JointLink, JointMachines, JointMode, JointMotion, JointPower, JointState,
    Joints, Process, Roster,
};
use process::arming::{self, ArmOrder};
use process::emergency;
use rustix::process::{Pid, Signal, kill_process};
use transport::janitor::{Claim, Janitor, claim};
use transport::{BoardWriter, Domain, Node, OverflowPolicy, Queues, RosterWriter};

use clock::Duration;

/// Time-out of a wait.
const LONG: Duration = Duration::from_secs(60);

/// Output and exit status of a command.
#[derive(Debug)]
struct Told {
    status: Option<i32>,
    out: String,
    err: String,
}

/// Checks an error: one line on standard error, nothing on standard output.
fn assert_refused(output: &Told, status: i32, words: &[&str]) {
    assert_eq!((output.status, output.out.as_str()), (Some(status), ""), "{output:?}");
    assert_eq!(output.err.lines().filter(|line| line.starts_with("leo: ")).count(), 1, "{output:?}");
    for word in words {
        assert!(output.err.contains(word), "{word} is not in {output:?}");
    }
}

/// Waits until a condition holds; `false` on time-out.
fn wait_until(holds: impl FnMut() -> bool) -> bool {
    testkit::robot::wait_until(LONG, holds)
}

/// Reads a file of the repository.
fn read(file: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).expect("a file of the repository")
}

/// Writes a file into a folder and returns its path.
fn write(folder: &tempfile::TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    fs::write(&path, text).expect("writes");
    path.display().to_string()
}

/// A fake robot: only the health boards of its supervisor and motor process.
struct Boards {
    domain: Domain,
    claim: Option<Claim>,
    joints: BoardWriter<Joints>,
    _roster: RosterWriter,
    _node: Node,
}

impl Boards {
    fn of(name: &str, joints: &Joints) -> Self {
        let domain = Domain::named(&format!("{name}-{}", std::process::id())).expect("a name");
        let claim = claim(&domain).expect("is free");
        domain.make().expect("there is shared memory");
        let queues = Queues { frames: 1, overflow_policy: OverflowPolicy::DropOldest };
        let node = Node::join(&domain, "boards", 1, queues).expect("joins");
        let mut roster = Roster::default();
        roster.set_incarnation(Process::Motor, 1);
        let mut written = RosterWriter::create(&node, Process::Supervisor, 1).expect("is the first");
        written.write(&roster);
        let mut board = BoardWriter::create(&node, Process::Motor, 1).expect("is the first");
        board.write(joints);
        Self { domain, claim: Some(claim), joints: board, _roster: written, _node: node }
    }

    fn root(&self) -> &Path {
        self.domain.root()
    }

    /// Takes the arming order as a motor process does, and publishes `after`. Returns the order and the
    /// output of `leo arm`.
    fn armed(&mut self, arguments: &[&str], after: &Joints) -> (ArmOrder, Told) {
        let root = self.root().to_owned();
        let output = thread::scope(|scope| {
            let output = scope.spawn(|| arm(&root, arguments));
            let mut order = None;
            let is_there = wait_until(|| {
                order = order.or(arming::take(&root).expect("can be taken"));
                order.is_some() || output.is_finished()
            });
            assert!(is_there, "no order comes");
            self.joints.write(after);
            (order, output.join().expect("runs"))
        });
        assert!(output.0.is_some(), "no order came: {:?}", output.1);
        (output.0.expect("came"), output.1)
    }
}

impl Drop for Boards {
    fn drop(&mut self) {
        if let Some(claim) = self.claim.take() {
            Janitor::new(&self.domain).wipe(claim);
        }
        let _gone = fs::remove_dir_all(self.root());
    }
}

/// Runs `leo arm` for a robot.
fn arm(root: &Path, arguments: &[&str]) -> Told {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leo"));
    command.args(["arm", "--domain"]).arg(root).args(arguments).env_clear().stdin(Stdio::null());
    let output = command.output().expect("runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Told { status: output.status.code(), out: text(&output.stdout), err: text(&output.stderr) }
}

/// Joints with these arming states and causes.
fn joints(locks: u64, summary: &[(JointArming, JointCause)]) -> Joints {
    let mut joints = Joints { locks, ..Joints::default() };
    joints.set((0_u32..).zip(summary).map(|(joint, &(arming, arming_cause))| {
        JointState::unread(joint, JointMode::Limp, arming_cause).with_machines(JointMachines {
            link: JointLink::Answering,
            power: JointPower::Off,
            arming,
            arming_cause,
            motion: JointMotion::Idle,
        })
    }));
    joints
}

const ARMED: (JointArming, JointCause) = (JointArming::Armed, JointCause::None);
const STARTED: (JointArming, JointCause) = (JointArming::Disarmed, JointCause::NotStarted);
const BLOCKED: (JointArming, JointCause) = (JointArming::Locked, JointCause::Blocked);

/// One test, because a process can join the boards of one domain only.
#[test]
fn joints_arm_by_order_and_unlock_by_acknowledgement() {
    let mut robot = Boards::of("arm", &joints(0, &[STARTED, STARTED]));
    let (order, output) = robot.armed(&[], &joints(0, &[ARMED, ARMED]));
    assert_eq!(order, ArmOrder { acknowledged_locks: None });
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    assert!(output.out.starts_with("2 joints disarmed, not-started: "), "{output:?}");
    let all_armed = output.out.lines().last().expect("a line").to_owned();
    assert!(all_armed.contains(" 2 joints "), "{output:?}");
    let mut wording = output.out;
    // If all are armed, no order is given.
    let output = arm(robot.root(), &[]);
    assert_eq!((output.status, output.out.trim_end()), (Some(0), all_armed.as_str()), "{output:?}");

    robot.joints.write(&joints(7, &[STARTED, BLOCKED]));
    let (order, output) = robot.armed(&[], &joints(7, &[ARMED, BLOCKED]));
    assert_eq!(order, ArmOrder { acknowledged_locks: None }, "nothing was acknowledged");
    assert_eq!(output.status, Some(1), "{output:?}");
    for fact in
        ["1 joint locked, blocked: ", JointCause::Blocked.remedy(), "1 of 2 ", "`leo arm --acknowledge`"]
    {
        assert!(output.out.contains(fact), "{fact}: {output:?}");
    }
    wording += &output.out;
    let output = arm(robot.root(), &[]);
    assert!(output.status == Some(1) && output.out.contains("1 of 2 "), "{output:?}");

    let (order, output) = robot.armed(&["--acknowledge", "--json"], &joints(8, &[ARMED, ARMED]));
    assert_eq!(order, ArmOrder { acknowledged_locks: Some(7) }, "the locks of before the order");
    let document: serde_json::Value = serde_json::from_str(&output.out).expect("JSON");
    let armed = (output.status, document["armed"].as_u64(), document["locks"].as_u64());
    assert_eq!(armed, (Some(0), Some(2), Some(8)));
    assert_eq!(document["locked"], serde_json::json!([]));

    robot.joints.write(&joints(8, &[STARTED, ARMED]));
    let output = arm(robot.root(), &[]);
    assert_eq!(output.status, Some(1), "{output:?}");
    insta::assert_snapshot!(wording + &output.err);
    let left = arming::take(robot.root()).expect("reads");
    assert_eq!(left, None, "a motor process that starts later would obey it");

    emergency::raise(robot.root(), "a test").expect("raised");
    assert_refused(&arm(robot.root(), &["--acknowledge"]), 1, &["leo emergency-stop --release"]);
    assert_eq!(arming::take(robot.root()).expect("reads"), None);
}

#[test]
fn arming_without_a_running_robot_is_refused() {
    let nowhere = Path::new("/dev/shm/leo-nowhere-to-arm");
    assert_refused(&arm(nowhere, &[]), 2, &["leo-nowhere-to-arm"]);
}

#[test]
fn without_automatic_arming_a_robot_arms_only_by_order() {
    let files = tempfile::tempdir().expect("a folder");
    let leo =
        read("config/leo.toml").replace("automatic_arming = \"simulated\"", "automatic_arming = \"never\"");
    let config = write(&files, "leo.toml", &leo);
    let root = format!("/dev/shm/leo-arm-real-{}", std::process::id());
    let mut robot = Command::new(env!("CARGO_BIN_EXE_leo"))
        .args(["run", "--for", "3600", "--config", &config, "--domain", &root])
        .env("XDG_STATE_HOME", files.path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("starts");
    let root = Path::new(&root);
    // Until the motor process has reported its joints, the command fails: no robot runs there, or it is starting.
    let mut output = None;
    wait_until(|| {
        let said = arm(root, &["--json"]);
        let is_there = !said.out.is_empty();
        output = Some(said);
        is_there
    });
    let again = arm(root, &[]);
    kill_process(Pid::from_child(&robot), Signal::INT).expect("it lives");
    robot.wait().expect("is ours");
    let output = output.expect("was run");
    let document: serde_json::Value = serde_json::from_str(&output.out).unwrap_or_default();
    assert_eq!((output.status, document["armed"].as_u64()), (Some(0), Some(65)), "{output:?}");
    assert!(again.status == Some(0) && again.out.contains(" 65 joints "), "{again:?}");
}
