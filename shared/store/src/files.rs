use std::cmp::Ordering;
use std::fmt::Debug;
use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::path::Path;

use folder::{Folder, FolderError};

/// Maximum size of a store file, in bytes. An example has about ten thousand bytes.
const MAX_FILE_BYTES: u64 = 1 << 30;

/// The file operations of a store in one directory. Tests implement it with disks that fail or lose power.
pub(crate) trait Files: Debug + Send {
    /// Locks a file exclusively until this is dropped; `false` if another process holds the lock. A missing file is
    /// created if `make` is set.
    fn lock(&mut self, name: &str, make: bool) -> io::Result<bool>;
    /// All bytes of a file; `None` if there is none.
    fn read(&mut self, name: &str) -> io::Result<Option<Vec<u8>>>;
    /// Appends to a file of exactly this length. Durable on return.
    fn append(&mut self, name: &str, length: u64, bytes: &[u8]) -> io::Result<()>;
    /// Truncates a file to this length. Durable on return.
    fn truncate_file(&mut self, name: &str, length: u64) -> io::Result<()>;
    /// Writes a whole file. On return its data are durable, but not its name.
    fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()>;
    /// Renames a file and replaces an existing file of the new name.
    fn rename(&mut self, name: &str, to: &str) -> io::Result<()>;
    /// Creates a hard link, whose name must be free.
    fn link(&mut self, name: &str, second: &str) -> io::Result<()>;
    /// Makes all names durable (fsync of the directory).
    fn sync(&mut self) -> io::Result<()>;
}

/// A directory on a disk that only this user can access.
#[derive(Debug)]
pub(crate) struct Disk {
    folder: Folder,
    locked: Vec<File>,
}

impl Disk {
    /// Opens the directory; creates it and its parents if they are missing.
    pub(crate) fn make(path: &Path) -> Result<Self, FolderError> {
        let folder = match Folder::open_for_root(path) {
            Err(error) if error.is_missing() => {
                let above = path.parent().unwrap_or(path);
                fs::create_dir_all(above)
                    .map_err(|source| FolderError::System { path: above.to_owned(), source })?;
                Folder::make(path)?
            }
            opened => opened?,
        };
        Ok(Self { folder, locked: Vec::new() })
    }

    /// Opens the directory; `None` if there is none.
    pub(crate) fn inspect(path: &Path) -> Result<Option<Self>, FolderError> {
        match Folder::open_for_root(path) {
            Err(error) if error.is_missing() => Ok(None),
            opened => Ok(Some(Self { folder: opened?, locked: Vec::new() })),
        }
    }

    fn file(&self, name: &str) -> io::Result<File> {
        self.folder.own(name)?.ok_or_else(|| {
            let path = self.folder.path().join(name);
            io::Error::new(ErrorKind::NotFound, format!("{} is gone", path.display()))
        })
    }

    /// The error when another program has changed the length of a file.
    fn changed(&self, name: &str, found: u64, length: u64) -> io::Error {
        let path = self.folder.path().join(name);
        let text = format!("{} has {found} bytes instead of {length}", path.display());
        io::Error::new(ErrorKind::InvalidData, text)
    }

    /// Creates a file that belongs to the directory's owner.
    fn create(&self, name: &str) -> io::Result<()> {
        match self.folder.create(name) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(()),
            made => self.folder.give(&made?),
        }
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        // A child between fork and exec shares the descriptors and would keep the locks, so unlock explicitly.
        for file in &self.locked {
            let _unlocked = file.unlock();
        }
    }
}

impl Files for Disk {
    fn lock(&mut self, name: &str, make: bool) -> io::Result<bool> {
        if make && !self.folder.has(name)? {
            self.create(name)?;
        }
        let Some(file) = self.folder.own(name)? else { return Ok(true) };
        match file.try_lock() {
            Ok(()) => {
                self.locked.push(file);
                Ok(true)
            }
            Err(TryLockError::WouldBlock) => Ok(false),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    fn read(&mut self, name: &str) -> io::Result<Option<Vec<u8>>> {
        let Some(file) = self.folder.own(name)? else { return Ok(None) };
        let length = file.metadata()?.len();
        if length > MAX_FILE_BYTES {
            let path = self.folder.path().join(name);
            let text = format!("{} has {length} bytes, which is more than any store has", path.display());
            return Err(io::Error::new(ErrorKind::FileTooLarge, text));
        }
        let mut bytes = Vec::new();
        file.take(MAX_FILE_BYTES).read_to_end(&mut bytes)?;
        Ok(Some(bytes))
    }

    fn append(&mut self, name: &str, length: u64, bytes: &[u8]) -> io::Result<()> {
        let mut file = self.file(name)?;
        let found = file.metadata()?.len();
        if found != length {
            return Err(self.changed(name, found, length));
        }
        file.write_all(bytes)?;
        file.sync_data()
    }

    fn truncate_file(&mut self, name: &str, length: u64) -> io::Result<()> {
        let file = self.file(name)?;
        let found = file.metadata()?.len();
        match found.cmp(&length) {
            Ordering::Less => return Err(self.changed(name, found, length)),
            Ordering::Equal => {}
            Ordering::Greater => file.set_len(length)?,
        }
        file.sync_all()
    }

    fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.create(name)?;
        let mut file = self.file(name)?;
        file.set_len(0)?;
        file.write_all(bytes)?;
        file.sync_all()
    }

    fn rename(&mut self, name: &str, to: &str) -> io::Result<()> {
        self.folder.rename_over(name, to)
    }

    fn link(&mut self, name: &str, second: &str) -> io::Result<()> {
        self.folder.link(name, second)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.folder.sync()
    }
}
