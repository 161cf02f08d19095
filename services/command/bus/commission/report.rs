//! The report of the trials: a TOML file that is extended after each trial.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::super::CommandError;
use super::super::selection::BusSelection;
use super::bench::Measured;
use super::trials::Trial;

/// Maximum number of reports created in the same second.
const SAME_SECOND: u32 = 100;

/// The result of a trial.
#[derive(Debug)]
pub(super) struct Outcome {
    word: &'static str,
    measured: Measured,
}

impl Outcome {
    pub(super) const PASSED: &'static str = "passed";
    pub(super) const FAILED: &'static str = "failed";
    pub(super) const SKIPPED: &'static str = "skipped";

    /// Derives the result from the measurements.
    pub(super) const fn of(measured: Measured) -> Self {
        let word = if !measured.wrong.is_empty() {
            Self::FAILED
        } else if measured.skipped {
            Self::SKIPPED
        } else {
            Self::PASSED
        };
        Self { word, measured }
    }

    /// The result as text.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        for note in &self.measured.notes {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "  measured: {note}");
        }
        for wrong in &self.measured.wrong {
            let _ = writeln!(text, "  WRONG:    {wrong}");
        }
        let _ = writeln!(
            text,
            "  {}",
            match self.word {
                Self::PASSED => "PASS",
                Self::FAILED => "FAIL",
                _ => "SKIPPED",
            }
        );
        text
    }
}

/// The report file.
pub(super) struct Report {
    path: PathBuf,
    file: File,
    /// Each completed trial with its result.
    ended: Vec<(&'static str, &'static str)>,
}

impl Report {
    /// Creates a new file in `folder`, named by the date. Existing files are never overwritten.
    pub(super) fn create(folder: &Path, place: &BusSelection<'_>) -> Result<Self, CommandError> {
        let date = Date::of(clock::date_s());
        for count in 1..=SAME_SECOND {
            let again = if count == 1 { String::new() } else { format!("-{count}") };
            let path = folder.join(format!("commission-{}{again}.toml", date.name()));
            match File::create_new(&path) {
                Ok(file) => {
                    let mut report = Self { path, file, ended: Vec::new() };
                    let buses: Vec<_> = place.buses().iter().map(|bus| bus.name.clone()).collect();
                    report.write(&format!(
                        "# What `leo bus commission` tried, expected and measured.\nleo = {}\nbegun = {}\nbuses = {}\n",
                        quoted(env!("CARGO_PKG_VERSION")),
                        date.text(),
                        list(&buses)
                    ))?;
                    return Ok(report);
                }
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(error) => {
                    return Err(CommandError::usage(format!("cannot write {}: {error}", path.display())));
                }
            }
        }
        Err(CommandError::runtime(format!("{} is full of reports of this second", folder.display())))
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Number of trials with a result.
    pub(super) fn count(&self, outcome: &str) -> usize {
        self.ended.iter().filter(|(_, ended)| *ended == outcome).count()
    }

    /// Whether a trial was completed.
    pub(super) fn has(&self, trial: &str) -> bool {
        self.ended.iter().any(|(name, _)| *name == trial)
    }

    /// Appends a trial and syncs it to the disk at once: the next trial may cut the power of this machine.
    pub(super) fn add(
        &mut self,
        bus: &str,
        number: usize,
        trial: &Trial,
        outcome: &Outcome,
    ) -> Result<(), CommandError> {
        self.ended.push((trial.name, outcome.word));
        let text = format!(
            "\n[[trial]]\nnumber = {number}\nname = {}\nbus = {}\ntried = {}\nexpected = {}\nmeasured = {}\nwrong = {}\n\
             outcome = {}\n",
            quoted(trial.name),
            quoted(bus),
            quoted(trial.tries),
            quoted(trial.expects),
            list(&outcome.measured.notes),
            list(&outcome.measured.wrong),
            quoted(outcome.word)
        );
        self.write(&text)
    }

    /// Appends the final state of a bus.
    pub(super) fn end_of_bus(&mut self, bus: &str, torque: &str) -> Result<(), CommandError> {
        self.write(&format!("\n[[left]]\nbus = {}\ntorque = {}\n", quoted(bus), quoted(torque)))
    }

    /// Appends the summary.
    pub(super) fn conclude(&mut self, interrupted: bool, left: &[&str]) -> Result<(), CommandError> {
        let left: Vec<_> = left.iter().map(|name| (*name).to_owned()).collect();
        let all = self.count(Outcome::PASSED) == self.ended.len() && left.is_empty() && !interrupted;
        let text = format!(
            "\n[end]\npassed = {}\nfailed = {}\nskipped = {}\nnot_tried = {}\ninterrupted = {interrupted}\ncomplete = {all}\n",
            self.count(Outcome::PASSED),
            self.count(Outcome::FAILED),
            self.count(Outcome::SKIPPED),
            list(&left)
        );
        self.write(&text)
    }

    fn write(&mut self, text: &str) -> Result<(), CommandError> {
        self.file.write_all(text.as_bytes()).and_then(|()| self.file.sync_data()).map_err(|error| {
            CommandError::runtime(format!("cannot write the report {}: {error}", self.path.display()))
        })
    }
}

impl Drop for Report {
    /// Removes an empty report.
    fn drop(&mut self) {
        if self.ended.is_empty() {
            let _removed = fs::remove_file(&self.path);
        }
    }
}

/// A TOML string; its escapes are a superset of JSON's.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn list(texts: &[String]) -> String {
    let texts: Vec<_> = texts.iter().map(|text| quoted(text)).collect();
    format!("[{}]", texts.join(", "))
}

/// An instant in UTC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Date {
    year: u64,
    month: u64,
    day: u64,
    second: u64,
}

impl Date {
    /// Converts seconds since 1970, with the 400-year cycle of years that begin in March.
    const fn of(seconds: u64) -> Self {
        let days = seconds / 86_400 + 719_468;
        let (era, day) = (days / 146_097, days % 146_097);
        let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
        let day = day - (365 * year + year / 4 - year / 100);
        let march = (5 * day + 2) / 153;
        let month = if march < 10 { march + 3 } else { march - 9 };
        let year = year + 400 * era + if month <= 2 { 1 } else { 0 };
        Self { year, month, day: day - (153 * march + 2) / 5 + 1, second: seconds % 86_400 }
    }

    /// The format of file names.
    fn name(self) -> String {
        let Self { year, month, day, second } = self;
        let (hour, minute) = (second / 3600, second / 60 % 60);
        format!("{year}-{month:02}-{day:02}-{hour:02}{minute:02}{:02}", second % 60)
    }

    /// The format of TOML.
    fn text(self) -> String {
        let Self { year, month, day, second } = self;
        let (hour, minute) = (second / 3600, second / 60 % 60);
        format!("{year}-{month:02}-{day:02}T{hour:02}:{minute:02}:{:02}Z", second % 60)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, text) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (1_709_251_199, "2024-02-29T23:59:59Z"),
            (1_795_852_629, "2026-11-28T07:57:09Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(Date::of(seconds).text(), text);
        }
        assert_eq!(Date::of(1_795_852_629).name(), "2026-11-28-075709");
    }
}
