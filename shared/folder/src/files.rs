//! Operations of a folder with persistent files: atomic renaming, and files that belong to the folder's owner.

use std::fs::File;
use std::io::{self, ErrorKind};

use rustix::fs::{OFlags, fchown, fstat, fsync, renameat};
use rustix::process::geteuid;

use super::Folder;

impl Folder {
    /// Opens a file in it for reading and appending; `None` if it does not exist. It must be a regular file of the
    /// folder's owner.
    ///
    /// # Errors
    ///
    /// It is a symbolic link, not a regular file, or another user's, or cannot be opened.
    pub fn own(&self, name: &str) -> io::Result<Option<File>> {
        let file = match self.file(name, OFlags::RDWR | OFlags::APPEND) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            opened => opened?,
        };
        let (there, folder) = (fstat(&file)?, fstat(&self.descriptor)?);
        if there.st_uid != folder.st_uid {
            let owner = there.st_uid;
            return Err(self.refused(name, &format!("belongs to the user with the number {owner}")));
        }
        Ok(Some(file))
    }

    /// Changes the owner of a file that root created in another user's folder to that user.
    ///
    /// # Errors
    ///
    /// The operating system refused it.
    pub fn give(&self, file: &File) -> io::Result<()> {
        let folder = fstat(&self.descriptor)?;
        if !geteuid().is_root() || folder.st_uid == geteuid().as_raw() {
            return Ok(());
        }
        let (user, group) =
            (rustix::fs::Uid::from_raw(folder.st_uid), rustix::fs::Gid::from_raw(folder.st_gid));
        Ok(fchown(file, Some(user), Some(group))?)
    }

    /// Renames a file in it, and replaces any file of the new name.
    ///
    /// # Errors
    ///
    /// The file does not exist, or cannot be renamed.
    pub fn rename_over(&self, name: &str, to: &str) -> io::Result<()> {
        Ok(renameat(&self.descriptor, name, &self.descriptor, to)?)
    }

    /// Syncs the folder's entries to disk.
    ///
    /// # Errors
    ///
    /// The disk reported an error.
    pub fn sync(&self) -> io::Result<()> {
        Ok(fsync(&self.descriptor)?)
    }
}
