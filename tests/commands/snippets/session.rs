//! A reader's session: a folder like a fresh clone, in which the commands of one document run in order.

use std::fs::{self, File};
use std::os::unix::fs::symlink;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};

use clock::Duration;
use rustix::process::{Pid, Signal, kill_process_group};
use tempfile::TempDir;
use testkit::robot::wait_until;

use super::documents;
use super::shell::is_assignment;
use super::trial::Trial;
use crate::harness::read;

/// Generous: a debug build on a busy machine.
const MAX_WAIT: Duration = Duration::from_secs(120);
/// What the documents need of the repository.
const CLONED: [&str; 3] = ["config", "docs/examples", "package"];
/// The lessons of the documents, which take a minute of the robot's time. A short lesson takes their place.
const LONG_LESSONS: [&str; 2] = ["config/lessons/task1.toml", "config/lessons/task3.toml"];

pub(super) struct Session {
    /// What runs in the reader's other terminals. It ends before its folder is removed.
    terminals: Vec<Terminal>,
    folder: TempDir,
    /// The variables that earlier lines have set.
    variables: String,
    /// What a document names by an example, and its name here.
    names: Vec<(String, String)>,
}

/// A program in a terminal of its own. Dropping it presses Ctrl-C.
struct Terminal {
    child: Child,
    line: String,
    output: PathBuf,
}

impl Session {
    /// A folder with what a clone has. `python` is the interpreter of the virtual environment of the document.
    pub(super) fn new(python: Option<&Path>) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        for name in CLONED {
            copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join(name), &folder.path().join(name));
        }
        for lesson in LONG_LESSONS {
            fs::write(folder.path().join(lesson), short_lesson()).expect("writes");
        }
        if let Some(python) = python {
            let environment = python.ancestors().nth(2).expect("it is in `bin`");
            symlink(environment, folder.path().join("venv")).expect("links");
        }
        let mut session = Self { terminals: Vec::new(), folder, variables: String::new(), names: Vec::new() };
        // The robots of this machine must not meet.
        for robot in ["bench", "camera"] {
            let name = format!("/dev/shm/leo-{robot}");
            session.rename(&name, format!("{name}-{}", std::process::id()));
        }
        session
    }

    /// Writes a file that the document shows or takes for granted.
    pub(super) fn write(&self, name: &str, text: &str) {
        fs::write(self.folder.path().join(name), text).expect("writes");
    }

    /// Replaces words of a file, as the document tells.
    pub(super) fn edit(&self, name: &str, from: &str, to: &str) {
        self.expect_in(name, from);
        self.write(name, &self.read(name).replacen(from, to, 1));
    }

    /// Appends to a file, as the document tells.
    pub(super) fn append(&self, name: &str, text: &str) {
        self.write(name, &(self.read(name) + text));
    }

    /// Expects words in a file.
    pub(super) fn expect_in(&self, name: &str, words: &str) {
        assert!(self.read(name).contains(words), "{name} does not contain {words}");
    }

    pub(super) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.folder.path().join(name)).expect("reads")
    }

    /// Gives something that the document names by an example its name here.
    pub(super) fn rename(&mut self, from: &str, to: String) {
        self.names.push((from.to_owned(), to));
    }

    /// The text with the names of this session.
    pub(super) fn named(&self, text: &str) -> String {
        self.names.iter().fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
    }

    /// What the programs in the other terminals have printed.
    pub(super) fn said(&self) -> String {
        self.terminals.iter().map(Terminal::said).collect()
    }

    /// Runs a line as its trial says.
    pub(super) fn run(&mut self, line: &str, trial: &Trial) {
        let text = self.named(line);
        if is_assignment(&text) {
            self.variables.push_str(&text);
            self.variables.push('\n');
            return;
        }
        match *trial {
            Trial::Ends => {
                let (status, output, errors) = self.output(&text);
                assert!(status.success() && errors.is_empty(), "`{text}`: {status}: {output}{errors}");
            }
            Trial::Says(words) => {
                let (status, output, errors) = self.output(&text);
                let says = output.contains(words) || errors.contains(words);
                assert!(status.success() && says, "`{text}`: {status}, {words:?}: {output}{errors}");
            }
            Trial::Fails(words) => {
                let (status, output, errors) = self.output(&text);
                let is_refused = !status.success() && errors.contains(words);
                assert!(is_refused && errors.lines().count() == 1, "`{text}`: {status}: {output}{errors}");
            }
            Trial::Stays(words) => {
                let mut terminal = self.open(&text);
                terminal.wait_for(words);
                self.terminals.push(terminal);
            }
            Trial::Interrupted(words) => {
                let mut terminal = self.open(&text);
                terminal.wait_for(words);
                terminal.end();
            }
            Trial::NotRun(_) => {}
        }
    }

    /// Ends what runs in the other terminals, the newest first.
    pub(super) fn end(mut self) {
        while let Some(mut terminal) = self.terminals.pop() {
            terminal.end();
        }
    }

    fn command(&self, script: &str) -> Command {
        let leo = PathBuf::from(env!("CARGO_BIN_EXE_leo"));
        let path = format!("{}:/usr/local/bin:/usr/bin:/bin", leo.parent().expect("a folder").display());
        let mut command = Command::new("sh");
        command.arg("-ec").arg(format!("{}{script}", self.variables)).current_dir(self.folder.path());
        command.env_clear().env("PATH", path).env("XDG_STATE_HOME", self.folder.path().join("state"));
        command.stdin(Stdio::null());
        command
    }

    /// Runs a script to its end: its exit status, its output, and what it wrote to standard error.
    fn output(&self, script: &str) -> (ExitStatus, String, String) {
        let output = self.command(script).output().expect("starts");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status, text(&output.stdout), text(&output.stderr))
    }

    /// Starts a program in a terminal of its own. The shell becomes the program, so its exit status is the program's.
    fn open(&self, line: &str) -> Terminal {
        let output = self.folder.path().join(format!("terminal-{}", self.terminals.len()));
        let file = File::create(&output).expect("makes a file");
        let mut command = self.command(&format!("exec {line}"));
        command.stderr(file.try_clone().expect("the same file")).stdout(file).process_group(0);
        Terminal { child: command.spawn().expect("starts"), line: line.to_owned(), output }
    }
}

impl Terminal {
    fn said(&self) -> String {
        String::from_utf8_lossy(&fs::read(&self.output).expect("reads")).into_owned()
    }

    fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("is ours").is_some()
    }

    fn wait_for(&mut self, words: &str) {
        let mut is_said = false;
        let is_over = wait_until(MAX_WAIT, || {
            let has_ended = self.has_ended();
            is_said = self.said().contains(words);
            is_said || has_ended
        });
        assert!(is_over && is_said, "`{}` does not say {words:?}: {}", self.line, self.said());
    }

    /// Presses Ctrl-C.
    fn interrupt(&self) {
        let group = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        let _sent = group.map(|group| kill_process_group(group, Signal::INT));
    }

    /// Presses Ctrl-C, and waits for an orderly end.
    fn end(&mut self) {
        self.interrupt();
        let ended = wait_until(MAX_WAIT, || self.has_ended());
        let status = self.child.try_wait().expect("is ours");
        assert!(
            ended && status.is_some_and(|status| status.success()),
            "`{}`: {status:?}: {}",
            self.line,
            self.said()
        );
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        if !self.has_ended() {
            self.interrupt();
            if !wait_until(MAX_WAIT, || self.has_ended()) {
                let _dead = self.child.kill().and_then(|()| self.child.wait());
            }
        }
    }
}

/// The lesson of docs/lessons.md without its performance: four seconds.
fn short_lesson() -> String {
    let blocks = documents::blocks(&read("docs/lessons.md"));
    let lesson =
        blocks.iter().find(|block| block.name.as_deref() == Some("my-lesson.toml")).expect("a lesson");
    lesson.text.split("[novel]").next().expect("a demonstration").to_owned()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("makes");
    for entry in fs::read_dir(from).expect("a folder") {
        let entry = entry.expect("an entry");
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), &target).expect("copies");
        }
    }
}
