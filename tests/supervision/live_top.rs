//! `leo top` on a pseudo-terminal that the test types into and reads.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt as _;
use std::process::{Child, Command};
use std::sync::{Arc, Mutex};
use std::thread;

use rustix::fs::{Mode, OFlags, open};
use rustix::process::Signal;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcgetattr, tcsetwinsize};

use crate::robot::{Robot, signal, wait_until};

/// A program on a terminal of 80 columns.
struct OnTerminal {
    program: Child,
    keys: File,
    line: OwnedFd,
    seen: Arc<Mutex<String>>,
}

impl OnTerminal {
    fn start(mut command: Command) -> Self {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
        grantpt(&master).and_then(|()| unlockpt(&master)).expect("ours");
        let name = ptsname(&master, Vec::new()).expect("a name");
        let line = open(&name, OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).expect("opens");
        let size = Winsize { ws_row: 24, ws_col: 80, ws_xpixel: 0, ws_ypixel: 0 };
        tcsetwinsize(&line, size).expect("takes a size");
        let end = || line.try_clone().expect("a descriptor");
        command.stdin(end()).stdout(end()).stderr(end()).env("TERM", "xterm").process_group(0);
        let program = command.spawn().expect("starts");
        let mut screen = File::from(master);
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
    let mut command = Command::new(env!("CARGO_BIN_EXE_leo"));
    command.args(["top", "--domain"]).arg(robot.domain());
    let mut top = OnTerminal::start(command);
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
    let mut status = None;
    wait_until(|| {
        status = top.program.try_wait().expect("ours");
        status.is_some()
    });
    assert!(status.is_some_and(|status| status.success()), "{status:?}\n{}", top.seen());
    assert!(wait_until(|| top.seen().contains("\x1b[?1049l")), "the alternate screen stays");
    assert_eq!(tcgetattr(&top.line).expect("a terminal").local_modes, before);
    robot.stop(Signal::TERM);
}

#[test]
fn leo_top_ends_in_order_after_a_terminal_hang_up() {
    let robot = Robot::ready("hung-up", &[]);
    let mut command = Command::new(env!("CARGO_BIN_EXE_leo"));
    command.args(["top", "--domain"]).arg(robot.domain());
    let mut top = OnTerminal::start(command);
    assert!(wait_until(|| top.seen().contains("mock-bus")), "{}", top.seen());
    signal(i32::try_from(top.program.id()).expect("a process number"), Signal::HUP);
    let mut status = None;
    wait_until(|| {
        status = top.program.try_wait().expect("ours");
        status.is_some()
    });
    assert!(status.is_some_and(|status| status.success()), "{status:?}\n{}", top.seen());
    robot.stop(Signal::TERM);
}
