//! Applies changes to the machine, and reverts them.

use std::io::{self, Write};

use crate::readiness::{Change, System};

/// Journal of the changes made since the machine booted, used to revert them. Like the changes themselves, it does
/// not survive a reboot.
const JOURNAL: &str = "/run/leo-check.json";

/// Error while applying or reverting changes.
#[derive(Debug, thiserror::Error)]
pub enum ApplyError {
    /// The journal cannot be written, so nothing was changed.
    #[error(
        "cannot write {JOURNAL}, the list of changes to revert, so nothing is changed: {0}; run it as root: `sudo leo \
         check`"
    )]
    Journal(io::Error),
    /// The journal is damaged.
    #[error(
        "{JOURNAL} cannot be read as a list of changes ({0}): restart the machine, which reverts all of them"
    )]
    Damaged(serde_json::Error),
    /// Nothing was changed before.
    #[error("there is nothing to revert: {JOURNAL} does not exist")]
    Nothing,
    /// Some files rejected the new value.
    #[error("the machine refused {0} of {1} changes, with the errors above")]
    Refused(usize, usize),
    /// The report cannot be written.
    #[error("cannot write the report: {0}")]
    Write(io::Error),
}

/// Applies changes, and reports each with its inverse. Each is recorded in the journal before it is made.
///
/// # Errors
///
/// The journal cannot be written, or the machine rejected a change. The other changes are made.
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
        writeln!(out, "nothing needs to be changed").map_err(ApplyError::Write)?;
    } else {
        writeln!(
            out,
            "`leo check --revert` reverts all of these changes, and so does a restart of the machine\n"
        )
        .map_err(ApplyError::Write)?;
    }
    if refused == 0 { Ok(()) } else { Err(ApplyError::Refused(refused, changes.len())) }
}

/// Reverts the recorded changes, the last one first.
///
/// # Errors
///
/// Nothing was applied, or the machine rejected a change. Rejected changes stay in the journal.
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

/// Makes and reports one change; returns whether the machine accepted it.
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
