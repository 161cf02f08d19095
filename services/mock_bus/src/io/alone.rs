use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};

use budget::Lines;
use clock::Duration;
use config::ConfigError;
use config::motor::{Device, Model, Motor};
use servo::mock::Injection;

use crate::{Faults, Ptys, PtysError, parse};

/// How often it looks whether it was told something.
const LOOK: Duration = Duration::from_millis(100);
/// The longest line of standard input that is read, in bytes.
const COMMAND_BYTES: usize = 64 << 10;

/// Mock buses without a robot: what goes wrong on them.
#[derive(Clone, Debug)]
pub struct Alone {
    /// What goes wrong from the beginning.
    pub faults: Faults,
    /// A file of more faults, which is read again when it changes.
    pub file: Option<PathBuf>,
}

/// Why mock buses cannot be put up or go on.
#[derive(Debug, thiserror::Error)]
pub enum AloneError {
    /// There is nothing to put up.
    #[error(
        "no bus of motor.toml has the device \"mock\", so that there is nothing to put up; give one that device"
    )]
    NoMock,
    /// The file of faults is refused.
    #[error(transparent)]
    File(#[from] ConfigError),
    /// A bus cannot be put up.
    #[error(transparent)]
    Ptys(#[from] PtysError),
    /// Nobody takes what is printed.
    #[error("cannot print: {0}")]
    Print(#[from] std::io::Error),
}

/// Puts up the mock buses of a robot, with links in `folder`, and answers on them until `stop`. Says
/// on `out` where they are; takes commands on standard input, and reads the file of faults again
/// when it changes.
///
/// # Errors
///
/// There is no mock bus, one cannot be put up, the file of faults is refused at the beginning, or
/// nobody takes what is said.
pub fn alone(
    robot: &Motor,
    folder: &Path,
    orders: &Alone,
    stop: &AtomicBool,
    out: &mut impl Write,
) -> Result<(), AloneError> {
    if !robot.buses.iter().any(|bus| bus.device == Device::Mock) {
        return Err(AloneError::NoMock);
    }
    let mut control = Control::new(robot, orders)?;
    let faults = Faults { injections: control.all(), ..orders.faults.clone() };
    let ptys = Ptys::with_faults(robot, folder, false, &faults)?;
    for (bus, link) in ptys.links() {
        writeln!(out, "{}", describe(robot, bus, link, faults.seed))?;
    }
    out.flush()?;
    let commands = listen();
    while !stop.load(Ordering::Relaxed) {
        clock::sleep_until(clock::now() + LOOK);
        let mut said = control.look();
        // Whoever has nothing more to say has not said that it shall end.
        while let Ok(command) = commands.try_recv() {
            said.extend(control.obey(&command, &ptys));
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

/// One line about a bus: its name, where it is, its speed, its servos and the seed.
fn describe(robot: &Motor, bus: &str, link: &Path, seed: u64) -> String {
    let place = robot.buses.iter().position(|each| each.name == bus);
    let baud = robot.buses.iter().find(|each| each.name == bus).map_or(0, |bus| bus.baud);
    let mut models: BTreeMap<&str, Vec<u8>> = BTreeMap::new();
    for joint in robot.joints.iter().filter(|joint| Some(joint.bus) == place) {
        let model = match joint.model {
            Model::Xm430W350 => "XM430-W350",
            Model::Xl330M288 => "XL330-M288",
        };
        models.entry(model).or_default().push(joint.id);
    }
    let servos: Vec<String> =
        models.into_iter().map(|(model, ids)| format!("{model} id {}", ranges(ids))).collect();
    format!("{bus}  {}  {baud} baud  {}  seed {seed}", link.display(), servos.join(", "))
}

/// Identifiers as one would say them: `1-3,7`.
fn ranges(mut ids: Vec<u8>) -> String {
    ids.sort_unstable();
    let runs = ids.chunk_by(|one, next| one.checked_add(1) == Some(*next));
    let run = |run: &[u8]| match run {
        [first, .., last] => format!("{first}-{last}"),
        run => run.first().map(u8::to_string).unwrap_or_default(),
    };
    runs.map(run).collect::<Vec<_>>().join(",")
}

/// The lines of standard input, as they come.
fn listen() -> Receiver<String> {
    let (tell, commands) = channel();
    // It waits for a line for ever, and ends with the process.
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

/// Which faults are on, and who switched them.
struct Control<'a> {
    robot: &'a Motor,
    told: Vec<Injection>,
    file: Option<&'a Path>,
    /// The file at the last look: it may be half written.
    seen: Option<String>,
    /// The file as it was when it was read last, whether it was taken or not.
    text: Option<String>,
    filed: Vec<Injection>,
    changed: bool,
}

impl<'a> Control<'a> {
    fn new(robot: &'a Motor, orders: &'a Alone) -> Result<Self, AloneError> {
        let file = orders.file.as_deref();
        let mut control = Self {
            robot,
            told: orders.faults.injections.clone(),
            file,
            seen: None,
            text: None,
            filed: Vec::new(),
            changed: false,
        };
        if let Some(file) = file {
            control.text = budget::text(file).ok();
            control.filed = control.read(file)?;
        }
        Ok(control)
    }

    fn read(&self, file: &Path) -> Result<Vec<Injection>, ConfigError> {
        config::faults::load(file, |words| parse(words, self.robot))
    }

    fn all(&self) -> Vec<Injection> {
        self.told.iter().chain(&self.filed).cloned().collect()
    }

    /// Reads the file again when it has changed, and changes no more: what to say of it.
    fn look(&mut self) -> Vec<String> {
        let Some(file) = self.file else { return Vec::new() };
        let text = budget::text(file).ok();
        let is_written = text == self.seen;
        self.seen.clone_from(&text);
        if !is_written || text == self.text {
            return Vec::new();
        }
        self.text = text;
        match self.read(file) {
            Ok(filed) => {
                let said = format!("{}: {} faults", file.display(), filed.len());
                (self.filed, self.changed) = (filed, true);
                vec![said]
            }
            Err(error) => vec![format!("{error}; the faults stay as they were")],
        }
    }

    /// Does what a line of standard input says: what to say to it.
    fn obey(&mut self, command: &str, ptys: &Ptys) -> Vec<String> {
        let (word, rest) = command.trim().split_once(char::is_whitespace).unwrap_or((command.trim(), ""));
        match word {
            "" => Vec::new(),
            "fault" => match parse(rest, self.robot) {
                Ok(injection) => {
                    self.told.push(injection);
                    self.changed = true;
                    vec![format!("on: {}", rest.trim())]
                }
                Err(bad) => vec![bad.to_string()],
            },
            "clear" => {
                self.told.clear();
                self.filed.clear();
                self.changed = true;
                vec!["no faults".to_owned()]
            }
            "list" => self.list(ptys),
            _ => vec![format!("`{word}` is no command: say `fault KIND ..`, `clear` or `list`")],
        }
    }

    /// The faults that are on, and how often each kind happened on each bus.
    fn list(&self, ptys: &Ptys) -> Vec<String> {
        let on = self.told.iter().chain(&self.filed).map(|injection| format!("on: {injection}"));
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
    fn identifiers_are_said_as_runs() {
        assert_eq!(ranges(vec![7, 1, 2, 3]), "1-3,7");
        assert_eq!(ranges(vec![252]), "252");
        assert_eq!(ranges(Vec::new()), "");
    }
}
