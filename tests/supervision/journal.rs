//! Log priorities for the systemd journal, as in sd-daemon(3).

use std::fs::{self, File};
use std::io::Read as _;
use std::os::fd::OwnedFd;
use std::os::unix::fs::MetadataExt as _;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::Command;

use crate::robot::{domain, leo};

/// The reader of standard error.
#[derive(Clone, Copy)]
enum Listener {
    /// The journal, as announced by `JOURNAL_STREAM`.
    Journal,
    /// Another reader, although the parent's standard error was the journal.
    Other,
    /// No announcement.
    Unnamed,
}

/// The lines that a command and its children write to standard error and output.
fn heard(mut leo: Command, listener: Listener) -> Vec<String> {
    let (mut ours, theirs) = UnixStream::pair().expect("a socket");
    let theirs = File::from(OwnedFd::from(theirs));
    let about = theirs.metadata().expect("is open");
    match listener {
        Listener::Journal => leo.env("JOURNAL_STREAM", format!("{}:{}", about.dev(), about.ino())),
        Listener::Other => leo.env("JOURNAL_STREAM", format!("{}:{}", about.dev(), about.ino() + 1)),
        Listener::Unnamed => leo.env_remove("JOURNAL_STREAM"),
    };
    leo.stdout(theirs.try_clone().expect("is open")).stderr(theirs);
    let mut child = leo.spawn().expect("starts");
    // It holds a copy of the children's end.
    drop(leo);
    let mut said = String::new();
    ours.read_to_string(&mut said).expect("is text");
    child.wait().expect("was started");
    said.lines().map(str::to_owned).collect()
}

/// A short-lived robot with a missing adapter.
fn robot(files: &Path, name: &str) -> Command {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    let copy = |file: &str| fs::read_to_string(config.join(file)).expect("reads");
    fs::write(files.join("leo.toml"), copy("leo.toml")).expect("writes");
    let lacking = copy("motor.toml").replacen("device = \"mock\"", "device = \"/dev/nowhere\"", 1);
    fs::write(files.join("motor.toml"), lacking).expect("writes");
    let mut command = leo(&["-v", "run", "--for", "1", "--domain"]);
    command.arg(domain(name)).arg("--config").arg(files.join("leo.toml")).env("XDG_STATE_HOME", files);
    command
}

fn is_marked(line: &str) -> bool {
    ["<3>", "<4>", "<6>", "<7>"].iter().any(|mark| line.starts_with(mark))
}

#[test]
fn the_journal_gets_the_priority_of_every_line() {
    let files = tempfile::tempdir().expect("a folder");
    let heard = heard(robot(files.path(), "urgent"), Listener::Journal);
    let says = |begin: &str, what: &str| {
        assert!(heard.iter().any(|line| line.starts_with(begin) && line.contains(what)), "{heard:#?}");
    };
    // The supervisor, and a child.
    says("<6> INFO ", "the robot runs");
    says("<4> WARN ", "cannot open /dev/nowhere");
    says("<7>DEBUG ", "ended");
    // Lines on standard output have no priority prefix; the journal's default is right for them.
    let unmarked: Vec<&String> = heard.iter().filter(|line| !is_marked(line)).collect();
    assert!(unmarked.iter().all(|line| !line.contains("WARN") && !line.contains("DEBUG")), "{unmarked:#?}");
}

#[test]
fn only_the_journal_gets_line_priorities() {
    for (listener, name) in [(Listener::Other, "other"), (Listener::Unnamed, "unnamed")] {
        let files = tempfile::tempdir().expect("a folder");
        let heard = heard(robot(files.path(), name), listener);
        assert!(heard.iter().any(|line| line.contains("cannot open /dev/nowhere")), "{heard:#?}");
        assert!(!heard.iter().any(|line| is_marked(line)), "{heard:#?}");
    }
}

#[test]
fn a_json_document_for_the_journal_has_line_priorities() {
    let files = tempfile::tempdir().expect("a folder");
    let mut robot = robot(files.path(), "documents");
    robot.arg("--log-json");
    let heard = heard(robot, Listener::Journal);
    // The supervisor, and a child.
    for (what, mark, level) in
        [("the robot runs", "<6>", "INFO"), ("cannot open /dev/nowhere", "<4>", "WARN")]
    {
        let line = heard.iter().find(|line| line.contains(what)).expect("is said");
        let document = line.strip_prefix(mark).expect("is marked");
        let document: serde_json::Value = serde_json::from_str(document).expect("is JSON");
        assert_eq!(document["level"], level);
    }
}

#[test]
fn the_error_of_a_command_has_the_error_priority() {
    let files = tempfile::tempdir().expect("a folder");
    let config = files.path().join("leo.toml");
    fs::write(&config, "[buffers]\nobjects = many\n").expect("writes");
    for (listener, marks) in [(Listener::Journal, true), (Listener::Unnamed, false)] {
        let mut leo = leo(&["run", "--config"]);
        leo.arg(&config);
        let heard = heard(leo, listener);
        assert!(!heard.is_empty());
        assert!(heard.iter().all(|line| line.starts_with("<3>") == marks), "{heard:#?}");
    }
}
