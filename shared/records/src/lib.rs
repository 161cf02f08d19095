//! The records of an MCAP file, which may come from a stranger.
//!
//! A record of a chunk comes out only after the check sum of its chunk was compared, where the chunk has one. What does
//! not have one is counted ([`Records::unchecked`]). However long the file is, one chunk is in memory; and what its
//! chunks expand to is bounded by a [`budget::Budget`].

mod chunk;
mod error;
mod parse;
mod reader;

pub use error::{RecordsError, Unchecked};
pub use parse::Wanted;
pub use reader::Records;

/// No record and no chunk is longer, in bytes, expanded: what claims to be is damaged.
pub const LONGEST: usize = 64 << 20;
