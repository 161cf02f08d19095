//! Removes and repairs what killed processes leave in shared memory.
//!
//! After the death of a running process, iceoryx2 removes everything that its node owned. A process killed *while it
//! starts* can leave a half-created file that iceoryx2 0.10 never completes:
//!
//! - opening an empty shared memory file blocks for ever;
//! - a tag that is not readable prevents the clean-up of its dead node;
//! - an incomplete service description blocks that service for all processes;
//! - the directory of a node without a monitor is never listed.
//!
//! The [`Janitor`] repairs those. A file that is just being created is complete within microseconds, so only a file
//! that stays incomplete counts as abandoned.
//!
//! The supervisor holds the [`Claim`] on its domain while it runs. A domain with an unheld claim is stale, and
//! [`sweep_stale`] removes it.

mod claim;
mod wipe;

use std::collections::BTreeMap;
use std::fs::{self, DirEntry, Permissions};
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use clock::{Duration, Instant};

use crate::Domain;
use crate::segment::PARENT;
pub use claim::{Claim, ClaimError, claim, is_claimed};
pub use wipe::sweep_stale;

/// Subdirectory of a domain with the nodes' monitors, and one directory per node.
const NODES: &str = "nodes";
/// Subdirectory of a domain with the descriptions of its services.
const SERVICES: &str = "services";
/// Time after which an incomplete file counts as abandoned.
const ABANDONED_AFTER: Duration = Duration::from_millis(200);
/// Mode of a file that iceoryx2 is still writing; [`FINISHED`] is that of a complete file.
const UNFINISHED: u32 = 0o600;
const FINISHED: u32 = 0o400;

/// Repair of a half-created file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Repair {
    Remove,
    RemoveDirectory,
    Finish,
}

/// An incomplete file, identified by its inode, and when it was first found.
#[derive(Clone, Copy, Debug)]
struct Suspect {
    inode: u64,
    since: Instant,
}

/// Result of one scan of a domain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScanResult {
    /// Number of half-created files repaired.
    pub repaired: usize,
    /// Number of incomplete files too young to repair; scan again.
    pub suspects: usize,
}

/// Repairs half-created files in one domain.
#[derive(Debug)]
pub struct Janitor {
    domain: Domain,
    suspects: BTreeMap<PathBuf, Suspect>,
}

impl Janitor {
    /// The janitor of a domain.
    #[must_use]
    pub fn new(domain: &Domain) -> Self {
        Self { domain: domain.clone(), suspects: BTreeMap::new() }
    }

    /// Scans the domain once, and repairs files that have been incomplete for 200 ms.
    ///
    /// After a death, repeat it while it finds suspects. Files that cannot be read or repaired are skipped: they are
    /// gone, or belong to another user.
    pub fn scan(&mut self, now: Instant) -> ScanResult {
        let mut scan = ScanResult::default();
        let mut seen = BTreeMap::new();
        for (path, inode, remedy) in unfinished(&self.domain) {
            let known = self.suspects.get(&path).filter(|suspect| suspect.inode == inode);
            let suspect = known.copied().unwrap_or(Suspect { inode, since: now });
            if now.since(suspect.since) >= ABANDONED_AFTER {
                scan.repaired += usize::from(apply(remedy, &path).is_ok());
            } else {
                seen.insert(path, suspect);
            }
        }
        scan.suspects = seen.len();
        self.suspects = seen;
        scan
    }

    /// Removes the whole domain except a raised emergency stop. To be called when the robot has ended.
    ///
    /// Releases the claim at the end. The next [`sweep_stale`] removes what is left.
    pub fn wipe(self, claim: Claim) {
        wipe::wipe(&self.domain, claim);
    }
}

fn apply(remedy: Repair, path: &Path) -> std::io::Result<()> {
    match remedy {
        Repair::Remove => fs::remove_file(path),
        Repair::RemoveDirectory => fs::remove_dir_all(path),
        Repair::Finish => fs::set_permissions(path, Permissions::from_mode(FINISHED)),
    }
}

/// All incomplete files of the domain, with their inodes.
fn unfinished(domain: &Domain) -> Vec<(PathBuf, u64, Repair)> {
    let nodes = domain.root().join(NODES);
    let mut found = Vec::new();
    let mut judge = |directory: &Path, verdict: &dyn Fn(&str, u64, u32) -> Option<Repair>| {
        for entry in entries(directory) {
            let name = entry.file_name();
            let (Some(name), Ok(meta)) = (name.to_str(), entry.metadata()) else { continue };
            if let Some(remedy) = verdict(name, meta.len(), meta.mode()) {
                found.push((entry.path(), meta.ino(), remedy));
            }
        }
    };
    let prefix = domain.prefix();
    judge(Path::new(PARENT), &|name, size, mode| {
        name.starts_with(&prefix).then(|| shared_memory(size, mode))?
    });
    judge(&domain.root().join(SERVICES), &|name, _size, mode| service(name, mode));
    for entry in entries(&nodes) {
        if entry.path().is_dir() {
            judge(&entry.path(), &|name, _size, mode| tag(name, mode));
        }
    }
    judge(&nodes, &|name, _size, mode| {
        let monitored = || nodes.join(format!("{prefix}{name}.node_monitor")).exists();
        (is_directory(mode) && !monitored()).then_some(Repair::RemoveDirectory)
    });
    found
}

/// An empty shared memory file was created, but never given its size.
fn shared_memory(size: u64, mode: u32) -> Option<Repair> {
    (is_file(mode) && size == 0).then_some(Repair::Remove)
}

/// A service description is made readable when it is complete.
fn service(name: &str, mode: u32) -> Option<Repair> {
    (name.ends_with(".service") && permissions(mode) == UNFINISHED).then_some(Repair::Remove)
}

/// A tag in a node's directory marks a resource that the node uses. Only its name matters, so the janitor can
/// complete it for its dead owner.
fn tag(name: &str, mode: u32) -> Option<Repair> {
    (name.ends_with("_tag") && permissions(mode) == UNFINISHED).then_some(Repair::Finish)
}

const fn permissions(mode: u32) -> u32 {
    mode & 0o777
}

const fn is_file(mode: u32) -> bool {
    mode & 0o170_000 == 0o100_000
}

const fn is_directory(mode: u32) -> bool {
    mode & 0o170_000 == 0o040_000
}

/// The entries of a directory; none if it does not exist.
fn entries(directory: &Path) -> impl Iterator<Item = DirEntry> + use<> {
    fs::read_dir(directory).into_iter().flatten().flatten()
}

#[cfg(test)]
mod tests;
