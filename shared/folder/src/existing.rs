use std::io::{self, ErrorKind};

/// The mode of a new file: access for this user only.
pub(crate) const OWN_MODE: u32 = 0o600;

/// Policy for an existing output file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// Keep it, and fail.
    Keep,
    /// Overwrite it.
    Replace,
}

/// Reason why an output file is not created.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OutputError {
    /// A symbolic link of that name exists.
    #[error(
        "a symbolic link is there, and is not followed: another user may have put it there; name the file itself"
    )]
    Link,
    /// A file of that name exists.
    #[error("it exists already, and is kept; name another file, or add --force to replace it")]
    Exists,
    /// It is a directory.
    #[error("it is a directory; name a file in it")]
    Directory,
    /// The folder that it is to be in does not exist.
    #[error("its folder does not exist; make it, or name another file")]
    NoFolder,
    /// It is a named pipe that no process has opened to read.
    #[error("it is a pipe that no program reads: start the program that reads it first")]
    NoReader,
    /// An entry of that name exists in a folder of Leo.
    #[error("something of that name is there already")]
    Taken,
}

impl From<OutputError> for io::Error {
    fn from(error: OutputError) -> Self {
        Self::new(ErrorKind::AlreadyExists, error)
    }
}
