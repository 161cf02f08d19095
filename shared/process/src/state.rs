//! What a robot keeps in its state directory, and where.
//!
//! One policy holds for all of it. A command that will write there refuses to start where it cannot ([`prepare`]): a
//! person is there to hear it. A robot that runs already never stops for it: what cannot be written is told, kept in
//! memory as far as it can be, and tried again.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use folder::{Folder, FolderError};
use rustix::process::geteuid;

/// As much as a file takes at least on a disk, in bytes.
const PROBE: [u8; 4096] = [0; 4096];

/// Why nothing can be kept in a state directory.
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

/// Makes the state directory where it is not there, and makes sure that it can be written, with all that is in it.
///
/// # Errors
///
/// It is a link or no folder, belongs to another user, is open to others, or cannot be written.
pub fn prepare(state: &Path) -> Result<(), StateError> {
    let failed = |reason: String| StateError { state: state.to_owned(), reason };
    let folder = open(state).map_err(|error| failed(error.to_string()))?;
    let in_folder =
        |folder: &Folder, error: io::Error| failed(format!("{}: {error}", folder.path().display()));
    probe(&folder).map_err(|error| in_folder(&folder, error))?;
    for file in [learned(state), page_token(state)] {
        let name = file.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let written = folder.has(name).and_then(|is_there| is_there.then(|| folder.write(name)).transpose());
        written.map_err(|error| failed(format!("{}: {error}", file.display())))?;
    }
    for below in [lessons(state), recordings(state)] {
        match open_there(&below) {
            Ok(folder) => probe(&folder).map_err(|error| in_folder(&folder, error))?,
            Err(error) if error.is_missing() => {}
            Err(error) => return Err(failed(error.to_string())),
        }
    }
    Ok(())
}

/// A folder, which is made where it is not there. Root may work in another user's: for what root does for others.
fn open(path: &Path) -> Result<Folder, FolderError> {
    match Folder::make_all(path) {
        Err(FolderError::OtherOwner { .. }) if geteuid().is_root() => Folder::open_for_root(path),
        opened => opened,
    }
}

fn open_there(path: &Path) -> Result<Folder, FolderError> {
    match Folder::open(path) {
        Err(FolderError::OtherOwner { .. }) if geteuid().is_root() => Folder::open_for_root(path),
        opened => opened,
    }
}

/// Writes a file in a folder, through to the disk, and removes it again.
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

/// The store of what was learned: the first of its two copies. The learner process writes it.
#[must_use]
pub fn learned(state: &Path) -> PathBuf {
    state.join("learned.store")
}

/// The folder of the lessons that were taught by hand. The simulator process writes them.
#[must_use]
pub fn lessons(state: &Path) -> PathBuf {
    state.join("lessons")
}

/// The folder of what was recorded by the page's button, and of the black box. The console process writes there.
#[must_use]
pub fn recordings(state: &Path) -> PathBuf {
    state.join("recordings")
}

/// What pages on other machines have to know. The console process writes it.
#[must_use]
pub fn page_token(state: &Path) -> PathBuf {
    state.join("page_token")
}
