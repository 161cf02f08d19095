use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use rustix::process::getuid;

use crate::Domain;

/// Below the root of a domain: locked as long as the domain's supervisor lives.
pub(super) const CLAIM_FILE: &str = "supervisor.lock";

/// A domain is ours for as long as this lives; the kernel gives it up for a process that dies.
#[derive(Debug)]
pub struct Claim {
    file: File,
}

/// Why a domain cannot be claimed.
#[derive(Debug, thiserror::Error)]
pub enum ClaimError {
    /// A living supervisor holds it.
    #[error(
        "a robot already runs in the domain {}: stop it first, or give this one another name with --domain",
        root.display()
    )]
    Held {
        /// The root of the domain.
        root: PathBuf,
    },
    /// It is another user's.
    #[error(
        "the domain {} belongs to the user with the number {owner}: a robot of his runs there, or an emergency stop \
         of his was never released. He or root releases it (`leo emergency-stop --release`); or give this robot \
         another name with --domain",
        root.display()
    )]
    OfAnother {
        /// The root of the domain.
        root: PathBuf,
        /// Its user's number.
        owner: u32,
    },
    /// It cannot be made or locked.
    #[error("cannot claim {}: {source}; is it this user's, and is /dev/shm writable and not full?", path.display())]
    Failed {
        /// What could not be made or locked.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// Claims a domain, making its directory where there is none.
///
/// # Errors
///
/// Another process holds it, or it cannot be made.
pub fn claim(domain: &Domain) -> Result<Claim, ClaimError> {
    let root = domain.root();
    let path = root.join(CLAIM_FILE);
    loop {
        match fs::DirBuilder::new().recursive(true).mode(0o700).create(root) {
            Ok(()) => {}
            // Somebody wiped it between being found there and being looked at, and may have made it again.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && is_free(root) => continue,
            Err(source) => return Err(ClaimError::Failed { path: root.to_owned(), source }),
        }
        let failed = |source| ClaimError::Failed { path: path.clone(), source };
        let file = match OpenOptions::new().write(true).create(true).truncate(false).mode(0o600).open(&path) {
            Ok(file) => file,
            // Somebody swept the stale directory away under us.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(of_another(root, getuid().as_raw()).unwrap_or_else(|| failed(error))),
        };
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(Errno::WOULDBLOCK) => return Err(ClaimError::Held { root: root.to_owned() }),
            Err(error) => return Err(failed(error.into())),
        }
        // A lock on a file that was swept away between opening and locking locks nobody out.
        if is_at(&file, &path) {
            return Ok(Claim { file });
        }
    }
}

/// Why somebody cannot open a file in a domain that is another user's; `None` where it is his.
pub(super) fn of_another(root: &Path, user: u32) -> Option<ClaimError> {
    let owner = fs::metadata(root).ok()?.uid();
    (owner != user).then(|| ClaimError::OfAnother { root: root.to_owned(), owner })
}

/// Whether somebody holds the claim on a domain: whether its supervisor lives.
#[must_use]
pub fn is_claimed(domain: &Domain) -> bool {
    let file = OpenOptions::new().read(true).open(domain.root().join(CLAIM_FILE));
    // A lock taken here for a moment is shared and given up with the file.
    file.is_ok_and(|file| flock(&file, FlockOperation::NonBlockingLockShared) == Err(Errno::WOULDBLOCK))
}

/// Takes over the claim of a domain whose holder is dead; none while somebody holds it, and none
/// where nobody ever claimed it.
pub(super) fn inherit(domain: &Domain) -> Option<Claim> {
    let path = domain.root().join(CLAIM_FILE);
    let file = OpenOptions::new().write(true).open(&path).ok()?;
    flock(&file, FlockOperation::NonBlockingLockExclusive).ok()?;
    is_at(&file, &path).then_some(Claim { file })
}

impl Claim {
    /// Whether it is the claim on the domain with this root.
    pub(super) fn is_on(&self, root: &Path) -> bool {
        is_at(&self.file, &root.join(CLAIM_FILE))
    }
}

/// Whether there is nothing at a path but perhaps a directory.
fn is_free(path: &Path) -> bool {
    match fs::symlink_metadata(path) {
        Ok(there) => there.is_dir(),
        Err(error) => error.kind() == io::ErrorKind::NotFound,
    }
}

fn is_at(file: &File, path: &Path) -> bool {
    let same =
        |ours: fs::Metadata, theirs: fs::Metadata| (ours.dev(), ours.ino()) == (theirs.dev(), theirs.ino());
    file.metadata().ok().zip(fs::metadata(path).ok()).is_some_and(|(ours, theirs)| same(ours, theirs))
}
