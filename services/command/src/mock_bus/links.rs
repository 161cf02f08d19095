//! The temporary folder with the links to the mock buses of `leo mock-bus`.

use std::fs::{self, File};
use std::io;
use std::path::Path;

use folder::Folder;
use tempfile::TempDir;

/// Prefix of the folders' names.
const PREFIX: &str = "leo-mock-bus-";
/// The lock file in each folder, locked while its creator lives.
const LOCK: &str = "lock";

/// A temporary folder for the links to mock buses, removed when dropped. If its creator was killed, it is removed when
/// this user creates the next one.
#[derive(Debug)]
pub(super) struct LinkFolder {
    folder: TempDir,
    /// The kernel releases the lock when the process ends, however it ends.
    _lock: File,
}

impl LinkFolder {
    /// Creates one in the folder for temporary files, and removes those of dead creators.
    ///
    /// # Errors
    ///
    /// The folder cannot be written.
    pub(super) fn new() -> io::Result<Self> {
        Self::within(&std::env::temp_dir())
    }

    fn within(parent: &Path) -> io::Result<Self> {
        remove_stale(parent);
        let folder = tempfile::Builder::new().prefix(PREFIX).tempdir_in(parent)?;
        // Lock the file before it gets its name, so that an unlocked file always means a dead creator.
        let unnamed = folder.path().join("lock.new");
        let lock = File::create_new(&unnamed)?;
        lock.lock()?;
        fs::rename(unnamed, folder.path().join(LOCK))?;
        Ok(Self { folder, _lock: lock })
    }

    pub(super) fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Removes the folders of killed creators. Ignores errors: a folder may belong to another user.
fn remove_stale(parent: &Path) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        if entry.file_name().to_str().is_some_and(|name| name.starts_with(PREFIX)) {
            let folder = Folder::open(&entry.path()).map_err(io::Error::from);
            let lock = folder.and_then(|folder| folder.open_for_reading(LOCK));
            if lock.is_ok_and(|lock| lock.try_lock().is_ok()) {
                let _gone = fs::remove_dir_all(entry.path());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_folders_of_dead_creators_are_removed() {
        let parent = tempfile::tempdir().unwrap();
        let living = LinkFolder::within(parent.path()).unwrap();
        let killed = LinkFolder::within(parent.path()).unwrap();
        let path = killed.path().to_owned();
        // The kernel releases the lock of a killed process but removes no files.
        let LinkFolder { folder, _lock: lock } = killed;
        drop(lock);
        let _kept = folder.keep();
        let foreign = parent.path().join("leo-mock-bus-of-somebody");
        fs::create_dir(&foreign).unwrap();
        assert!(path.exists());
        let next = LinkFolder::within(parent.path()).unwrap();
        assert!(!path.exists(), "{} is left behind", path.display());
        assert!(living.path().exists() && next.path().exists() && foreign.exists());
        let path = living.path().to_owned();
        drop(living);
        assert!(!path.exists());
    }
}
