use std::io::{self, ErrorKind};
use std::path::PathBuf;

use folder::FolderError;

/// Why what was learned could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// Another process has it open.
    #[error("{}: another Leo has the learned tasks open: stop it first, or use another state directory", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// It was written by another version.
    #[error("{}: the learned tasks have schema version {found}, this Leo knows version {known}: use the Leo that wrote them, or another state directory", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u64,
        /// The version that this code knows.
        known: u64,
    },
    /// It was written by an older version, and what it holds could not be taken over. It is as it was.
    #[error("{}: the learned tasks of version {from} cannot be taken over: {source}: use the Leo that wrote them, or another state directory", path.display())]
    Migration {
        /// The file.
        path: PathBuf,
        /// The version from which it could not be brought to the next.
        from: u64,
        /// What is wrong with it.
        source: MigrationError,
    },
    /// Its folder could not be made, or is not this user's alone.
    #[error("the folder for the learned tasks cannot be made or opened: {source}")]
    Folder {
        /// Which one, and why.
        source: FolderError,
    },
    /// It could not be read.
    #[error("{}: the learned tasks cannot be opened: {source}: {}", path.display(), advice(source))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// It could not be made or mended. What was there is as it was.
    #[error("{}: the learned tasks cannot be written: {source}: {}", path.display(), advice(source))]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// Whether there is no room.
pub(crate) fn is_full(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded)
}

/// What helps.
fn advice(error: &io::Error) -> &'static str {
    if is_full(error) {
        return "make room on its disk, or use another state directory";
    }
    let is_refused = matches!(error.kind(), ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem);
    if is_refused {
        return "allow this user to read and write it, or use another state directory";
    }
    "look whether its disk is sound, or use another state directory"
}

/// Why an entry of an older version could not be brought to the next.
#[derive(Debug, thiserror::Error)]
#[error("the entry {key:?}: {reason}")]
pub struct MigrationError {
    /// The entry's key.
    pub key: String,
    /// What is wrong with it.
    pub reason: String,
}

/// Why what was learned could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// It could not be read.
    #[error("{}: the learned tasks cannot be read: {source}: {}", path.display(), advice(source))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Another version wrote it since it was opened.
    #[error("{}: the learned tasks have schema version {found} now: use the Leo that wrote them", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u64,
    },
    /// An entry is not what it should be.
    #[error("{}: the entry {key:?} is no learned task: {source}: use the Leo that wrote it, or another state directory", path.display())]
    Entry {
        /// The file.
        path: PathBuf,
        /// The entry's key.
        key: String,
        /// Where in the entry, and why.
        source: serde_json::Error,
    },
}

/// Why an entry could not be written. It is as it was; after an error of the disk it may also be as it should become.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file could not be written.
    #[error("{}: the learned tasks cannot be written: {source}: {}", path.display(), advice(source))]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The store could not be mended, as is needed before anything is written.
    #[error(transparent)]
    Unmended(#[from] Box<OpenError>),
    /// What is there could not be looked at.
    #[error(transparent)]
    Unreadable(#[from] ReadError),
    /// The value has no JSON form.
    #[error("the entry {key:?} cannot be written: {source}")]
    Entry {
        /// The entry's key.
        key: String,
        /// Why.
        source: serde_json::Error,
    },
}
