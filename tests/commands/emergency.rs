//! `leo emergency-stop` under partial failures: it stops every robot that it can reach.

use std::fs;
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, chown};
use std::path::Path;
use std::process::{Command, Stdio};

use rustix::process::getuid;
use transport::Domain;
use transport::janitor::{Claim, claim};

use crate::harness::{public_executable, redacted};

/// A user of this test only: stopping all robots of a user would also stop those of other tests.
const USER: u32 = 65_533;

/// A domain that looks like a running robot; removed at the end.
struct Robot {
    domain: Domain,
    _claim: Claim,
}

impl Robot {
    fn of(name: &str) -> Self {
        let domain = Domain::named(&format!("{name}-{}", std::process::id())).expect("a name");
        domain.make().expect("there is shared memory");
        let claim = claim(&domain).expect("is free");
        Self { domain, _claim: claim }
    }

    fn root(&self) -> &Path {
        self.domain.root()
    }

    fn is_stopped(&self) -> bool {
        self.root().join("emergency-stop").exists()
    }

    fn belongs_to(&self, user: u32) {
        chown(self.root(), Some(user), Some(user)).expect("is ours");
        for entry in fs::read_dir(self.root()).expect("is there").flatten() {
            chown(entry.path(), Some(user), Some(user)).expect("is ours");
        }
        assert_eq!(fs::metadata(self.root()).expect("is there").uid(), user);
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        let _gone = fs::remove_dir_all(self.root());
        let ours = |name: &str| name.starts_with(&self.domain.prefix());
        for entry in fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
            if entry.file_name().to_str().is_some_and(ours) {
                let _gone = fs::remove_file(entry.path());
            }
        }
    }
}

/// Returns exit status, standard output and standard error.
fn run(command: &mut Command) -> (Option<i32>, String, String) {
    let output = command.env_clear().stdin(Stdio::null()).output().expect("runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn one_robot_is_stopped_although_stopping_another_fails() {
    if !getuid().is_root() {
        skip::skip("only root can become another user");
        return;
    }
    if run(Command::new("/usr/bin/unshare").args(["--net", "/bin/true"])).0 != Some(0) {
        skip::skip("no namespace of the network can be made here");
        return;
    }
    let files = tempfile::tempdir().expect("a folder");
    let leo = public_executable(&files);
    // In stopping order.
    let [locked, open] = ["stop-a", "stop-b"].map(Robot::of);
    for robot in [&locked, &open] {
        robot.belongs_to(USER);
    }
    fs::set_permissions(locked.root(), fs::Permissions::from_mode(0o555)).expect("is ours");
    let stop = |arguments: &[&str]| {
        let user = USER.to_string();
        // In its own network namespace without a stop socket. Without a domain, the command reaches every
        // robot of this machine.
        let mut command = Command::new("/usr/bin/unshare");
        command.args(["--net", "/usr/bin/setpriv", "--reuid", &user, "--regid", &user, "--clear-groups"]);
        run(command.arg(&leo).arg("emergency-stop").args(arguments))
    };
    let (status, out, err) = stop(&[]);
    assert!(open.is_stopped() && !locked.is_stopped(), "{out}{err}");
    assert_eq!(status, Some(1), "{out}{err}");
    let [locked, open] = [&locked, &open].map(|robot| robot.root().display().to_string());
    assert!(err.starts_with(&format!("leo: {locked}: ")) && !err.contains(&open), "{err}");
    assert!(out.contains(&format!("{open}: raised")) && !out.contains(&locked), "{out}");

    // Releasing a stop that was not raised succeeds, whatever the permissions.
    let (status, out, err) = stop(&["--release"]);
    assert_eq!((status, err.as_str()), (Some(0), ""), "{out}");
    let lines: Vec<&str> = out.lines().collect();
    assert!(lines.len() == 2 && lines[0].starts_with(&locked) && lines[1].starts_with(&open), "{out}");
    insta::assert_snapshot!(redacted(&out, &[(&locked, "[not stopped]"), (&open, "[stopped]")]));
}

#[test]
fn a_stop_with_an_overlong_reason_is_still_raised() {
    let robot = Robot::of("stop-full");
    // A file size limit of 0 has the effect of a full file system.
    let script = "ulimit -f 0; trap '' XFSZ; exec \"$0\" emergency-stop --domain \"$1\"";
    let mut command = Command::new("/bin/sh");
    command.args(["-c", script, env!("CARGO_BIN_EXE_leo")]).arg(robot.root());
    let (status, out, err) = run(&mut command);
    assert!(robot.is_stopped());
    assert_eq!(fs::read(robot.root().join("emergency-stop")).expect("reads"), b"", "there was room");
    // No motor process runs that could confirm the stop.
    assert_eq!((status, err.as_str()), (Some(1), ""), "{out}");
    assert!(out.contains("raised, but NOT CONFIRMED"), "{out}");
}

#[test]
fn an_emergency_stop_during_start_creates_no_buffer_of_a_process() {
    let robot = Robot::of("stop-early");
    let mut command = Command::new(env!("CARGO_BIN_EXE_leo"));
    command.args(["emergency-stop", "--domain"]).arg(robot.root()).stdout(Stdio::null());
    let mut stop = command.spawn().expect("runs");
    let (mut looks, mut buffers) = (0, 0);
    while stop.try_wait().expect("ours").is_none() {
        buffers += fs::read_dir(robot.root().join("services")).into_iter().flatten().count();
        looks += 1;
    }
    stop.wait().expect("ours");
    assert!(looks > 1 && robot.is_stopped());
    assert_eq!(buffers, 0, "in {looks} looks");
}

#[test]
fn an_unnamed_robot_keeps_the_stop_of_its_predecessor() {
    const USER: u32 = 65_532;
    if !getuid().is_root() {
        skip::skip("only root can become another user");
        return;
    }
    let files = tempfile::tempdir().expect("a folder");
    let leo = public_executable(&files);
    let state = files.path().join("state");
    fs::create_dir(&state).and_then(|()| chown(&state, Some(USER), Some(USER))).expect("ours");
    // No process has this number.
    let left = Path::new("/dev/shm").join(format!("leo-{}", 4_000_000_000 + std::process::id()));
    fs::create_dir(&left).expect("makes");
    fs::write(left.join("emergency-stop"), "a hand is in the arm\n").expect("writes");
    for path in [&left, &left.join("emergency-stop")] {
        chown(path, Some(USER), Some(USER)).expect("ours");
    }
    let leo = |arguments: &[&str]| {
        let user = USER.to_string();
        let mut command = Command::new("/usr/bin/setpriv");
        command.args(["--reuid", &user, "--regid", &user, "--clear-groups", "env"]);
        command.arg(format!("XDG_STATE_HOME={}", state.display())).arg(&leo);
        run(command.args(arguments))
    };
    let (status, _, err) = leo(&["run", "--for", "0.1"]);
    assert_eq!(status, Some(0), "{err}");
    assert!(err.contains("(a hand is in the arm)"), "{err}");
    assert!(left.join("emergency-stop").exists(), "nobody released it");
    let (status, out, err) = leo(&["emergency-stop", "--release"]);
    assert_eq!((status, out), (Some(0), format!("{}: released\n", left.display())), "{err}");
    assert!(!left.exists());
    let (status, _, err) = leo(&["run", "--for", "0.1"]);
    assert!(status == Some(0) && !err.contains("emergency stop"), "{err}");
}

#[test]
fn a_named_robot_is_stopped_before_it_starts() {
    let files = tempfile::tempdir().expect("a folder");
    let leo = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_leo"));
        command.args(arguments);
        let output = command.env("XDG_STATE_HOME", files.path()).stdin(Stdio::null()).output().expect("runs");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let root = format!("/dev/shm/leo-stop-first-{}", std::process::id());
    let (status, out, err) = leo(&["emergency-stop", "--domain", &root, "--reason", "a hand is in the arm"]);
    assert_eq!((status, err.as_str()), (Some(1), ""), "{out}");
    assert!(out.starts_with(&format!("{root}: ")) && out.contains("NOT CONFIRMED"), "{out}");
    insta::assert_snapshot!(redacted(&out, &[(&root, "[domain]")]));
    assert_eq!(fs::read_dir(&root).expect("is there").count(), 1, "there is the stop, and nothing else");
    let (status, _, err) = leo(&["run", "--domain", &root, "--for", "0.1"]);
    assert_eq!(status, Some(0), "{err}");
    assert!(err.contains("(a hand is in the arm)"), "{err}");
    let (status, out, err) = leo(&["emergency-stop", "--release", "--domain", &root]);
    assert_eq!((status, out), (Some(0), format!("{root}: released\n")), "{err}");
    assert!(!Path::new(&root).exists());

    // No robot can run in such a domain.
    let elsewhere = files.path().join("leo-robot");
    let (status, _, err) = leo(&["emergency-stop", "--domain", elsewhere.to_str().expect("text")]);
    assert!(status == Some(2) && err.contains(elsewhere.to_str().expect("text")), "{err}");
    assert!(!elsewhere.exists());
}
