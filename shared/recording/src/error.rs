use budget::BudgetError;
use records::Unchecked;

use crate::Buffer;

/// Why a recording cannot be read, or not read on.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The bytes could not be read.
    #[error("cannot read {name}: {source}")]
    Read {
        /// The file.
        name: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// It is something else.
    #[error(
        "{name} is no recording of Leo: {found}; make one with `leo teach LESSON --record FILE` or `leo record FILE`"
    )]
    Foreign {
        /// The file.
        name: String,
        /// What it is instead.
        found: String,
    },
    /// Its frames are laid out otherwise than this program's.
    #[error(
        "{name}: `{buffer}` was recorded as {found}, and this Leo reads {known}: use the Leo that it was made with"
    )]
    Version {
        /// The file.
        name: String,
        /// The channel.
        buffer: Buffer,
        /// What its schema is called.
        found: String,
        /// What it is called here.
        known: String,
    },
    /// The records of the file are damaged.
    #[error("{name} is damaged after frame {after}: {reason}; what stands before it was read")]
    Damaged {
        /// The file.
        name: String,
        /// Frames read before.
        after: u64,
        /// What is wrong.
        reason: String,
    },
    /// It expands to too much, or too much of it would have to be kept.
    #[error("{name} is not read on after frame {after}: {source}")]
    Budget {
        /// The file.
        name: String,
        /// Frames read before.
        after: u64,
        /// What is too much.
        source: BudgetError,
    },
    /// It has no check sum where one is needed.
    #[error(
        "{name}: {unchecked}: damage there would pass for a difference, and nothing is compared; record it anew, or use \
         the file that it was made of"
    )]
    Unchecked {
        /// The file.
        name: String,
        /// What has none.
        unchecked: Unchecked,
    },
}

/// Why a recording was not made, or not made whole.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be made.
    #[error("cannot make {}: {source}", file.display())]
    Create {
        /// The file.
        file: std::path::PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file cannot be written on.
    #[error("cannot write {} on: {source}; it can be read up to there", file.display())]
    Write {
        /// The file.
        file: std::path::PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The disk has no room left for it.
    #[error(
        "{}: less than {} MB of its disk are free, and a recording leaves them to others: make room, or record elsewhere; \
         what was recorded up to there is whole",
        file.display(),
        bytes.div_ceil(1_000_000)
    )]
    Room {
        /// The file.
        file: std::path::PathBuf,
        /// What it leaves free.
        bytes: u64,
    },
    /// The disk has no room for all that was kept.
    #[error(
        "{}: with what was kept in it, less than {} MB of its disk are free, and a recording leaves them to others: \
         make room, or record elsewhere; nothing was written",
        file.display(),
        bytes.div_ceil(1_000_000)
    )]
    Unsaved {
        /// The file.
        file: std::path::PathBuf,
        /// What it leaves free.
        bytes: u64,
    },
    /// The body that viewers are shown cannot be made.
    #[error(transparent)]
    Body(#[from] kinematics::BodyError),
    /// The robot cannot be looked at.
    #[error(transparent)]
    Join(#[from] transport::JoinError),
    /// A buffer cannot be opened.
    #[error(transparent)]
    Port(#[from] transport::PortError),
    /// A buffer cannot be read.
    #[error(transparent)]
    Receive(#[from] transport::ReceiveError),
    /// No thread is to be had, or one ended.
    #[error("no thread to record with: {0}")]
    Thread(String),
}
