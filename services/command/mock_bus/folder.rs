use std::fs::{self, File};
use std::io;
use std::path::Path;

use tempfile::TempDir;

/// How the names of these folders begin.
const PREFIX: &str = "leo-mock-bus-";
/// The file in each that is locked while its maker lives.
const LOCK: &str = "lock";

/// A folder for the links to mock buses. It goes when it is dropped; where its maker was killed it goes
/// when the next one is made, here or anywhere by this user.
#[derive(Debug)]
pub(super) struct Folder {
    folder: TempDir,
    /// Unlocked by the system when the process ends, however it does.
    _lock: File,
}

impl Folder {
    /// Makes one for temporary files, and removes those whose makers are gone.
    ///
    /// # Errors
    ///
    /// Nothing can be written there.
    pub(super) fn new() -> io::Result<Self> {
        Self::within(&std::env::temp_dir())
    }

    fn within(parent: &Path) -> io::Result<Self> {
        clear_up(parent);
        let folder = tempfile::Builder::new().prefix(PREFIX).tempdir_in(parent)?;
        // It has its name when it is locked: whoever finds it unlocked knows that its maker is gone.
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

/// Removes the folders of makers that were killed. What cannot be removed is another user's, or stays for
/// another time.
fn clear_up(parent: &Path) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let is_ours = entry.file_name().to_str().is_some_and(|name| name.starts_with(PREFIX));
        // No link is followed to wherever it may lead.
        if is_ours && entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            let lock = File::open(entry.path().join(LOCK));
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
    fn what_a_killed_maker_left_goes_and_what_a_living_one_has_stays() {
        let parent = tempfile::tempdir().unwrap();
        let living = Folder::within(parent.path()).unwrap();
        let killed = Folder::within(parent.path()).unwrap();
        let path = killed.path().to_owned();
        // The system unlocks what a killed process had locked, and removes nothing.
        let Folder { folder, _lock: lock } = killed;
        drop(lock);
        let _kept = folder.keep();
        let foreign = parent.path().join("leo-mock-bus-of-somebody");
        fs::create_dir(&foreign).unwrap();
        assert!(path.exists());
        let next = Folder::within(parent.path()).unwrap();
        assert!(!path.exists(), "{} is left behind", path.display());
        assert!(living.path().exists() && next.path().exists() && foreign.exists());
        let path = living.path().to_owned();
        drop(living);
        assert!(!path.exists());
    }
}
