//! Changing the machine, and taking it back.

use std::io::{self, Write};

use crate::readiness::{Change, System};

/// What was changed since the machine started, to be taken back. It lies where nothing outlives the
/// next start, as the changes do not.
const JOURNAL: &str = "/run/leo-check.json";

/// Why the machine is not as was asked for.
#[derive(Debug, thiserror::Error)]
pub enum ApplyError {
    /// What is to be changed cannot be noted, so nothing was.
    #[error(
        "cannot write {JOURNAL}, in which is noted what to take back, so nothing is changed: {0}; run it as root: `sudo leo check`"
    )]
    Journal(io::Error),
    /// The notes are damaged.
    #[error(
        "{JOURNAL} does not say what to take back ({0}): restart the machine, which takes back everything"
    )]
    Damaged(serde_json::Error),
    /// Nothing was changed before.
    #[error("there is nothing to take back: {JOURNAL} is not there")]
    Nothing,
    /// Some files did not take what was written.
    #[error("the machine refused {0} of {1} changes; what it said stands above")]
    Refused(usize, usize),
    /// What was done cannot be said.
    #[error("cannot write what was done: {0}")]
    Write(io::Error),
}

/// Makes changes, and says each with what takes it back. Each is noted before it is made.
///
/// # Errors
///
/// Nothing could be noted, or the machine refused a change; the others are made.
pub(super) fn apply(system: &System, changes: &[Change], out: &mut impl Write) -> Result<(), ApplyError> {
    let mut noted = read(system)?.unwrap_or_default();
    let mut refused = 0;
    for change in changes {
        let known = noted.iter().any(|earlier| earlier.file == change.file);
        if !known {
            noted.push(change.clone());
            write(system, &noted)?;
        }
        if !make(system, change, out)? {
            refused += 1;
            if !known {
                noted.pop();
                write(system, &noted)?;
            }
        }
    }
    if changes.is_empty() {
        writeln!(out, "nothing is to be changed").map_err(ApplyError::Write)?;
    } else {
        writeln!(out, "`leo check --revert` takes all of it back, and so does a restart of the machine\n")
            .map_err(ApplyError::Write)?;
    }
    if refused == 0 { Ok(()) } else { Err(ApplyError::Refused(refused, changes.len())) }
}

/// Takes back what was applied, the last first.
///
/// # Errors
///
/// Nothing was applied, or the machine refused; what it refused stays noted.
pub(super) fn revert(system: &System, out: &mut impl Write) -> Result<(), ApplyError> {
    let noted = read(system)?.ok_or(ApplyError::Nothing)?;
    let mut kept = Vec::new();
    for change in noted.iter().rev() {
        if !make(system, &change.back(), out)? {
            kept.insert(0, change.clone());
        }
    }
    if kept.is_empty() {
        return system.remove(JOURNAL).map_err(ApplyError::Journal);
    }
    write(system, &kept)?;
    Err(ApplyError::Refused(kept.len(), noted.len()))
}

/// Makes one change and says so; whether the machine took it.
fn make(system: &System, change: &Change, out: &mut impl Write) -> Result<bool, ApplyError> {
    let written = system.write(&change.file, &change.to);
    let said = match &written {
        Ok(()) => writeln!(out, "changed  {change}   (back: {})", change.back()),
        Err(error) => writeln!(out, "refused  {change}: {error}"),
    };
    said.map_err(ApplyError::Write)?;
    Ok(written.is_ok())
}

fn read(system: &System) -> Result<Option<Vec<Change>>, ApplyError> {
    let Some(text) = system.read(JOURNAL) else { return Ok(None) };
    serde_json::from_str(&text).map(Some).map_err(ApplyError::Damaged)
}

fn write(system: &System, noted: &[Change]) -> Result<(), ApplyError> {
    let text = serde_json::to_string_pretty(noted).map_err(ApplyError::Damaged)?;
    system.replace(JOURNAL, &text).map_err(ApplyError::Journal)
}
