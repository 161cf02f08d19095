//! `leo top` on a pseudo-terminal that the test types into and reads.

use std::fs::{self, File};
use std::io::{Read as _, Write as _};
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt as _;
use std::process::{Child, Command, ExitStatus};
use std::sync::{Arc, Mutex};
use std::thread;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::process::Signal;
use rustix::termios::tcgetattr;
use testkit::robot::{is_alive, processes_of};
use testkit::terminal::terminal;

use crate::robot::{MAX_WAIT, Robot, signal, wait_until};

/// A program on a terminal of 80 columns.
struct OnTerminal {
    program: Child,
    keys: File,
    line: OwnedFd,
    seen: Arc<Mutex<String>>,
}

/// Starts a program on a terminal.
fn start_on(line: &OwnedFd, mut command: Command) -> Child {
    let end = || line.try_clone().expect("a descriptor");
    command.stdin(end()).stdout(end()).stderr(end()).env("TERM", "xterm").spawn().expect("starts")
}

/// `leo top` of a robot, started by `words`.
fn top_of(robot: &Robot, words: &[&str]) -> Command {
    let words = [words, &[env!("CARGO_BIN_EXE_leo"), "top", "--domain"]].concat();
    let (program, arguments) = words.split_first().expect("some");
    let mut command = Command::new(program);
    command.args(arguments).arg(robot.domain());
    command
}

/// Reads a screen until a word is drawn.
fn read_until(screen: &mut File, word: &str) {
    let until = clock::now() + MAX_WAIT;
    let mut seen = Vec::new();
    let mut bytes = [0; 4096];
    loop {
        let text = String::from_utf8_lossy(&seen).into_owned();
        if text.contains(word) {
            return;
        }
        let rest = Timespec::try_from(until.since(clock::now())).expect("a minute");
        let fd = PollFd::new(&*screen, PollFlags::IN);
        let is_drawn = poll(&mut [fd], Some(&rest)).expect("works") > 0;
        assert!(is_drawn, "`{word}` is not drawn\n{text}");
        let count = screen.read(&mut bytes).expect("the terminal is there");
        seen.extend_from_slice(bytes.get(..count).unwrap_or(&[]));
    }
}

/// The status of a program that ends by itself.
fn ended(program: &mut Child) -> Option<ExitStatus> {
    let mut status = None;
    wait_until(|| {
        status = program.try_wait().expect("ours");
        status.is_some()
    });
    if status.is_none() {
        program.kill().and_then(|()| program.wait()).expect("ours");
    }
    status
}

/// Whether a terminal takes no more output.
fn is_full(line: &OwnedFd) -> bool {
    let fd = PollFd::new(line, PollFlags::OUT);
    poll(&mut [fd], Some(&Timespec::default())).expect("works") == 0
}

fn pid(program: &Child) -> i32 {
    i32::try_from(program.id()).expect("a process number")
}

impl OnTerminal {
    fn start(mut command: Command) -> Self {
        let (mut screen, line) = terminal().expect("a pseudo-terminal");
        command.process_group(0);
        let program = start_on(&line, command);
        let keys = screen.try_clone().expect("a descriptor");
        let seen = Arc::new(Mutex::new(String::new()));
        let writer = Arc::clone(&seen);
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count) = screen.read(&mut bytes) {
                let text = String::from_utf8_lossy(bytes.get(..count).unwrap_or(&[])).into_owned();
                writer.lock().expect("nobody panics with it").push_str(&text);
            }
        });
        Self { program, keys, line, seen }
    }

    /// The output so far.
    fn seen(&self) -> String {
        self.seen.lock().expect("nobody panics with it").clone()
    }

    /// Types keys and waits until words are newly drawn.
    fn press(&mut self, keys: &str, words: &str) {
        let before = self.seen().len();
        self.keys.write_all(keys.as_bytes()).expect("takes it");
        let drawn = wait_until(|| self.seen().get(before..).is_some_and(|new| new.contains(words)));
        assert!(drawn, "`{words}` is not drawn after `{keys}`\n{}", self.seen());
    }
}

#[test]
fn leo_top_handles_its_keys_and_restores_the_terminal() {
    let robot = Robot::ready("terminal", &[]);
    let mut top = OnTerminal::start(top_of(&robot, &[]));
    let before = tcgetattr(&top.line).expect("a terminal").local_modes;
    assert!(wait_until(|| top.seen().contains("mock-bus")), "{}", top.seen());
    assert!(top.seen().contains("\x1b[?1049h"), "not on the alternate screen\n{}", top.seen());
    assert_ne!(tcgetattr(&top.line).expect("a terminal").local_modes, before, "keys are echoed");
    // Only changes are drawn, so each word must be new on the screen.
    top.press("?", "Ctrl-C");
    top.press("b", "requests");
    top.press("j", "joints");
    top.press("h", "execution:");
    top.press("\x1b", "wake50");
    top.press(" ", "FROZEN");
    top.press(" s", "p99");
    top.keys.write_all(b"q").expect("takes it");
    let status = ended(&mut top.program);
    assert!(status.is_some_and(|status| status.success()), "{status:?}\n{}", top.seen());
    assert!(wait_until(|| top.seen().contains("\x1b[?1049l")), "the alternate screen stays");
    assert_eq!(tcgetattr(&top.line).expect("a terminal").local_modes, before);
    robot.stop(Signal::TERM);
}

#[test]
fn leo_top_ends_in_order_after_a_terminal_hang_up() {
    let robot = Robot::ready("hung-up", &[]);
    let mut top = OnTerminal::start(top_of(&robot, &[]));
    assert!(wait_until(|| top.seen().contains("mock-bus")), "{}", top.seen());
    signal(pid(&top.program), Signal::HUP);
    let status = ended(&mut top.program);
    assert!(status.is_some_and(|status| status.success()), "{status:?}\n{}", top.seen());
    // The signal counts even if the parent ignored it.
    let (mut screen, line) = terminal().expect("a pseudo-terminal");
    let ignores_hang_up = ["sh", "-c", "trap '' HUP; exec \"$@\"", "sh"];
    let mut top = start_on(&line, top_of(&robot, &ignores_hang_up));
    read_until(&mut screen, "mock-bus");
    signal(pid(&top), Signal::HUP);
    let status = ended(&mut top);
    assert!(status.is_some_and(|status| status.success()), "{status:?}");
    // The terminal is closed: as the controlling one, with its signal; and without a signal.
    let launchers: [&[&str]; 2] = [&["setsid", "--ctty"], &["setsid"]];
    for launcher in launchers {
        let (mut screen, line) = terminal().expect("a pseudo-terminal");
        let mut top = start_on(&line, top_of(&robot, launcher));
        read_until(&mut screen, "mock-bus");
        drop((screen, line));
        let status = ended(&mut top);
        assert!(status.is_some_and(|status| status.success()), "{launcher:?}: {status:?}");
    }
    robot.stop(Signal::TERM);
}

#[test]
fn leo_top_draws_on_a_non_blocking_terminal() {
    let robot = Robot::ready("non-blocking", &[]);
    let (mut screen, line) = terminal().expect("a pseudo-terminal");
    let flags = fcntl_getfl(&line).expect("flags");
    fcntl_setfl(&line, flags | OFlags::NONBLOCK).expect("takes them");
    let mut top = start_on(&line, top_of(&robot, &[]));
    read_until(&mut screen, "mock-bus");
    let filled = wait_until(|| {
        screen.write_all(b"bjh\x1b").expect("takes keys");
        is_full(&line)
    });
    assert!(filled, "the terminal takes any amount of output");
    // It continues once the terminal is read again.
    screen.write_all(b"?").expect("takes keys");
    read_until(&mut screen, "Ctrl-C");
    assert!(top.try_wait().expect("ours").is_none(), "ended");
    signal(pid(&top), Signal::TERM);
    let status = ended(&mut top);
    assert!(status.is_some_and(|status| status.success()), "{status:?}");
    robot.stop(Signal::TERM);
}

#[test]
fn leo_top_ends_on_a_signal_as_a_job_in_the_background() {
    let robot = Robot::ready("background", &[]);
    // A job that is started in the background stops there, and a job that is stopped in the foreground is there then.
    for (script, is_started_there) in
        [("\"$@\" & read line", true), ("\"$@\"; echo is stopped; read line", false)]
    {
        let (mut screen, line) = terminal().expect("a pseudo-terminal");
        let mut shell = start_on(&line, top_of(&robot, &["setsid", "--ctty", "sh", "-mc", script, "sh"]));
        if !is_started_there {
            read_until(&mut screen, "mock-bus");
        }
        let mut job = None;
        let is_there = wait_until(|| {
            job = processes_of(pid(&shell)).get("top").copied();
            job.is_some()
        });
        assert!(is_there, "{script}: no `leo top`");
        let job = job.expect("is there");
        if !is_started_there {
            signal(job, Signal::STOP);
            read_until(&mut screen, "is stopped");
        }
        let stat = || fs::read_to_string(format!("/proc/{job}/stat")).unwrap_or_default();
        assert!(wait_until(|| stat().contains(") T ")), "{script}: it does not stop: {}", stat());
        for kind in [Signal::TERM, Signal::CONT] {
            signal(job, kind);
        }
        assert!(wait_until(|| !is_alive(job)), "{script}: it does not end: {}", stat());
        if !is_started_there {
            read_until(&mut screen, "\x1b[?1049l");
        }
        screen.write_all(b"\n").expect("takes keys");
        assert!(ended(&mut shell).is_some(), "{script}: the shell waits");
    }
    robot.stop(Signal::TERM);
}

#[test]
fn leo_top_restores_the_terminal_on_a_signal_at_any_moment() {
    let robot = Robot::ready("signalled", &[]);
    let moments = ["", "\x1b", "\x1b[?1049h", "process", "mock-bus"];
    let kinds = [Signal::TERM, Signal::INT, Signal::QUIT];
    let cases = moments.into_iter().flat_map(|moment| kinds.map(|kind| (moment, kind)));
    // Before it watches for signals, SIGQUIT writes a core file, and a shell's job in the background ignores SIGINT.
    for (moment, kind) in cases.filter(|(moment, kind)| !moment.is_empty() || *kind == Signal::TERM) {
        let (mut screen, line) = terminal().expect("a pseudo-terminal");
        let before = tcgetattr(&line).expect("a terminal").local_modes;
        let mut top = start_on(&line, top_of(&robot, &[]));
        read_until(&mut screen, moment);
        signal(pid(&top), kind);
        let status = ended(&mut top).expect("ends");
        // Before it watches for signals, a signal ends it in the usual way.
        assert!(status.success() || moment.is_empty(), "{moment:?}, {kind:?}: {status}");
        assert_eq!(tcgetattr(&line).expect("a terminal").local_modes, before, "{moment:?}, {kind:?}");
    }
    // A terminal that is not read takes no more output after some frames.
    let (mut screen, line) = terminal().expect("a pseudo-terminal");
    let before = tcgetattr(&line).expect("a terminal").local_modes;
    let mut top = start_on(&line, top_of(&robot, &[]));
    read_until(&mut screen, "mock-bus");
    let filled = wait_until(|| {
        screen.write_all(b"bjh\x1b").expect("takes keys");
        is_full(&line)
    });
    assert!(filled, "the terminal takes any amount of output");
    signal(pid(&top), Signal::TERM);
    let status = ended(&mut top);
    assert!(status.is_some_and(|status| status.success()), "{status:?}");
    assert_eq!(tcgetattr(&line).expect("a terminal").local_modes, before);
    robot.stop(Signal::TERM);
}
