use std::io::ErrorKind;
use std::path::PathBuf;

/// Why a file of what was learned could not be opened.
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
    /// It was written by an older version, and no copy could be kept of it. It is as it was.
    #[error("{}: the learned tasks are of an older version, and cannot be copied before they are taken over: {source}: make room, or allow writing beside the file", path.display())]
    Copy {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
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
    /// Its folder could not be made.
    #[error("{}: the folder for the learned tasks cannot be made: {source}", path.display())]
    Folder {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// It could not be read or made.
    #[error("{}: the learned tasks cannot be opened: {source}: {}", path.display(), advice(source))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the database said.
        source: Box<redb::Error>,
    },
}

/// What helps where the file cannot be opened.
fn advice(error: &redb::Error) -> &'static str {
    let kind = if let redb::Error::Io(error) = error { Some(error.kind()) } else { None };
    match kind {
        Some(ErrorKind::StorageFull | ErrorKind::QuotaExceeded) => {
            "make room on its disk, or use another state directory"
        }
        Some(ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem) => {
            "allow this user to read and write it, or use another state directory"
        }
        _ => "restore the file, or move it away to begin anew",
    }
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
    /// The file could not be read.
    #[error("{}: the learned tasks cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the database said.
        source: Box<redb::Error>,
    },
    /// An entry is not what it should be.
    #[error("{}: the entry {key:?} is no learned task: {source}: forget it to go on without", path.display())]
    Entry {
        /// The file.
        path: PathBuf,
        /// The entry's key.
        key: String,
        /// Where in the entry, and why.
        source: serde_json::Error,
    },
}

/// Why an entry could not be written. The file is as it was.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file could not be written.
    #[error("{}: the learned tasks cannot be written: {source}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the database said.
        source: Box<redb::Error>,
    },
    /// The value has no JSON form.
    #[error("the entry {key:?} cannot be written: {source}")]
    Entry {
        /// The entry's key.
        key: String,
        /// Why.
        source: serde_json::Error,
    },
}
