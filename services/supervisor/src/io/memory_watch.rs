use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use clock::{Duration, Instant};
use transport::{Domain, Replaced, Segment};

/// Interval between two checks.
const EVERY: Duration = Duration::from_millis(100);

/// Detects that shared memory was removed under the running robot, or that the middleware's management segment is
/// damaged. Causes of a removal are logind's `RemoveIPC` at the user's last logout, and cleaners of /dev/shm.
///
/// Running processes keep their mappings and continue. But no process can start, and no command finds the robot.
#[derive(Debug)]
pub(crate) struct MemoryWatch {
    /// The domain's folder and the supervisor's own files in shared memory. No other process may remove them while
    /// the supervisor runs.
    files: Vec<(PathBuf, Option<File>)>,
    segment: Option<Segment>,
    /// The last reported reason why the segment cannot be repaired.
    reported: Option<String>,
    look_at: Instant,
}

/// A fault of shared memory.
#[derive(Debug)]
pub(crate) enum MemoryFault {
    /// A file of shared memory was removed or replaced.
    Removed(PathBuf),
    /// The management segment was damaged, and has been repaired.
    Repaired(Replaced),
    /// The management segment cannot be repaired, with the reason; no process can join.
    Damaged(String),
}

/// Identity of a file: device and inode number.
type File = (u64, u64);

impl MemoryWatch {
    /// Watches the current files of the domain, which the supervisor has joined.
    pub(crate) fn of(domain: &Domain) -> Self {
        let folder = [domain.root().to_owned()].into_iter();
        let files = folder.chain(domain.mapped_files()).map(|path| (path.clone(), file(&path)));
        let segment = Segment::of(domain);
        if segment.is_none() {
            tracing::warn!("the middleware's management segment was not found and is not watched");
        }
        Self { files: files.collect(), segment, reported: None, look_at: Instant::EPOCH }
    }

    /// Checks the files and the segment at intervals, or at once with `now_for_sure`; returns a new fault.
    pub(crate) fn look(&mut self, now: Instant, now_for_sure: bool) -> Option<MemoryFault> {
        if now < self.look_at && !now_for_sure {
            return None;
        }
        self.look_at = now + EVERY;
        if let Some((path, _)) = self.files.iter().find(|(path, was)| file(path) != *was) {
            return Some(MemoryFault::Removed(path.clone()));
        }
        match self.segment.as_ref()?.repair() {
            Ok(replaced) => {
                self.reported = None;
                replaced.map(MemoryFault::Repaired)
            }
            Err(error) => {
                let error = error.to_string();
                let is_reported = self.reported.as_ref() == Some(&error);
                self.reported = Some(error.clone());
                (!is_reported).then_some(MemoryFault::Damaged(error))
            }
        }
    }
}

fn file(path: &Path) -> Option<File> {
    fs::metadata(path).map(|file| (file.dev(), file.ino())).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_removed_or_recreated_folder_is_detected() {
        let domain = Domain::named(&format!("memory-watch-{}", std::process::id())).unwrap();
        domain.make().unwrap();
        let mut watch = MemoryWatch::of(&domain);
        fs::write(domain.root().join("emergency-stop"), "").unwrap();
        let now = clock::now();
        let removed = |found| matches!(found, Some(MemoryFault::Removed(path)) if path == domain.root());
        assert!(watch.look(now, false).is_none());
        // Created before the old folder is removed, so that it gets another inode number.
        let other = domain.root().with_extension("other");
        fs::create_dir(&other).unwrap();
        fs::remove_dir_all(domain.root()).unwrap();
        assert!(watch.look(now, false).is_none(), "it is not time to look");
        assert!(removed(watch.look(now, true)));
        fs::rename(&other, domain.root()).unwrap();
        assert!(removed(watch.look(now + EVERY, false)));
        fs::remove_dir_all(domain.root()).unwrap();
    }
}
