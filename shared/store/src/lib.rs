//! What Leo has learned, in two copies of records with check sums.
//!
//! An entry is a head and a list of items, JSON values all of them: a task and its examples. Every change is a record
//! of its own with its check sum and the version of the format, a line in a file. It is appended to one copy, and when
//! it is durable there, to the other one. It is durable in both when the method returns: a process that is killed, or a
//! power cut, at any moment leaves either the entry as it was or as it was saved, and all others untouched. To append an
//! item costs the same however many there are.
//!
//! A store is checked when it is opened. What is damaged is set aside under a name that [`Findings`] tell, what is sound
//! in either copy is kept, and both copies are then written whole again, one after the other, each at once.
//!
//! A database of version 3 or an older one is taken over when the store is opened, and is kept as it was; a store of a
//! newer version is refused and left as it is.

mod contents;
mod database;
mod error;
mod files;
mod findings;
mod look;
mod mend;
mod migration;
mod names;
mod record;
mod scan;
mod store;
mod survey;

pub use error::{MigrationError, OpenError, ReadError, WriteError};
pub use findings::{Damage, Findings};
pub use look::Version;
pub use migration::VERSION;
pub use store::Store;
pub use survey::Lost;

/// An entry: what is under a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry<H, I> {
    /// Its key.
    pub key: String,
    /// What it begins with.
    pub head: H,
    /// What was appended to it, in order.
    pub items: Vec<I>,
}

#[cfg(test)]
mod tests;
