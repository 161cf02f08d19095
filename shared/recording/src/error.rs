use std::fs::File;

use budget::BudgetError;
use folder::Output;
use records::Unchecked;

use crate::Channel;

/// Why a recording cannot be read, or not to its end.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The bytes could not be read.
    #[error("cannot read {name}: {source}")]
    Read {
        /// The file.
        name: String,
        /// The I/O error.
        source: std::io::Error,
    },
    /// It is not a recording of Leo.
    #[error(
        "{name} is not a recording of Leo: {found}; make one with `leo teach LESSON --record FILE` or `leo record \
         FILE`"
    )]
    Foreign {
        /// The file.
        name: String,
        /// What it is instead.
        found: String,
    },
    /// Its frame layout differs from this program's.
    #[error(
        "{name}: `{channel}` was recorded as {found}, and this Leo reads {known}: use the Leo that it was made with"
    )]
    Version {
        /// The file.
        name: String,
        /// The channel.
        channel: Channel,
        /// The name of its schema in the file.
        found: String,
        /// The name of its schema in this program.
        known: String,
    },
    /// The records of the file are damaged.
    #[error("{name} is damaged after frame {after}: {reason}; the frames before it were read")]
    Damaged {
        /// The file.
        name: String,
        /// Number of frames read before.
        after: u64,
        /// The damage.
        reason: String,
    },
    /// It expands to too many bytes, or needs too much memory.
    #[error("reading {name} stopped after frame {after}: {source}")]
    Budget {
        /// The file.
        name: String,
        /// Number of frames read before.
        after: u64,
        /// The exceeded limit.
        source: BudgetError,
    },
    /// A required check sum is missing.
    #[error(
        "{name}: {unchecked}: damage there would look like a difference, so nothing is compared; record again, or \
         use the original file"
    )]
    Unchecked {
        /// The file.
        name: String,
        /// The part without a check sum.
        unchecked: Unchecked,
    },
}

/// Why a recording could not be made or completed.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be created.
    #[error("cannot make {}: {source}", file.display())]
    Create {
        /// The file.
        file: std::path::PathBuf,
        /// The I/O error.
        source: std::io::Error,
    },
    /// Writing to the file failed.
    #[error("cannot continue writing {}: {source}; the part written before is readable", file.display())]
    Write {
        /// The file.
        file: std::path::PathBuf,
        /// The I/O error.
        source: std::io::Error,
    },
    /// The disk has less free space than a recording must leave.
    #[error(
        "{}: less than {} MB of its disk are free, and recordings must leave that much: make room, or record \
         elsewhere; the recording is complete up to this point",
        file.display(),
        bytes.div_ceil(1_000_000)
    )]
    DiskFull {
        /// The file.
        file: std::path::PathBuf,
        /// The free space to leave, in bytes.
        bytes: u64,
    },
    /// The disk has no space for all that was kept in memory.
    #[error(
        "{}: with the frames from memory, less than {} MB of its disk are free, and recordings must leave that much: \
         make room, or record elsewhere; nothing was written",
        file.display(),
        bytes.div_ceil(1_000_000)
    )]
    SnapshotTooLarge {
        /// The file.
        file: std::path::PathBuf,
        /// The free space to leave, in bytes.
        bytes: u64,
    },
    /// The body for viewers is invalid.
    #[error(transparent)]
    Body(#[from] kinematics::BodyError),
    /// The robot's domain cannot be joined.
    #[error(transparent)]
    Join(#[from] transport::JoinError),
    /// A topic cannot be opened.
    #[error(transparent)]
    Port(#[from] transport::PortError),
    /// Shared memory has no space for a subscriber.
    #[error(transparent)]
    Reserve(#[from] transport::ReserveError),
    /// A topic cannot be read.
    #[error(transparent)]
    Receive(#[from] transport::ReceiveError),
    /// A thread could not be started, or ended.
    #[error("the recording thread failed: {0}")]
    Thread(String),
}

impl RecordError {
    /// Creates the file of a recording.
    ///
    /// # Errors
    ///
    /// [`RecordError::Create`].
    pub fn create(output: &Output) -> Result<File, Self> {
        output.create().map_err(|source| Self::Create { file: output.path().to_owned(), source })
    }
}
