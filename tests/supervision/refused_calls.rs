use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread;

use super::robot::{MAX_WAIT, domain, leo, wait_until};
use testkit::robot::{is_alive, left_behind};

/// System calls of the supervisor, the injected error, and the numbers of the failing calls. The first
/// `mmap`, `read` and `close` calls are the loader's. If a run makes fewer calls, none fails.
const REFUSED: [(&str, &str, &[u32]); 16] = [
    ("openat", "EMFILE", &[6, 40, 65, 121]),
    ("mmap", "ENOMEM", &[25, 31, 42]),
    ("write", "ENOSPC", &[1, 3, 6, 20]),
    ("clone3", "EAGAIN", &[1, 2, 3, 4, 6, 9]),
    ("ftruncate", "ENOSPC", &[1, 3, 5]),
    ("mkdir", "ENOSPC", &[1, 2, 9, 11]),
    ("fchmod", "EPERM", &[1, 4, 30]),
    ("fsync", "EIO", &[1, 4, 6, 12]),
    ("rename", "EIO", &[1]),
    ("unlink", "EIO", &[1, 30]),
    ("pidfd_open", "EMFILE", &[1, 5]),
    ("socketpair", "EMFILE", &[1]),
    ("socket", "EMFILE", &[1]),
    ("bind", "EADDRINUSE", &[1]),
    ("read", "EIO", &[6, 800]),
    ("ppoll", "EINTR", &[3, 30]),
];
/// Number of parallel robots.
const STREAMS: usize = 3;

#[test]
fn any_refused_system_call_leaves_a_running_robot_or_a_reason() {
    let is_there = Command::new("strace").arg("--version").stdout(Stdio::null()).status().is_ok();
    if !is_there {
        skip::skip("strace is needed to refuse system calls");
        return;
    }
    let all: Vec<(&str, &str, u32)> = REFUSED
        .iter()
        .flat_map(|(call, error, numbers)| numbers.iter().map(move |number| (*call, *error, *number)))
        .collect();
    let wrong: Vec<String> = thread::scope(|scope| {
        let streams: Vec<_> = (0..STREAMS)
            .map(|stream| {
                let own = all.iter().skip(stream).step_by(STREAMS);
                scope.spawn(move || {
                    own.filter_map(|(call, error, number)| refuse(call, error, *number)).collect()
                })
            })
            .collect();
        let ended = streams.into_iter().map(|stream| stream.join().expect("a stream does not panic"));
        ended.collect::<Vec<Vec<String>>>().concat()
    });
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), all.len(), wrong.join("\n"));
}

/// Runs a robot briefly with one failing system call; returns what went wrong.
fn refuse(call: &str, error: &str, number: u32) -> Option<String> {
    let files = tempfile::tempdir().expect("a folder");
    let config = files.path().join("leo.toml");
    let text = config::Robot::leo_text_with(&[]).replace("\"127.0.0.1:7780\"", "\"none\"");
    fs::write(&config, text).expect("writes");
    let domain: PathBuf = domain(&format!("refused-{}-{number}", call.replace('_', "-")));
    let mut robot = Command::new("strace")
        .args([
            "-qq",
            "-e",
            &format!("trace={call}"),
            "-e",
            &format!("inject={call}:error={error}:when={number}"),
        ])
        .arg("-o")
        .arg(files.path().join("calls"))
        .arg(leo(&[]).get_program())
        .args(["run", "--for", "0.5", "--config"])
        .arg(&config)
        .arg("--domain")
        .arg(&domain)
        .env("XDG_STATE_HOME", files.path())
        .env_remove("RUST_LOG")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(fs::File::create(files.path().join("said")).expect("writes"))
        .spawn()
        .expect("starts");
    let tracer = robot.id().to_string();
    let children = || {
        let of =
            |pid: &str| fs::read_to_string(format!("/proc/{pid}/task/{pid}/children")).unwrap_or_default();
        let supervisor = of(&tracer);
        of(supervisor.trim()).split_whitespace().filter_map(|pid| pid.parse().ok()).collect::<Vec<i32>>()
    };
    let end = clock::now() + MAX_WAIT;
    let (mut known, mut status) = (Vec::new(), None);
    while status.is_none() && clock::now() < end {
        known = Some(children()).filter(|children| !children.is_empty()).unwrap_or(known);
        status = robot.try_wait().expect("ours");
        clock::sleep_until(clock::now() + clock::Duration::from_millis(10));
    }
    let _dead = robot.kill().and_then(|()| robot.wait());
    let said = fs::read_to_string(files.path().join("said")).unwrap_or_default();
    let is_clean = wait_until(|| left_behind(&domain).is_empty() && !known.iter().any(|pid| is_alive(*pid)));
    let is_told = match status.and_then(|status| status.code()) {
        Some(0) => true,
        Some(1 | 2) => said.lines().any(|line| line.contains("leo: ")),
        _ => false,
    };
    let is_well = is_told && is_clean && !said.contains("panicked");
    (!is_well).then(|| {
        let left = left_behind(&domain);
        format!("{call} number {number} is refused with {error}: {status:?}, left are {left:?}: {said}")
    })
}
