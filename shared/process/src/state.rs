//! Layout of a robot's state directory.
//!
//! The same policy holds for all of it. A command that will write there refuses to start if it cannot ([`prepare`]),
//! because then a person sees the error. A running robot never stops for it: a write error is reported, the data is
//! kept in memory as far as possible, and the write is retried.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use folder::{Folder, FolderError};
use rustix::fs::{Access, AtFlags, CWD, accessat};
use rustix::process::geteuid;

/// Data written by the probe, in bytes: at least one block of a file system.
const PROBE: [u8; 4096] = [0; 4096];

/// Error: the state directory is not usable.
#[derive(Debug, thiserror::Error)]
#[error(
    "nothing can be kept in the state directory {}: {reason}; make it writable for this user, make room on its disk, or \
     name another one with XDG_STATE_HOME",
    state.display()
)]
pub struct StateError {
    state: PathBuf,
    reason: String,
}

/// Creates the state directory if necessary, and checks that it and its content are writable.
///
/// # Errors
///
/// It is a symbolic link or not a folder, belongs to another user, is accessible to others, or cannot be written.
pub fn prepare(state: &Path) -> Result<(), StateError> {
    let failed = |reason: String| StateError { state: state.to_owned(), reason };
    let folder = opened(state, Folder::make_all(state)).map_err(|error| failed(error.to_string()))?;
    let in_folder =
        |folder: &Folder, error: io::Error| failed(format!("{}: {error}", folder.path().display()));
    probe(&folder).map_err(|error| in_folder(&folder, error))?;
    for file in [learned(state), page_token(state)] {
        let name = file.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let written =
            folder.has(name).and_then(|is_there| is_there.then(|| folder.open_for_writing(name)).transpose());
        written.map_err(|error| failed(format!("{}: {error}", file.display())))?;
    }
    for below in [lessons(state), recordings(state)] {
        match opened(&below, Folder::open(&below)) {
            Ok(folder) => probe(&folder).map_err(|error| in_folder(&folder, error))?,
            Err(error) if error.is_missing() => {}
            Err(error) => return Err(failed(error.to_string())),
        }
    }
    Ok(())
}

/// Whether this user may create files in a state directory, or the directory itself. Creates nothing.
///
/// # Errors
///
/// The directory, or the nearest one above it that exists, is not writable for this user.
pub fn check_writable(state: &Path) -> Result<(), StateError> {
    let Some(there) = state.ancestors().find(|folder| folder.exists()) else { return Ok(()) };
    let access = accessat(CWD, there, Access::WRITE_OK | Access::EXEC_OK, AtFlags::EACCESS);
    access.map_err(|error| StateError {
        state: state.to_owned(),
        reason: format!("{}: {}", there.display(), io::Error::from(error)),
    })
}

/// An opened folder. Root may use another user's folder, to act on that user's behalf.
fn opened(path: &Path, opened: Result<Folder, FolderError>) -> Result<Folder, FolderError> {
    match opened {
        Err(FolderError::OtherOwner { .. }) if geteuid().is_root() => Folder::open_for_root(path),
        opened => opened,
    }
}

/// Writes a file to a folder, syncs it to disk, and removes it again.
fn probe(folder: &Folder) -> io::Result<()> {
    let name = format!(".probe-{}", std::process::id());
    let _left_by_a_killed_process = folder.remove(&name);
    let written = folder.create(&name).and_then(|mut file| {
        file.write_all(&PROBE)?;
        file.sync_all()
    });
    let _gone = folder.remove(&name);
    written
}

/// The first of the two copies of the learner's memory. Writer: the learner process.
#[must_use]
pub fn learned(state: &Path) -> PathBuf {
    state.join("learned.store")
}

/// Folder of the lessons taught interactively. Writer: the simulator process.
#[must_use]
pub fn lessons(state: &Path) -> PathBuf {
    state.join("lessons")
}

/// Folder of the page's recordings and the black box's dumps. Writer: the console process.
#[must_use]
pub fn recordings(state: &Path) -> PathBuf {
    state.join("recordings")
}

/// File with the access token for pages on other machines. Writer: the console process.
#[must_use]
pub fn page_token(state: &Path) -> PathBuf {
    state.join("page_token")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_messages_match_the_snapshot() {
        let error = StateError { state: "/home/a/leo".into(), reason: "it is no folder".to_owned() };
        insta::assert_snapshot!(error);
    }
}
