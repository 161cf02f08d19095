//! Folders that belong to this user alone.
//!
//! `/dev/shm` and `/tmp` are open to every user of a machine: another one can put a symbolic link, or a folder of
//! their own, where this user's is expected. A [`Folder`] is opened without following a link. It must belong to this
//! user, and nobody else may write in it. All work goes through its descriptor, so that what was looked at is what is
//! worked in.

mod files;
mod output;

use std::fs::{DirBuilder, File};
use std::io::{self, Read as _, Write as _};
use std::os::fd::OwnedFd;
use std::os::unix::fs::DirBuilderExt as _;
use std::path::{Path, PathBuf};

use rustix::fs::{
    AtFlags, Dir, FileType, Mode, OFlags, RenameFlags, Stat, fstat, linkat, lstat, mkdir, open, openat,
    renameat, renameat_with, statat, unlinkat,
};
use rustix::io::Errno;
use rustix::process::geteuid;

pub use output::{Existing, Output, OutputError};

/// What a folder is opened for.
const FOLDER: OFlags = OFlags::RDONLY.union(OFlags::DIRECTORY).union(OFlags::NOFOLLOW).union(OFlags::CLOEXEC);
/// Nobody else may write.
const WRITTEN_BY_OTHERS: u32 = 0o022;
/// Files and folders are this user's alone.
const OWN_FOLDER: Mode = Mode::RWXU;
const OWN_FILE: Mode = Mode::RUSR.union(Mode::WUSR);
/// Deeper than anything that Leo or its middleware makes.
const DEEP: u32 = 16;

/// A folder of this user's, open.
#[derive(Debug)]
pub struct Folder {
    descriptor: OwnedFd,
    path: PathBuf,
}

/// Why a folder cannot be worked in.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// There is a symbolic link.
    #[error(
        "{} is a symbolic link, where a folder of Leo has to be: another user may have put it there. Look where it \
         leads (`ls -l {}`), then remove the link",
        path.display(), path.display()
    )]
    Link {
        /// Its path.
        path: PathBuf,
    },
    /// There is something else.
    #[error("{} is no folder: remove it, or choose another place", path.display())]
    NoFolder {
        /// Its path.
        path: PathBuf,
    },
    /// It belongs to another user.
    #[error("{} belongs to the user with the number {owner}, and not to this one: choose another name or place, or have that user or root remove it", path.display())]
    OtherOwner {
        /// Its path.
        path: PathBuf,
        /// Its user's number.
        owner: u32,
    },
    /// Other users may write in it.
    #[error(
        "{} may be written by other users (mode {mode:o}), who may have put anything into it: look at what it holds, \
         then `chmod 700 {}`",
        path.display(), path.display()
    )]
    WritableByOthers {
        /// Its path.
        path: PathBuf,
        /// Its permissions.
        mode: u32,
    },
    /// The system refused it.
    #[error("{}: {source}", path.display())]
    System {
        /// Its path.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

impl FolderError {
    /// Whether nothing is there.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::System { source, .. } if source.kind() == io::ErrorKind::NotFound)
    }
}

impl From<FolderError> for io::Error {
    fn from(error: FolderError) -> Self {
        match error {
            FolderError::System { source, .. } => source,
            FolderError::NoFolder { .. } => Self::new(io::ErrorKind::NotADirectory, error),
            FolderError::Link { .. }
            | FolderError::OtherOwner { .. }
            | FolderError::WritableByOthers { .. } => Self::new(io::ErrorKind::PermissionDenied, error),
        }
    }
}

impl Folder {
    /// Opens a folder of this user's.
    ///
    /// # Errors
    ///
    /// It is a link or no folder, belongs to another user, is open to others, or cannot be opened.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        let folder = Self::open_any(path)?;
        let stat = folder.stat()?;
        if stat.st_uid != geteuid().as_raw() {
            return Err(FolderError::OtherOwner { path: folder.path, owner: stat.st_uid });
        }
        let mode = stat.st_mode & 0o7777;
        if mode & WRITTEN_BY_OTHERS != 0 {
            return Err(FolderError::WritableByOthers { path: folder.path, mode });
        }
        Ok(folder)
    }

    /// Opens a folder of this user's; one of anybody's where this user is root: for what root does for others, such as
    /// releasing an emergency stop.
    ///
    /// # Errors
    ///
    /// As [`open`](Self::open).
    pub fn open_for_root(path: &Path) -> Result<Self, FolderError> {
        if geteuid().is_root() { Self::open_any(path) } else { Self::open(path) }
    }

    /// Makes a folder for this user alone where there is none, and opens it. Folders above it have to be there.
    ///
    /// # Errors
    ///
    /// As [`open`](Self::open), or it cannot be made.
    pub fn make(path: &Path) -> Result<Self, FolderError> {
        let path: PathBuf = path.components().collect();
        match mkdir(&path, OWN_FOLDER) {
            Ok(()) | Err(Errno::EXIST) => Self::open(&path),
            Err(errno) => Err(FolderError::System { path, source: errno.into() }),
        }
    }

    /// The same, and the folders above it too, where they are not there.
    ///
    /// # Errors
    ///
    /// As [`make`](Self::make).
    pub fn make_all(path: &Path) -> Result<Self, FolderError> {
        let path: PathBuf = path.components().collect();
        if let Some(above) = path.parent() {
            DirBuilder::new()
                .recursive(true)
                .mode(OWN_FOLDER.bits())
                .create(above)
                .map_err(|source| FolderError::System { path: above.to_owned(), source })?;
        }
        Self::make(&path)
    }

    fn open_any(path: &Path) -> Result<Self, FolderError> {
        // A slash at the end would have the system follow a link.
        let path: PathBuf = path.components().collect();
        match open(&path, FOLDER, Mode::empty()) {
            Ok(descriptor) => Ok(Self { descriptor, path }),
            Err(Errno::ACCESS) => {
                let owner = lstat(&path).map(|stat| stat.st_uid).ok();
                Err(match owner.filter(|owner| *owner != geteuid().as_raw()) {
                    Some(owner) => FolderError::OtherOwner { path, owner },
                    None => FolderError::System { path, source: Errno::ACCESS.into() },
                })
            }
            Err(Errno::LOOP | Errno::NOTDIR) => {
                let is_link =
                    lstat(&path).is_ok_and(|stat| FileType::from_raw_mode(stat.st_mode).is_symlink());
                Err(if is_link { FolderError::Link { path } } else { FolderError::NoFolder { path } })
            }
            Err(errno) => Err(FolderError::System { path, source: errno.into() }),
        }
    }

    fn stat(&self) -> Result<Stat, FolderError> {
        fstat(&self.descriptor)
            .map_err(|errno| FolderError::System { path: self.path.clone(), source: errno.into() })
    }

    /// Where it was opened.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether something of that name is in it: a link that leads nowhere is, too.
    ///
    /// # Errors
    ///
    /// That cannot be seen.
    pub fn has(&self, name: &str) -> io::Result<bool> {
        match statat(&self.descriptor, name, AtFlags::SYMLINK_NOFOLLOW) {
            Ok(_there) => Ok(true),
            Err(Errno::NOENT) => Ok(false),
            Err(errno) => Err(errno.into()),
        }
    }

    /// Opens a file in it for reading.
    ///
    /// # Errors
    ///
    /// It is not there, is a link, or cannot be read.
    pub fn read(&self, name: &str) -> io::Result<File> {
        self.file(name, OFlags::RDONLY)
    }

    /// The text of a file in it.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read), or it is no text.
    pub fn text(&self, name: &str) -> io::Result<String> {
        let mut text = String::new();
        self.read(name)?.read_to_string(&mut text)?;
        Ok(text)
    }

    /// Opens a file in it for writing, and makes it where it is not there; what is in it stays.
    ///
    /// # Errors
    ///
    /// It is a link, or cannot be written.
    pub fn write(&self, name: &str) -> io::Result<File> {
        self.file(name, OFlags::WRONLY | OFlags::CREATE)
    }

    /// Replaces what a file in it holds.
    ///
    /// # Errors
    ///
    /// As [`write`](Self::write).
    pub fn replace(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.file(name, OFlags::WRONLY | OFlags::CREATE | OFlags::TRUNC)?.write_all(bytes)
    }

    /// Makes a file in it that is not there yet.
    ///
    /// # Errors
    ///
    /// Something of that name is there, a link too, or it cannot be written.
    pub fn create(&self, name: &str) -> io::Result<File> {
        self.file(name, OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL)
    }

    fn file(&self, name: &str, flags: OFlags) -> io::Result<File> {
        let flags = flags | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        Ok(openat(&self.descriptor, name, flags, OWN_FILE)?.into())
    }

    /// Gives a file in it a second name, which must be free.
    ///
    /// # Errors
    ///
    /// The file is not there, something of the second name is, or there is no room.
    pub fn link(&self, name: &str, second: &str) -> io::Result<()> {
        Ok(linkat(&self.descriptor, name, &self.descriptor, second, AtFlags::empty())?)
    }

    /// Gives a file in it another name, which must be free.
    ///
    /// # Errors
    ///
    /// The file is not there, or something of the other name is.
    pub fn rename(&self, name: &str, other: &str) -> io::Result<()> {
        let (from, to) = (&self.descriptor, &self.descriptor);
        match renameat_with(from, name, to, other, RenameFlags::NOREPLACE) {
            // Not every file system can do that at once.
            Err(Errno::INVAL) if !self.has(other)? => Ok(renameat(from, name, to, other)?),
            Err(errno) => Err(errno.into()),
            Ok(()) => Ok(()),
        }
    }

    /// Removes a file or a link from it.
    ///
    /// # Errors
    ///
    /// It is not there, or cannot be removed.
    pub fn remove(&self, name: &str) -> io::Result<()> {
        Ok(unlinkat(&self.descriptor, name, AtFlags::empty())?)
    }

    /// Removes all that is in it, but what is to be kept; where a link leads, nothing is removed. What cannot be removed
    /// stays.
    pub fn clear(&self, keep: &[&str]) {
        clear(&self.descriptor, keep, DEEP);
    }
}

fn clear(folder: &OwnedFd, keep: &[&str], deep: u32) {
    let Ok(entries) = Dir::read_from(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let is_kept = |kept: &&str| name.to_bytes() == kept.as_bytes();
        if matches!(name.to_bytes(), b"." | b"..") || keep.iter().any(is_kept) {
            continue;
        }
        if unlinkat(folder, name, AtFlags::empty()).is_ok() || deep == 0 {
            continue;
        }
        if let Ok(below) = openat(folder, name, FOLDER, Mode::empty()) {
            clear(&below, &[], deep - 1);
            let _gone_if_empty = unlinkat(folder, name, AtFlags::REMOVEDIR);
        }
    }
}

#[cfg(test)]
mod tests;
