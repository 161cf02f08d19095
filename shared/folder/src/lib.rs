//! Folders that other users cannot tamper with.
//!
//! `/dev/shm` and `/tmp` are writable by every user. Another user can put a symbolic link or a folder where this
//! user's is expected. A [`Folder`] is opened without following a link. It must belong to this user, and no other
//! user may write to it; [`Folder::open_for_root`] skips these two checks for root. All operations use its descriptor,
//! so that they apply to the folder that was checked.

mod existing;
mod files;
mod output;
mod whole_file;

use std::fs::{DirBuilder, File};
use std::io::{self, Write as _};
use std::os::fd::OwnedFd;
use std::os::unix::fs::DirBuilderExt as _;
use std::path::{Path, PathBuf};

use rustix::fs::{
    AtFlags, Dir, FileType, Mode, OFlags, RenameFlags, Stat, fstat, linkat, lstat, mkdir, open, openat,
    renameat, renameat_with, statat, unlinkat,
};
use rustix::io::Errno;
use rustix::process::geteuid;

pub use existing::{Existing, OutputError};
pub use output::Output;
pub use whole_file::WholeFile;

/// Flags for opening a folder.
const OPEN_FLAGS: OFlags =
    OFlags::RDONLY.union(OFlags::DIRECTORY).union(OFlags::NOFOLLOW).union(OFlags::CLOEXEC);
/// Mode bits of write access for other users.
const WRITABLE_BY_OTHERS: u32 = 0o022;
/// Modes of new folders and files: access for this user only.
const OWN_FOLDER: Mode = Mode::RWXU;
const OWN_FILE: Mode = Mode::RUSR.union(Mode::WUSR);
/// Maximum depth of [`Folder::clear`], larger than any folder tree of Leo or its middleware.
const MAX_DEPTH: u32 = 16;

/// An open folder of this user, or of any user if root opened it by [`Folder::open_for_root`].
#[derive(Debug)]
pub struct Folder {
    descriptor: OwnedFd,
    path: PathBuf,
}

/// Reason why a folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The path is a symbolic link.
    #[error(
        "{} is a symbolic link, where a folder of Leo has to be: another user may have put it there. Look where it \
         leads (`ls -l {}`), then remove the link",
        path.display(), path.display()
    )]
    Link {
        /// Its path.
        path: PathBuf,
    },
    /// The path is not a folder.
    #[error("{} is a file, and not a directory: move it away, or name another directory", path.display())]
    NoFolder {
        /// Its path.
        path: PathBuf,
    },
    /// It belongs to another user.
    #[error("{} belongs to the user with the number {owner}, and not to this one: choose another name or place, or have that user or root remove it", path.display())]
    OtherOwner {
        /// Its path.
        path: PathBuf,
        /// The user id of its owner.
        owner: u32,
    },
    /// Other users may write to it.
    #[error(
        "{} may be written by other users (mode {mode:o}), who may have put anything into it: look at what it holds, \
         then `chmod 700 {}`",
        path.display(), path.display()
    )]
    WritableByOthers {
        /// Its path.
        path: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// The operating system's error.
    #[error("{}: {source}", path.display())]
    System {
        /// Its path.
        path: PathBuf,
        /// The operating system's error.
        source: io::Error,
    },
}

impl FolderError {
    /// Whether the folder does not exist.
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
    /// Opens a folder of this user.
    ///
    /// # Errors
    ///
    /// It is a symbolic link or not a folder, belongs to another user, is writable by others, or cannot be opened.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        let folder = Self::open_any(path)?;
        let stat = folder.stat()?;
        if stat.st_uid != geteuid().as_raw() {
            return Err(FolderError::OtherOwner { path: folder.path, owner: stat.st_uid });
        }
        let mode = stat.st_mode & 0o7777;
        if mode & WRITABLE_BY_OTHERS != 0 {
            return Err(FolderError::WritableByOthers { path: folder.path, mode });
        }
        Ok(folder)
    }

    /// Like [`Self::open`], but if this user is root, any user may own the folder or write to it. For operations that
    /// root does for others, such as releasing an emergency stop: other users may have put anything into the folder.
    ///
    /// # Errors
    ///
    /// As [`Self::open`]. For root only: it is a symbolic link or not a folder, or cannot be opened.
    pub fn open_for_root(path: &Path) -> Result<Self, FolderError> {
        if geteuid().is_root() { Self::open_any(path) } else { Self::open(path) }
    }

    /// Opens a folder. If it is missing, creates it first, with access for this user alone. Its parent must exist.
    ///
    /// # Errors
    ///
    /// As [`Self::open`], or it cannot be created.
    pub fn make(path: &Path) -> Result<Self, FolderError> {
        match mkdir(path, OWN_FOLDER) {
            Ok(()) | Err(Errno::EXIST) => Self::open(path),
            Err(errno) => Err(FolderError::System { path: path.to_owned(), source: errno.into() }),
        }
    }

    /// Like [`Self::make`], and creates missing parents too.
    ///
    /// # Errors
    ///
    /// As [`Self::make`].
    pub fn make_all(path: &Path) -> Result<Self, FolderError> {
        if let Some(above) = path.parent() {
            DirBuilder::new()
                .recursive(true)
                .mode(OWN_FOLDER.bits())
                .create(above)
                .map_err(|source| FolderError::System { path: above.to_owned(), source })?;
        }
        Self::make(path)
    }

    fn open_any(path: &Path) -> Result<Self, FolderError> {
        // With a slash at the end, the system would follow a link.
        let path: PathBuf = path.components().collect();
        match open(&path, OPEN_FLAGS, Mode::empty()) {
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

    /// The path it was opened with.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether an entry of that name exists; true for a dangling symbolic link too.
    ///
    /// # Errors
    ///
    /// The entry cannot be queried.
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
    /// It does not exist, is not a regular file, or cannot be read.
    pub fn open_for_reading(&self, name: &str) -> io::Result<File> {
        self.file(name, OFlags::RDONLY)
    }

    /// The text of a file in it.
    ///
    /// # Errors
    ///
    /// As [`Self::open_for_reading`]; or it is not UTF-8, or longer than a configuration file may be.
    pub fn text(&self, name: &str) -> io::Result<String> {
        budget::read_text(self.open_for_reading(name)?, "a file of this folder", budget::CONFIGURATION_BYTES)
    }

    /// Opens a file in it for writing; creates it if necessary, and keeps its content.
    ///
    /// # Errors
    ///
    /// It is not a regular file, or cannot be written.
    pub fn open_for_writing(&self, name: &str) -> io::Result<File> {
        self.file(name, OFlags::WRONLY | OFlags::CREATE)
    }

    /// Replaces the content of a file in it.
    ///
    /// # Errors
    ///
    /// As [`Self::open_for_writing`].
    pub fn replace(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.file(name, OFlags::WRONLY | OFlags::CREATE | OFlags::TRUNC)?.write_all(bytes)
    }

    /// Creates a new file in it.
    ///
    /// # Errors
    ///
    /// An entry of that name exists, or it cannot be written.
    pub fn create(&self, name: &str) -> io::Result<File> {
        self.file(name, OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL)
    }

    /// Opens a regular file in it.
    fn file(&self, name: &str, flags: OFlags) -> io::Result<File> {
        // Without NONBLOCK, opening a named pipe would block until its other end is opened.
        let flags = flags | OFlags::NOFOLLOW | OFlags::CLOEXEC | OFlags::NONBLOCK;
        let file = match openat(&self.descriptor, name, flags, OWN_FILE) {
            Err(Errno::LOOP) => return Err(self.refused(name, "is a symbolic link, which is not followed")),
            opened => File::from(opened?),
        };
        if FileType::from_raw_mode(fstat(&file)?.st_mode).is_file() {
            Ok(file)
        } else {
            Err(self.refused(name, "is no regular file"))
        }
    }

    fn refused(&self, name: &str, what: &str) -> io::Error {
        let file = self.path.join(name);
        io::Error::new(io::ErrorKind::PermissionDenied, format!("{} {what}", file.display()))
    }

    /// Creates a hard link to a file in it. The new name must not exist.
    ///
    /// # Errors
    ///
    /// The file does not exist, the new name exists, or there is no space left.
    pub fn link(&self, name: &str, second: &str) -> io::Result<()> {
        Ok(linkat(&self.descriptor, name, &self.descriptor, second, AtFlags::empty())?)
    }

    /// Renames a file in it. The new name must not exist.
    ///
    /// # Errors
    ///
    /// The file does not exist, or the new name exists.
    pub fn rename(&self, name: &str, other: &str) -> io::Result<()> {
        let (from, to) = (&self.descriptor, &self.descriptor);
        match renameat_with(from, name, to, other, RenameFlags::NOREPLACE) {
            // This file system cannot check and rename atomically: a file that another program creates under the
            // new name between the two calls is replaced.
            Err(Errno::INVAL) if !self.has(other)? => Ok(renameat(from, name, to, other)?),
            Err(errno) => Err(errno.into()),
            Ok(()) => Ok(()),
        }
    }

    /// Removes a file or a symbolic link from it.
    ///
    /// # Errors
    ///
    /// It does not exist, or cannot be removed.
    pub fn remove(&self, name: &str) -> io::Result<()> {
        Ok(unlinkat(&self.descriptor, name, AtFlags::empty())?)
    }

    /// Removes all its content except the entries named in `keep`, without following symbolic links. Entries that
    /// cannot be removed stay.
    pub fn clear(&self, keep: &[&str]) {
        clear(&self.descriptor, keep, MAX_DEPTH);
    }
}

fn clear(folder: &OwnedFd, keep: &[&str], levels_left: u32) {
    let Ok(entries) = Dir::read_from(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let is_kept = |kept: &&str| name.to_bytes() == kept.as_bytes();
        if matches!(name.to_bytes(), b"." | b"..") || keep.iter().any(is_kept) {
            continue;
        }
        if unlinkat(folder, name, AtFlags::empty()).is_ok() || levels_left == 0 {
            continue;
        }
        if let Ok(below) = openat(folder, name, OPEN_FLAGS, Mode::empty()) {
            clear(&below, &[], levels_left - 1);
            let _gone_if_empty = unlinkat(folder, name, AtFlags::REMOVEDIR);
        }
    }
}

#[cfg(test)]
mod tests;
