//! Real-time rights of a process: scheduling, affinity, locked memory; what is asked of the kernel
//! besides, so that its cores stay awake and its workers are prompt; and so that no process outlives the one
//! that started it.
//!
//! Nothing here is a condition: without rights everything goes on, more slowly, and the
//! [`Report`] says what is missing and how to grant it.
#![expect(
    unsafe_code,
    reason = "the scheduling policy, resource usage, the state of the clock and moving memory into huge pages, \
              which rustix does not offer"
)]

mod awake;
mod faults;
mod head_start;
mod huge_pages;
mod parent;
mod report;
mod rights;
mod schedule;
mod serial_workers;
mod wall_clock;

pub use awake::Awake;
pub use faults::page_faults;
pub use head_start::HeadStart;
pub use huge_pages::use_huge_pages;
pub use parent::{
    ParentError, die_with_parent, is_parent, prefer_out_of_memory_kill, stop_with_parent, take_name,
};
pub use report::{MEMORY, Refusal, Report, advice, grants};
pub use rights::apply;
pub use serial_workers::{SerialWorkers, SerialWorkersError};
pub use wall_clock::is_wall_clock_kept;
