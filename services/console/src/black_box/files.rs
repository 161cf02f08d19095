use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// How their names begin; a number, and words of what failed follow.
const PREFIX: &str = "black_box_";
/// The word of one that somebody asked for.
pub(super) const ASKED: &str = "asked";
/// The extension of one that is being written.
pub(super) const UNFINISHED: &str = "unfinished";

/// The files that a black box has written, in one folder. Their numbers grow from the oldest to the newest.
#[derive(Clone, Debug)]
pub(super) struct Files {
    pub(super) folder: PathBuf,
    /// So many of failures, and as many of those that somebody asked for.
    pub(super) most: usize,
}

impl Files {
    /// Where the next one goes; the folder is made where it is not there.
    pub(super) fn next(&self, word: &str) -> io::Result<PathBuf> {
        fs::create_dir_all(&self.folder)?;
        let number = self.all()?.last().map_or(1, |(number, _)| number + 1);
        Ok(self.folder.join(format!("{PREFIX}{number:04}_{word}.mcap")))
    }

    /// Removes the oldest, until there are no more than there may be: who asks takes nothing away that led to
    /// a failure, and a robot that fails again and again nothing that somebody asked for. And removes what
    /// somebody who was killed had begun.
    pub(super) fn thin_out(&self) -> io::Result<()> {
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            let is_ours =
                path.file_name().and_then(|name| name.to_str()).is_some_and(|name| name.starts_with(PREFIX));
            if is_ours && path.extension().is_some_and(|extension| extension == UNFINISHED) {
                fs::remove_file(path)?;
            }
        }
        let is_asked = |(_, file): &(u64, PathBuf)| {
            file.file_stem()
                .and_then(|name| name.to_str()?.rsplit_once('_'))
                .is_some_and(|(_, word)| word == ASKED)
        };
        let (asked, failures): (Vec<_>, Vec<_>) = self.all()?.into_iter().partition(is_asked);
        for kind in [asked, failures] {
            let surplus = kind.len().saturating_sub(self.most);
            kind.iter().take(surplus).try_for_each(|(_, file)| fs::remove_file(file))?;
        }
        Ok(())
    }

    /// From the oldest to the newest.
    fn all(&self) -> io::Result<Vec<(u64, PathBuf)>> {
        let mut all = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            all.extend(number(&path).map(|number| (number, path)));
        }
        all.sort();
        Ok(all)
    }
}

fn number(file: &Path) -> Option<u64> {
    let name = file.file_name()?.to_str()?.strip_prefix(PREFIX)?.strip_suffix(".mcap")?;
    name.split_once('_')?.0.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_give_way_and_what_is_not_theirs_stays() {
        let folder = tempfile::tempdir().unwrap();
        let files = Files { folder: folder.path().join("recordings"), most: 2 };
        let written = |word: &str| {
            let file = files.next(word).unwrap();
            fs::write(&file, word).unwrap();
            files.thin_out().unwrap();
            file
        };
        let first = written("belief");
        assert_eq!(first.file_name().unwrap(), "black_box_0001_belief.mcap");
        let theirs = files.folder.join("recording_1.mcap");
        fs::write(&theirs, "").unwrap();
        let begun = files.next("x").unwrap().with_extension(UNFINISHED);
        fs::write(&begun, "").unwrap();
        let [second, third] = ["motor", "emergency-stop"].map(written);
        assert!(!begun.exists());
        assert!(!first.exists() && second.exists() && third.exists() && theirs.exists());
        assert_eq!(files.next("x").unwrap().file_name().unwrap(), "black_box_0004_x.mcap");
        // Who asks takes away what was asked for before.
        let [fourth, fifth, sixth] = [ASKED; 3].map(written);
        assert!(second.exists() && third.exists() && !fourth.exists() && fifth.exists() && sixth.exists());
        let seventh = written("quarantine");
        assert!(!second.exists() && third.exists() && fifth.exists() && sixth.exists() && seventh.exists());
    }
}
