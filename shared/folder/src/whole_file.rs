use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use rustix::fs::{CWD, RenameFlags, renameat_with};
use rustix::io::Errno;

use crate::existing::{Existing, OWN_MODE, OutputError};

/// Maximum number of names tried for the unfinished file.
const MAX_NAMES: u32 = 100;

/// A file that is written whole, see [`Output::create_whole`](crate::Output::create_whole). Dropping it before
/// [`Self::finish`] leaves no file.
#[derive(Debug)]
pub struct WholeFile {
    file: File,
    /// The unfinished file, its final name, and what becomes of a file of that name; `None` for a device or a pipe.
    unfinished: Option<(PathBuf, PathBuf, Existing)>,
}

impl WholeFile {
    /// A device, a pipe or a file that its folder already protects, written as it is.
    pub(crate) fn in_place(file: File) -> Self {
        Self { file, unfinished: None }
    }

    /// A new file beside `path`, with access for this user only.
    pub(crate) fn beside(path: &Path, existing: Existing) -> io::Result<Self> {
        let name = path.file_name().ok_or(ErrorKind::IsADirectory)?;
        for number in 0..MAX_NAMES {
            let mut hidden = OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{}-{number}.part", std::process::id()));
            let unfinished = path.with_file_name(hidden);
            match OpenOptions::new().write(true).create_new(true).mode(OWN_MODE).open(&unfinished) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                made => {
                    let unfinished = Some((unfinished, path.to_owned(), existing));
                    return made.map(|file| Self { file, unfinished });
                }
            }
        }
        Err(ErrorKind::AlreadyExists.into())
    }

    /// The open file.
    #[must_use]
    pub fn file(&self) -> &File {
        &self.file
    }

    /// The path that holds the bytes written so far; `None` for a device or a pipe.
    #[must_use]
    pub fn unfinished(&self) -> Option<&Path> {
        self.unfinished.as_ref().map(|(unfinished, ..)| unfinished.as_path())
    }

    /// Gives the complete file its name.
    ///
    /// # Errors
    ///
    /// Another file has got the name meanwhile and is to be kept, or the file cannot be renamed. No part is left then.
    pub fn finish(mut self) -> io::Result<()> {
        self.file.flush()?;
        let Some((unfinished, path, existing)) = &self.unfinished else { return Ok(()) };
        match existing {
            Existing::Replace => fs::rename(unfinished, path)?,
            Existing::Keep => rename_to_new(unfinished, path)?,
        }
        self.unfinished = None;
        Ok(())
    }
}

/// Renames a file; a file of the new name is kept.
fn rename_to_new(unfinished: &Path, path: &Path) -> io::Result<()> {
    match renameat_with(CWD, unfinished, CWD, path, RenameFlags::NOREPLACE) {
        Ok(()) => Ok(()),
        Err(Errno::EXIST) => Err(OutputError::Exists.into()),
        // This file system cannot check and rename at once; a hard link can.
        Err(Errno::INVAL) => match fs::hard_link(unfinished, path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(OutputError::Exists.into()),
            linked => linked.and_then(|()| fs::remove_file(unfinished)),
        },
        Err(errno) => Err(errno.into()),
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if let Some((unfinished, ..)) = &self.unfinished {
            let _gone = fs::remove_file(unfinished);
        }
    }
}
