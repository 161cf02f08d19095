use std::fs;
use std::io;
use std::path::PathBuf;

use folder::{Folder, FolderError};

/// Prefix of a dump's file name; a number and the failure words follow.
const PREFIX: &str = "black_box_";
/// The word in the name of a requested dump.
pub(super) const REQUESTED: &str = "asked";
/// Extensions of a complete dump and of one being written.
pub(super) const FINISHED: &str = ".mcap";
pub(super) const UNFINISHED: &str = ".unfinished";

/// The dumps in one folder. Their numbers increase from the oldest to the newest.
#[derive(Clone, Debug)]
pub(super) struct Files {
    pub(super) folder: PathBuf,
    /// Maximum number of failure dumps, and of requested dumps.
    pub(super) max_per_kind: usize,
}

impl Files {
    /// Opens the folder, creating it if missing. Removes incomplete files left by a killed process.
    pub(super) fn open(&self) -> Result<Folder, FolderError> {
        let folder = Folder::make_all(&self.folder)?;
        for name in self.names().unwrap_or_default() {
            if name.starts_with(PREFIX) && name.ends_with(UNFINISHED) {
                let _gone = folder.remove(&name);
            }
        }
        Ok(folder)
    }

    /// The next file name, without extension.
    pub(super) fn next(&self, word: &str) -> io::Result<String> {
        let number = self.all()?.last().map_or(1, |(number, _)| number + 1);
        Ok(format!("{PREFIX}{number:04}_{word}"))
    }

    /// Removes the oldest surplus dumps. Failure dumps and requested dumps have separate quotas.
    pub(super) fn evict_oldest(&self, folder: &Folder) -> io::Result<()> {
        let is_asked = |(_, name): &(u64, String)| {
            let stem = name.strip_suffix(FINISHED).and_then(|name| name.rsplit_once('_'));
            stem.is_some_and(|(_, word)| word == REQUESTED)
        };
        let (asked, failures): (Vec<_>, Vec<_>) = self.all()?.into_iter().partition(is_asked);
        for kind in [asked, failures] {
            let surplus = kind.len().saturating_sub(self.max_per_kind);
            kind.iter().take(surplus).try_for_each(|(_, name)| folder.remove(name))?;
        }
        Ok(())
    }

    /// All dumps, from the oldest to the newest.
    fn all(&self) -> io::Result<Vec<(u64, String)>> {
        let names = self.names()?.into_iter();
        let mut all: Vec<_> = names.filter_map(|name| Some((number(&name)?, name))).collect();
        all.sort();
        Ok(all)
    }

    fn names(&self) -> io::Result<Vec<String>> {
        let entries = fs::read_dir(&self.folder)?.flatten();
        Ok(entries.filter_map(|entry| entry.file_name().into_string().ok()).collect())
    }
}

fn number(name: &str) -> Option<u64> {
    name.strip_prefix(PREFIX)?.strip_suffix(FINISHED)?.split_once('_')?.0.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_dumps_are_evicted_and_other_files_stay() {
        let folder = tempfile::tempdir().unwrap();
        let files = Files { folder: folder.path().join("recordings"), max_per_kind: 2 };
        let written = |word: &str| {
            let own = files.open().unwrap();
            let file = files.folder.join(files.next(word).unwrap() + FINISHED);
            fs::write(&file, word).unwrap();
            files.evict_oldest(&own).unwrap();
            file
        };
        let first = written("belief");
        assert_eq!(first.file_name().unwrap(), "black_box_0001_belief.mcap");
        let theirs = files.folder.join("recording_1.mcap");
        fs::write(&theirs, "").unwrap();
        let begun = files.folder.join(files.next("x").unwrap() + UNFINISHED);
        fs::write(&begun, "").unwrap();
        let [second, third] = ["motor", "emergency-stop"].map(written);
        assert!(!begun.exists());
        assert!(!first.exists() && second.exists() && third.exists() && theirs.exists());
        assert_eq!(files.next("x").unwrap(), "black_box_0004_x");
        // A new requested dump evicts only older requested ones.
        let [fourth, fifth, sixth] = [REQUESTED; 3].map(written);
        assert!(second.exists() && third.exists() && !fourth.exists() && fifth.exists() && sixth.exists());
        let seventh = written("quarantine");
        assert!(!second.exists() && third.exists() && fifth.exists() && sixth.exists() && seventh.exists());
    }
}
