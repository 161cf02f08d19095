//! The report of the trials: a TOML file that is extended after each trial. Strings and lists of strings are written
//! as JSON, which TOML reads.

use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde_json::json;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::{FormatTime as _, SystemTime};

use super::outcome::Outcome;
use super::trials::Trial;
use crate::bus::selection::BusSelection;
use crate::failure::CommandError;

/// Maximum number of reports created in the same second.
const SAME_SECOND: u32 = 100;

/// The report file.
pub(super) struct Report {
    path: PathBuf,
    file: File,
    /// Each completed trial with its result.
    ended: Vec<(&'static str, &'static str)>,
}

impl Report {
    /// Creates a new file in `folder`, named by the date. Existing files are never overwritten.
    pub(super) fn create(folder: &Path, selection: &BusSelection<'_>) -> Result<Self, CommandError> {
        let begun = now();
        let date = begun.replace('T', "-").replace([':', 'Z'], "");
        for count in 1..=SAME_SECOND {
            let again = if count == 1 { String::new() } else { format!("-{count}") };
            let path = folder.join(format!("commission-{date}{again}.toml"));
            match File::create_new(&path) {
                Ok(file) => {
                    let mut report = Self { path, file, ended: Vec::new() };
                    let buses: Vec<_> = selection.buses().iter().map(|bus| bus.name.as_str()).collect();
                    report.write(&format!(
                        "# What `leo bus commission` tried, expected and measured.\nleo = {}\nbegun = {begun}\nbuses = {}\n",
                        json!(env!("CARGO_PKG_VERSION")),
                        json!(buses)
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
            json!(trial.name),
            json!(bus),
            json!(trial.tries),
            json!(trial.expects),
            json!(outcome.measured.notes),
            json!(outcome.measured.wrong),
            json!(outcome.word)
        );
        self.write(&text)
    }

    /// Appends the final state of a bus.
    pub(super) fn end_of_bus(&mut self, bus: &str, torque: &str) -> Result<(), CommandError> {
        self.write(&format!("\n[[left]]\nbus = {}\ntorque = {}\n", json!(bus), json!(torque)))
    }

    /// Appends the summary.
    pub(super) fn conclude(&mut self, interrupted: bool, left: &[&str]) -> Result<(), CommandError> {
        let all = self.count(Outcome::PASSED) == self.ended.len() && left.is_empty() && !interrupted;
        let text = format!(
            "\n[end]\npassed = {}\nfailed = {}\nskipped = {}\nnot_tried = {}\ninterrupted = {interrupted}\ncomplete = {all}\n",
            self.count(Outcome::PASSED),
            self.count(Outcome::FAILED),
            self.count(Outcome::SKIPPED),
            json!(left)
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

/// The current time in UTC, in the format of TOML: that of the log, without fractions of seconds.
fn now() -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = SystemTime.format_time(&mut Writer::new(&mut text));
    text.split('.').next().unwrap_or_default().to_owned() + "Z"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_of_a_report_has_the_format_of_toml() {
        let shape: String =
            now().chars().map(|letter| if letter.is_ascii_digit() { '0' } else { letter }).collect();
        assert_eq!(shape, "0000-00-00T00:00:00Z");
    }
}
