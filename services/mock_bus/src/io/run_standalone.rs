use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};

use budget::Lines;
use clock::Duration;
use config::SettingsError;
use config::motor::{Device, Motor};
use servo::mock::FaultSpec;

use crate::{Faults, MockBuses, MockBusesError, parse};

/// Polling interval for commands and for changes of the fault file.
const POLL_INTERVAL: Duration = Duration::from_millis(100);
/// Maximum length of a line of standard input, in bytes.
const COMMAND_BYTES: usize = 64 << 10;

/// The settings of mock buses that run without a robot.
#[derive(Clone, Debug)]
pub struct StandaloneOptions {
    /// The faults from the start.
    pub faults: Faults,
    /// A file with further faults; it is reloaded when it changes.
    pub file: Option<PathBuf>,
}

/// Why the mock buses cannot start or continue.
#[derive(Debug, thiserror::Error)]
pub enum StandaloneError {
    /// No bus uses the mock device.
    #[error(
        "no bus of motor.toml has the device \"mock\", so there is no bus to simulate; set the device of a bus to \
         \"mock\""
    )]
    NoMock,
    /// The fault file is invalid.
    #[error(transparent)]
    File(#[from] SettingsError),
    /// A bus cannot be started.
    #[error(transparent)]
    MockBuses(#[from] MockBusesError),
    /// The output cannot be written.
    #[error("cannot print: {0}")]
    Print(#[from] std::io::Error),
}

/// Runs the mock buses of a robot, with links in `folder`, until `stop` is set. Prints their locations to `out`, takes
/// commands from standard input, and reloads the fault file when it changes.
///
/// # Errors
///
/// There is no mock bus, a bus cannot be started, the fault file is invalid at the start, or `out` cannot be written.
pub fn run_standalone(
    robot: &Motor,
    folder: &Path,
    options: &StandaloneOptions,
    stop: &AtomicBool,
    out: &mut impl Write,
) -> Result<(), StandaloneError> {
    if !robot.buses.iter().any(|bus| bus.device == Device::Mock) {
        return Err(StandaloneError::NoMock);
    }
    let mut control = Control::new(robot, options)?;
    let faults = Faults { injections: control.all(), ..options.faults.clone() };
    let ptys = MockBuses::with_faults(robot, folder, false, &faults)?;
    for (bus, link) in ptys.links() {
        writeln!(out, "{}", describe(robot, bus, link, faults.seed))?;
    }
    out.flush()?;
    let commands = listen();
    while !stop.load(Ordering::Relaxed) {
        clock::sleep_until(clock::now() + POLL_INTERVAL);
        let mut said = control.poll_file();
        // The end of standard input does not end the program.
        while let Ok(command) = commands.try_recv() {
            said.extend(control.execute(&command, &ptys));
        }
        if std::mem::take(&mut control.changed) {
            ptys.inject(&control.all());
        }
        for line in said {
            writeln!(out, "{line}")?;
        }
        out.flush()?;
    }
    Ok(())
}

/// A line about a bus: its name, its link, its baud rate, its servos and the seed.
fn describe(robot: &Motor, bus: &str, link: &Path, seed: u64) -> String {
    let index = robot.buses.iter().position(|each| each.name == bus);
    let baud = robot.buses.iter().find(|each| each.name == bus).map_or(0, |bus| bus.baud);
    let mut models: BTreeMap<&str, Vec<u8>> = BTreeMap::new();
    for joint in robot.joints.iter().filter(|joint| Some(joint.bus) == index) {
        models.entry(joint.model.name()).or_default().push(joint.id);
    }
    let servos: Vec<String> =
        models.into_iter().map(|(model, ids)| format!("{model} id {}", ranges(ids))).collect();
    format!("{bus}  {}  {baud} baud  {}  seed {seed}", link.display(), servos.join(", "))
}

/// IDs as ranges: `1-3,7`.
fn ranges(mut ids: Vec<u8>) -> String {
    ids.sort_unstable();
    let runs = ids.chunk_by(|one, next| one.checked_add(1) == Some(*next));
    let run = |run: &[u8]| match run {
        [first, .., last] => format!("{first}-{last}"),
        run => run.first().map(u8::to_string).unwrap_or_default(),
    };
    runs.map(run).collect::<Vec<_>>().join(",")
}

/// Reads the lines of standard input in a thread.
fn listen() -> Receiver<String> {
    let (tell, commands) = channel();
    // The thread blocks on standard input until the process ends.
    let _listener = std::thread::Builder::new().name("commands".to_owned()).spawn(move || {
        let mut lines = Lines::new(std::io::stdin().lock(), "command", COMMAND_BYTES);
        while let Ok(Some(line)) = lines.next_line() {
            if tell.send(String::from_utf8_lossy(line).into_owned()).is_err() {
                return;
            }
        }
    });
    commands
}

/// The enabled faults and their origin: commands or the file.
struct Control<'a> {
    robot: &'a Motor,
    commanded: Vec<FaultSpec>,
    file: Option<&'a Path>,
    /// The file at the previous poll; a file that just changed may be incomplete.
    seen: Option<String>,
    /// The content that was loaded last, valid or not.
    text: Option<String>,
    from_file: Vec<FaultSpec>,
    changed: bool,
}

impl<'a> Control<'a> {
    fn new(robot: &'a Motor, options: &'a StandaloneOptions) -> Result<Self, StandaloneError> {
        let file = options.file.as_deref();
        let mut control = Self {
            robot,
            commanded: options.faults.injections.clone(),
            file,
            seen: None,
            text: None,
            from_file: Vec::new(),
            changed: false,
        };
        if let Some(file) = file {
            control.text = budget::text(file).ok();
            control.from_file = control.read(file)?;
        }
        Ok(control)
    }

    fn read(&self, file: &Path) -> Result<Vec<FaultSpec>, SettingsError> {
        config::faults::load(file, |words| parse(words, self.robot))
    }

    fn all(&self) -> Vec<FaultSpec> {
        self.commanded.iter().chain(&self.from_file).cloned().collect()
    }

    /// Reloads the file once it has changed and then stayed the same for one poll. Returns the lines to print.
    fn poll_file(&mut self) -> Vec<String> {
        let Some(file) = self.file else { return Vec::new() };
        let text = budget::text(file).ok();
        let is_written = text == self.seen;
        self.seen.clone_from(&text);
        if !is_written || text == self.text {
            return Vec::new();
        }
        self.text = text;
        match self.read(file) {
            Ok(from_file) => {
                let said = format!("{}: {} faults", file.display(), from_file.len());
                (self.from_file, self.changed) = (from_file, true);
                vec![said]
            }
            Err(error) => vec![format!("{error}; the faults are unchanged")],
        }
    }

    /// Executes a command line. Returns the lines to print.
    fn execute(&mut self, command: &str, ptys: &MockBuses) -> Vec<String> {
        let (word, rest) = command.trim().split_once(char::is_whitespace).unwrap_or((command.trim(), ""));
        match word {
            "" => Vec::new(),
            "fault" => match parse(rest, self.robot) {
                Ok(injection) => {
                    self.commanded.push(injection);
                    self.changed = true;
                    vec![format!("on: {}", rest.trim())]
                }
                Err(error) => vec![error.to_string()],
            },
            "clear" => {
                self.commanded.clear();
                self.from_file.clear();
                self.changed = true;
                vec!["no faults".to_owned()]
            }
            "list" => self.list(ptys),
            _ => vec![format!("`{word}` is not a command: use `fault KIND ..`, `clear` or `list`")],
        }
    }

    /// Lists the enabled faults, and the counters of injected faults per bus.
    fn list(&self, ptys: &MockBuses) -> Vec<String> {
        let on = self.commanded.iter().chain(&self.from_file).map(|injection| format!("on: {injection}"));
        let happened = ptys.injected().map(|(bus, injected)| {
            let counts = injected.iter().filter(|(_, count)| *count > 0);
            let counts: Vec<String> =
                counts.map(|(kind, count)| format!("{} {count}", kind.name())).collect();
            format!(
                "{bus}: {}",
                if counts.is_empty() { "nothing happened".to_owned() } else { counts.join(", ") }
            )
        });
        on.chain(happened).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_are_printed_as_ranges() {
        assert_eq!(ranges(vec![7, 1, 2, 3]), "1-3,7");
        assert_eq!(ranges(vec![252]), "252");
        assert_eq!(ranges(Vec::new()), "");
    }
}
