//! Real-time rights of a process: scheduling, affinity, locked memory; and what must be asked of
//! the kernel so that no process outlives the one that started it.
//!
//! Nothing here is a condition: without rights everything goes on, more slowly, and the
//! [`Report`] says what is missing and how to grant it.
#![expect(unsafe_code, reason = "the scheduling policy and resource usage, which rustix does not offer")]

mod faults;
mod parent;
mod report;
mod rights;

pub use faults::page_faults;
pub use parent::{ParentError, die_with_parent};
pub use report::{Refusal, Report, advice};
pub use rights::apply;
