use std::fs::{self, File};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use folder::{Folder, FolderError};
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;

use crate::Domain;

/// Lock file in the root of a domain, locked while the domain's supervisor runs.
pub(super) const CLAIM_FILE: &str = "supervisor.lock";

/// Exclusive claim on a domain. The kernel releases it if the process dies.
#[derive(Debug)]
pub struct Claim {
    file: File,
    folder: Folder,
}

/// Error while claiming a domain.
#[derive(Debug, thiserror::Error)]
pub enum ClaimError {
    /// A running supervisor holds the claim.
    #[error(
        "a robot already runs in the domain {}: stop it first, or give this one another name with --domain",
        root.display()
    )]
    Held {
        /// The root of the domain.
        root: PathBuf,
    },
    /// The domain belongs to another user.
    #[error(
        "the domain {} belongs to the user with the number {owner}: a robot of that user runs there, or an emergency \
         stop of that user was never released. That user or root can release it (`leo emergency-stop --release`); or \
         give this robot another name with --domain",
        root.display()
    )]
    OfAnother {
        /// The root of the domain.
        root: PathBuf,
        /// The user id of its owner.
        owner: u32,
    },
    /// Its directory is a symbolic link, or not safe to use.
    #[error(transparent)]
    Folder(FolderError),
    /// It cannot be created or locked.
    #[error("cannot claim {}: {source}; is it this user's, and is /dev/shm writable and not full?", path.display())]
    Failed {
        /// The path that could not be created or locked.
        path: PathBuf,
        /// The operating system's error.
        source: io::Error,
    },
}

/// Claims a domain; creates its directory if necessary, and removes the directory again if that fails.
///
/// # Errors
///
/// Another process holds the claim, or the directory cannot be created.
pub fn claim(domain: &Domain) -> Result<Claim, ClaimError> {
    let claimed = make_and_lock(domain);
    if matches!(claimed, Err(ClaimError::Failed { .. })) {
        // A sweep skips a directory without a claim file. The removal fails unless the directory is empty.
        let _gone_if_empty = fs::remove_dir(domain.root());
    }
    claimed
}

fn make_and_lock(domain: &Domain) -> Result<Claim, ClaimError> {
    let root = domain.root();
    let path = root.join(CLAIM_FILE);
    loop {
        let folder = match Folder::make(root) {
            Ok(folder) => folder,
            // Another process removed it between creation and opening.
            Err(error) if error.is_missing() && root.parent().is_some_and(Path::is_dir) => continue,
            Err(FolderError::OtherOwner { path: root, owner }) => {
                return Err(ClaimError::OfAnother { root, owner });
            }
            Err(FolderError::System { path, source }) => return Err(ClaimError::Failed { path, source }),
            Err(error) => return Err(ClaimError::Folder(error)),
        };
        let failed = |source| ClaimError::Failed { path: path.clone(), source };
        let file = match folder.open_for_writing(CLAIM_FILE) {
            Ok(file) => file,
            // Another process removed the stale directory meanwhile.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(failed(error)),
        };
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(Errno::WOULDBLOCK) => return Err(ClaimError::Held { root: root.to_owned() }),
            Err(error) => return Err(failed(error.into())),
        }
        // A lock on a file that was removed between opening and locking excludes no other process.
        if is_at(&file, &path) {
            return Ok(Claim { file, folder });
        }
    }
}

/// Whether the claim on a domain is held, so that its supervisor runs.
#[must_use]
pub fn is_claimed(domain: &Domain) -> bool {
    let file = Folder::open_for_root(domain.root()).map_err(io::Error::from);
    let file = file.and_then(|folder| folder.open_for_reading(CLAIM_FILE));
    // The shared lock taken here is released with the file.
    file.is_ok_and(|file| flock(&file, FlockOperation::NonBlockingLockShared) == Err(Errno::WOULDBLOCK))
}

/// Takes over the claim on a domain whose holder has died. `None` if the claim is held, or if the domain was never
/// claimed.
pub(super) fn take_over_stale_claim(domain: &Domain) -> Option<Claim> {
    let folder = Folder::open(domain.root()).ok()?;
    // Do not create the file if it does not exist.
    folder.has(CLAIM_FILE).ok().filter(|has| *has)?;
    let file = folder.open_for_writing(CLAIM_FILE).ok()?;
    flock(&file, FlockOperation::NonBlockingLockExclusive).ok()?;
    is_at(&file, &domain.root().join(CLAIM_FILE)).then_some(Claim { file, folder })
}

impl Claim {
    /// Whether it is the claim on the domain with this root.
    pub(super) fn is_on(&self, root: &Path) -> bool {
        is_at(&self.file, &root.join(CLAIM_FILE))
    }

    /// The directory of the domain.
    pub(super) const fn folder(&self) -> &Folder {
        &self.folder
    }
}

fn is_at(file: &File, path: &Path) -> bool {
    let same =
        |ours: fs::Metadata, theirs: fs::Metadata| (ours.dev(), ours.ino()) == (theirs.dev(), theirs.ino());
    file.metadata().ok().zip(fs::metadata(path).ok()).is_some_and(|(ours, theirs)| same(ours, theirs))
}
