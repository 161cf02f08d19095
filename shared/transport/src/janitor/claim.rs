use std::fs::{self, File};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use folder::{Folder, FolderError};
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;

use crate::Domain;

/// Below the root of a domain: locked as long as the domain's supervisor lives.
pub(super) const CLAIM_FILE: &str = "supervisor.lock";

/// A domain is ours for as long as this lives; the kernel gives it up for a process that dies.
#[derive(Debug)]
pub struct Claim {
    file: File,
    folder: Folder,
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
        "the domain {} belongs to the user with the number {owner}: a robot of theirs runs there, or an emergency \
         stop of theirs was never released. They or root release it (`leo emergency-stop --release`); or give this \
         robot another name with --domain",
        root.display()
    )]
    OfAnother {
        /// The root of the domain.
        root: PathBuf,
        /// Its user's number.
        owner: u32,
    },
    /// Its directory is a link, or may not be worked in.
    #[error(transparent)]
    Folder(FolderError),
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
        let folder = match Folder::make(root) {
            Ok(folder) => folder,
            // Somebody wiped it between being made and being opened.
            Err(error) if error.is_missing() && root.parent().is_some_and(Path::is_dir) => continue,
            Err(FolderError::OtherOwner { path: root, owner }) => {
                return Err(ClaimError::OfAnother { root, owner });
            }
            Err(FolderError::System { path, source }) => return Err(ClaimError::Failed { path, source }),
            Err(error) => return Err(ClaimError::Folder(error)),
        };
        let failed = |source| ClaimError::Failed { path: path.clone(), source };
        let file = match folder.write(CLAIM_FILE) {
            Ok(file) => file,
            // Somebody swept the stale directory away under us.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(failed(error)),
        };
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(Errno::WOULDBLOCK) => return Err(ClaimError::Held { root: root.to_owned() }),
            Err(error) => return Err(failed(error.into())),
        }
        // A lock on a file that was swept away between opening and locking locks nobody out.
        if is_at(&file, &path) {
            return Ok(Claim { file, folder });
        }
    }
}

/// Whether somebody holds the claim on a domain: whether its supervisor lives.
#[must_use]
pub fn is_claimed(domain: &Domain) -> bool {
    let file = Folder::open_for_root(domain.root()).map_err(io::Error::from);
    let file = file.and_then(|folder| folder.read(CLAIM_FILE));
    // A lock taken here for a moment is shared and given up with the file.
    file.is_ok_and(|file| flock(&file, FlockOperation::NonBlockingLockShared) == Err(Errno::WOULDBLOCK))
}

/// Takes over the claim of a domain whose holder is dead; none while somebody holds it, and none
/// where nobody ever claimed it.
pub(super) fn inherit(domain: &Domain) -> Option<Claim> {
    let folder = Folder::open(domain.root()).ok()?;
    // Where there is none, none is made.
    folder.has(CLAIM_FILE).ok().filter(|has| *has)?;
    let file = folder.write(CLAIM_FILE).ok()?;
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
