use std::io::{BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};

use rustix::process::{Pid, Signal, kill_process};

/// A `leo mock-bus` started as by a user; dropping it ends it.
pub(crate) struct MockBus {
    process: Child,
    commands: ChildStdin,
    said: BufReader<ChildStdout>,
    buses: Vec<(String, PathBuf)>,
}

/// Number of buses of the built-in robot.
const BUSES: usize = 5;

impl MockBus {
    /// Starts it and waits until it has printed its buses.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_leo"))
            .arg("mock-bus")
            .args(arguments)
            .env_remove("RUST_LOG")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("starts");
        let commands = process.stdin.take().expect("piped");
        let mut said = BufReader::new(process.stdout.take().expect("piped"));
        let buses = (0..BUSES).map(|_| {
            let line = line(&mut said);
            let mut words = line.split_whitespace();
            let (name, path) = (words.next().expect("a name"), words.next().expect("a path"));
            (name.to_owned(), path.into())
        });
        let buses = buses.collect();
        Self { process, commands, said, buses }
    }

    /// The path of a bus.
    pub(crate) fn path(&self, bus: &str) -> &Path {
        let found = self.buses.iter().find(|(name, _)| name == bus);
        &found.expect("a bus of the robot").1
    }

    /// Writes a command to its standard input and returns the answer line.
    pub(crate) fn tell(&mut self, command: &str) -> String {
        writeln!(self.commands, "{command}").expect("it listens");
        line(&mut self.said)
    }

    /// The next line of its output.
    pub(crate) fn next_line(&mut self) -> String {
        line(&mut self.said)
    }

    /// Sends Ctrl-C and waits for its end.
    pub(crate) fn stop(mut self) -> ExitStatus {
        self.press().expect("it ends")
    }

    /// Kills it and waits for its end.
    pub(crate) fn kill(mut self) {
        self.process.kill().expect("it runs");
        let _killed = self.process.wait().expect("it ends");
    }

    fn press(&mut self) -> std::io::Result<ExitStatus> {
        let id = i32::try_from(self.process.id()).ok().and_then(Pid::from_raw);
        // The PID of an ended process may have been reused.
        if let (None, Some(id)) = (self.process.try_wait()?, id) {
            kill_process(id, Signal::INT)?;
        }
        self.process.wait()
    }
}

fn line(said: &mut impl std::io::BufRead) -> String {
    let mut line = String::new();
    said.read_line(&mut line).expect("it says something");
    line.trim_end().to_owned()
}

impl Drop for MockBus {
    fn drop(&mut self) {
        let _ended = self.press();
    }
}
