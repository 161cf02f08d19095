use std::fs::{self, File};
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use clock::Duration;
use rustix::process::{Pid, Signal, kill_process, kill_process_group};
use tempfile::TempDir;

/// Generous: the whole study takes five minutes in a debug build on a slow machine.
const MAX_WAIT: Duration = Duration::from_secs(900);

/// Output and exit status of a command; no status if a signal ended it.
#[derive(Debug)]
pub(crate) struct CommandOutput {
    pub(crate) status: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

/// A running `leo` command in its own process group; dropping it kills it.
pub(crate) struct Leo {
    child: Child,
    files: TempDir,
}

/// A `leo` command with an empty environment and its own state directory.
pub(crate) fn leo(arguments: &[&str]) -> (Command, TempDir) {
    let files = tempfile::tempdir().expect("a folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_leo"));
    command.args(arguments).current_dir(env!("CARGO_MANIFEST_DIR"));
    command.env_clear().env("XDG_STATE_HOME", files.path()).stdin(Stdio::null());
    (command, files)
}

/// Runs a `leo` command to its end.
pub(crate) fn run_leo(arguments: &[&str]) -> CommandOutput {
    let (command, files) = leo(arguments);
    Leo::start(command, files).end()
}

/// Writes a file and returns its path.
pub(crate) fn write(folder: &TempDir, name: &str, text: &str) -> String {
    let file = folder.path().join(name);
    fs::write(&file, text).expect("writes");
    file.display().to_string()
}

/// A text for a snapshot: each path, and everything else that differs from run to run, is replaced by its name.
pub(crate) fn redacted(text: &str, hidden: &[(&str, &str)]) -> String {
    hidden.iter().fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
}

/// Reads a file of the repository.
pub(crate) fn read(file: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).expect("reads")
}

/// The study's lesson cut down to its first demonstration, without a performance.
pub(crate) fn short_lesson() -> String {
    read("config/lessons/task1.toml").split("# The second demonstration").next().expect("a half").to_owned()
}

/// Waits until a condition holds; `false` on time-out.
pub(crate) fn wait_until(holds: impl FnMut() -> bool) -> bool {
    testkit::robot::wait_until(MAX_WAIT, holds)
}

impl Leo {
    pub(crate) fn start(mut command: Command, files: TempDir) -> Self {
        fs::set_permissions(files.path(), fs::Permissions::from_mode(0o777)).expect("is ours");
        let file = |name: &str| File::create(files.path().join(name)).expect("makes a file");
        command.stdout(file("out")).stderr(file("err")).process_group(0);
        Self { child: command.spawn().expect("starts"), files }
    }

    /// Its output so far.
    pub(crate) fn said(&self, stream: &str) -> String {
        fs::read_to_string(self.files.path().join(stream)).expect("reads")
    }

    /// Waits for its end and checks that it left nothing behind.
    pub(crate) fn end(mut self) -> CommandOutput {
        let mut status = None;
        let ended = wait_until(|| {
            status = self.child.try_wait().expect("is ours");
            status.is_some()
        });
        assert!(ended, "it does not end\n{}\n{}", self.said("out"), self.said("err"));
        let told = CommandOutput {
            status: status.and_then(|status| status.code()),
            out: self.said("out"),
            err: self.said("err"),
        };
        assert_eq!(self.left_behind(), [""; 0], "{told:?}");
        assert!(self.processes().is_empty(), "{:?} live on\n{told:?}", self.processes());
        told
    }

    /// The folder of the supervisor's domain.
    pub(crate) fn domain(&self) -> PathBuf {
        format!("/dev/shm/leo-{}", self.child.id()).into()
    }

    /// Kills it; its files are kept.
    pub(crate) fn kill(mut self) {
        self.child.kill().and_then(|()| self.child.wait()).expect("is ours");
    }

    /// Sends Ctrl-C.
    pub(crate) fn interrupt(&self) {
        kill_process_group(self.pid(), Signal::INT).expect("lives");
    }

    /// Sends a signal to one of the robot's processes, once it runs.
    pub(crate) fn signal(&self, process: &str, signal: Signal) {
        let find = || self.processes().into_iter().find(|(_, name)| name == process);
        assert!(wait_until(|| find().is_some()), "`{process}` is not started\n{}", self.said("err"));
        let (pid, _) = find().expect("lives");
        kill_process(Pid::from_raw(pid).expect("a process number"), signal).expect("lives");
    }

    /// The robot's processes, found by their domain.
    pub(crate) fn processes(&self) -> Vec<(i32, String)> {
        let domain = format!("/dev/shm/leo-{}", self.child.id());
        let mut found = Vec::new();
        for entry in fs::read_dir("/proc").expect("is there").flatten() {
            let Ok(pid) = entry.file_name().to_string_lossy().parse() else { continue };
            let Ok(line) = fs::read_to_string(entry.path().join("cmdline")) else { continue };
            let words: Vec<&str> = line.split('\0').collect();
            if words.contains(&domain.as_str()) {
                found.push((pid, words.get(1).copied().unwrap_or_default().to_owned()));
            }
        }
        found
    }

    fn left_behind(&self) -> Vec<String> {
        let name = format!("leo-{}", self.child.id());
        let entries = fs::read_dir("/dev/shm").expect("there is shared memory").flatten();
        entries
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .filter(|entry| *entry == name || entry.starts_with(&format!("{name}_")))
            .collect()
    }

    fn pid(&self) -> Pid {
        i32::try_from(self.child.id()).ok().and_then(Pid::from_raw).expect("a process number")
    }
}

impl Drop for Leo {
    fn drop(&mut self) {
        let _dead = self.child.kill().and_then(|()| self.child.wait());
    }
}

/// A copy of the executable that every user may run.
pub(crate) fn public_executable(folder: &TempDir) -> PathBuf {
    let file = folder.path().join("leo");
    fs::copy(env!("CARGO_BIN_EXE_leo"), &file).expect("copies");
    for path in [folder.path(), &file] {
        fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("is ours");
    }
    file
}
