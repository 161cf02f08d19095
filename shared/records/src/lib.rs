//! Reads the records of an untrusted MCAP file.
//!
//! Records of a chunk are returned only after the chunk's check sum was verified, if it has one. Parts without a
//! check sum are counted ([`Records::unchecked`]). Only one chunk is in memory at a time, and a [`budget::Budget`]
//! limits the decompressed size.

mod chunk;
mod error;
mod parse;
mod reader;

pub use error::{Cut, RecordsError, Unchecked};
pub use parse::RecordFilter;
pub use reader::Records;

/// Maximum length of a record or a decompressed chunk in bytes. A longer one counts as damaged.
pub const MAX_RECORD_BYTES: usize = 64 << 20;
