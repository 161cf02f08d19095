//! Persistent store of what Leo has learned: two copies of a journal with check sums.
//!
//! An entry consists of a head and a list of items, all JSON values: a task and its examples. Every change is a record,
//! a line of the file with a check sum and the format version. It is appended to the first copy, and once it is durable
//! there, to the second one. A method returns when the change is durable in both. After a crash or a power cut, the
//! changed entry has either its old or its new value, and all others are intact. The cost of appending an
//! item does not depend on the number of items.
//!
//! Opening verifies the store. Damaged files are set aside under the names in [`Findings`]. The valid records of either
//! copy are kept, and both copies are then rewritten atomically, one after the other.
//!
//! A store of another version is refused and left unchanged. So is the database of Leo before 0.1 (`learned.redb`).

mod contents;
mod error;
mod files;
mod findings;
mod inspect;
mod names;
mod record;
mod repair;
mod scan;
mod store;
mod survey;

pub use error::{OpenError, ReadError, WriteError};
pub use findings::{Damage, Findings};
pub use inspect::StoreState;
pub use record::VERSION;
pub use store::Store;
pub use survey::Lost;

/// An entry: the value of a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry<H, I> {
    /// Its key.
    pub key: String,
    /// Its head.
    pub head: H,
    /// Its items, in order.
    pub items: Vec<I>,
}

#[cfg(test)]
mod tests;
