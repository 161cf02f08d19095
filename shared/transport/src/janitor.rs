//! Clears away what killed processes leave behind in shared memory.
//!
//! Killing a process that runs is clean: iceoryx2 removes what a dead node owned. Killing one
//! *while it starts* can leave a file half made, which iceoryx2 0.10 never finishes: whoever opens
//! a shared-memory file of no bytes waits for it for ever, a tag that was never made readable
//! keeps its dead node from being cleaned up, a service's description that was never finished
//! keeps everybody from that service, and the directory of a node without a monitor is never
//! listed. The [`Janitor`] mends those, and tells them from files that are being made this very
//! moment by looking twice: a process makes one within microseconds.
//!
//! The supervisor holds the [`Claim`] on its domain as long as it lives. A domain whose claim
//! nobody holds is stale, and [`sweep_stale`] removes it.

mod claim;
mod wipe;

use std::collections::BTreeMap;
use std::fs::{self, DirEntry, Permissions};
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use clock::{Duration, Instant};

use crate::Domain;
pub use claim::{Claim, ClaimError, claim, is_claimed};
pub use wipe::sweep_stale;

/// Where shared memory appears as files.
const SHARED_MEMORY: &str = "/dev/shm";
/// Below the root of a domain: the nodes' monitors, and one directory per node.
const NODES: &str = "nodes";
/// Below the root of a domain: the descriptions of its services.
const SERVICES: &str = "services";
/// How long a file must have looked unfinished before it counts as abandoned.
const ABANDONED_AFTER: Duration = Duration::from_millis(200);
/// The mode of a file that iceoryx2 is still writing, and of one that it has finished.
const UNFINISHED: u32 = 0o600;
const FINISHED: u32 = 0o400;

/// What helps against a half-made file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Remedy {
    Remove,
    RemoveDirectory,
    Finish,
}

/// A file that looked unfinished, since when, and whether it is still the same file.
#[derive(Clone, Copy, Debug)]
struct Suspect {
    inode: u64,
    since: Instant,
}

/// What one look at a domain found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// Half-made files that were mended.
    pub mended: usize,
    /// Files that look unfinished and are too young to judge: look again.
    pub suspects: usize,
}

/// Mends half-made files in one domain.
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

    /// Looks through the domain once, and mends what has looked unfinished for 200 ms.
    ///
    /// To be repeated after a death for as long as it finds suspects. What cannot be read or
    /// mended is left: it is gone, or another user's.
    pub fn look(&mut self, now: Instant) -> Look {
        let mut look = Look::default();
        let mut seen = BTreeMap::new();
        for (path, inode, remedy) in unfinished(&self.domain) {
            let known = self.suspects.get(&path).filter(|suspect| suspect.inode == inode);
            let suspect = known.copied().unwrap_or(Suspect { inode, since: now });
            if now.since(suspect.since) >= ABANDONED_AFTER {
                look.mended += usize::from(apply(remedy, &path).is_ok());
            } else {
                seen.insert(path, suspect);
            }
        }
        look.suspects = seen.len();
        self.suspects = seen;
        look
    }

    /// Removes everything of the domain but an emergency stop that was not released: for the last one out.
    ///
    /// Gives up the claim at the end. What cannot be removed is left to the next
    /// [`sweep_stale`].
    pub fn wipe(self, claim: Claim) {
        wipe::wipe(&self.domain, claim);
    }
}

fn apply(remedy: Remedy, path: &Path) -> std::io::Result<()> {
    match remedy {
        Remedy::Remove => fs::remove_file(path),
        Remedy::RemoveDirectory => fs::remove_dir_all(path),
        Remedy::Finish => fs::set_permissions(path, Permissions::from_mode(FINISHED)),
    }
}

/// Every file of the domain that looks unfinished, with its inode.
fn unfinished(domain: &Domain) -> Vec<(PathBuf, u64, Remedy)> {
    let nodes = domain.root().join(NODES);
    let mut found = Vec::new();
    let mut judge = |directory: &Path, verdict: &dyn Fn(&str, u64, u32) -> Option<Remedy>| {
        for entry in entries(directory) {
            let name = entry.file_name();
            let (Some(name), Ok(meta)) = (name.to_str(), entry.metadata()) else { continue };
            if let Some(remedy) = verdict(name, meta.len(), meta.mode()) {
                found.push((entry.path(), meta.ino(), remedy));
            }
        }
    };
    let prefix = domain.prefix();
    judge(Path::new(SHARED_MEMORY), &|name, size, mode| {
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
        (is_directory(mode) && !monitored()).then_some(Remedy::RemoveDirectory)
    });
    found
}

/// A shared-memory file without bytes was created and never sized.
fn shared_memory(size: u64, mode: u32) -> Option<Remedy> {
    (is_file(mode) && size == 0).then_some(Remedy::Remove)
}

/// The description of a service, which is made readable when it is whole.
fn service(name: &str, mode: u32) -> Option<Remedy> {
    (name.ends_with(".service") && permissions(mode) == UNFINISHED).then_some(Remedy::Remove)
}

/// What a node uses is tagged in its directory: a tag says so by its name alone, so it can be
/// finished for its dead owner.
fn tag(name: &str, mode: u32) -> Option<Remedy> {
    (name.ends_with("_tag") && permissions(mode) == UNFINISHED).then_some(Remedy::Finish)
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

/// The entries of a directory; none when it is not there.
fn entries(directory: &Path) -> impl Iterator<Item = DirEntry> + use<> {
    fs::read_dir(directory).into_iter().flatten().flatten()
}

#[cfg(test)]
mod tests;
