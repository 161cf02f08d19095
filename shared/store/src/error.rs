use std::io::{self, ErrorKind};
use std::path::PathBuf;

use folder::FolderError;

/// The error when a store cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// Another process has it open.
    #[error("{}: another Leo has the learned tasks open: stop it first, or use another state \
             directory", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// It has another version.
    #[error("{}: the learned tasks have schema version {found}, this Leo knows version {known}: use the Leo that wrote \
             them, or another state directory", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// The version of the store.
        found: u64,
        /// The current version of this code.
        known: u64,
    },
    /// The database of Leo before 0.1 is beside it.
    #[error("{}: tasks learned by a version of Leo before 0.1 cannot be read: move the file away, or use another state \
             directory", path.display())]
    Database {
        /// The database.
        path: PathBuf,
    },
    /// Its directory could not be created, or is accessible to other users.
    #[error("the folder for the learned tasks cannot be made or opened: {source}")]
    Folder {
        /// The directory and the reason.
        source: FolderError,
    },
    /// It could not be read.
    #[error("{}: the learned tasks cannot be opened: {source}: {}", path.display(), advice(source))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        source: io::Error,
    },
    /// It could not be created or repaired. Existing files are unchanged.
    #[error("{}: the learned tasks cannot be written: {source}: {}", path.display(), advice(source))]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        source: io::Error,
    },
}

/// Whether the disk or the quota is full.
pub(crate) fn is_full(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded)
}

/// The advice for the user.
fn advice(error: &io::Error) -> &'static str {
    if is_full(error) {
        return "make room on its disk, or use another state directory";
    }
    let is_refused = matches!(error.kind(), ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem);
    if is_refused {
        return "allow this user to read and write it, or use another state directory";
    }
    "check its disk for faults, or use another state directory"
}

/// The error when a store cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// It could not be read.
    #[error("{}: the learned tasks cannot be read: {source}: {}", path.display(), advice(source))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        source: io::Error,
    },
    /// Another version changed it after it was opened.
    #[error("{}: the learned tasks have schema version {found} now: use the Leo that wrote them", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// The version of the store.
        found: u64,
    },
    /// An entry does not have the expected type.
    #[error("{}: the entry {key:?} is no learned task: {source}: use the Leo that wrote it, or another state \
             directory", path.display())]
    Entry {
        /// The file.
        path: PathBuf,
        /// The entry's key.
        key: String,
        /// The position in the entry, and the reason.
        source: serde_json::Error,
    },
}

/// The error when an entry cannot be written. The entry is unchanged; after a disk error it may also have the new
/// value.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file could not be written.
    #[error("{}: the learned tasks cannot be written: {source}: {}", path.display(), advice(source))]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        source: io::Error,
    },
    /// The store must be repaired before a write, and the repair failed.
    #[error(transparent)]
    RepairFailed(#[from] Box<OpenError>),
    /// The current contents could not be read.
    #[error(transparent)]
    Unreadable(#[from] ReadError),
    /// The value cannot be serialised as JSON.
    #[error("the entry {key:?} cannot be written: {source}")]
    Entry {
        /// The entry's key.
        key: String,
        /// The reason.
        source: serde_json::Error,
    },
}
