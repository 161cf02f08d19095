//! Real-time rights of a process: scheduling, affinity, locked memory. Also kernel settings against wake-up latency,
//! and the link between the lifetimes of parent and child.
//!
//! All rights are optional: without them, everything works with worse timing. The [`Report`] lists the missing rights
//! and how to grant them.
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

pub use awake::IdleStateGuard;
pub use faults::page_faults;
pub use head_start::StartupPriority;
pub use huge_pages::use_huge_pages;
pub use parent::{
    ParentError, die_with_parent, is_parent, prefer_out_of_memory_kill, set_process_name, stop_with_parent,
};
pub use report::{MEMORY, Refusal, Report, SCHEDULING, advice, grants};
pub use rights::apply;
pub use serial_workers::{SerialWorkers, SerialWorkersError};
pub use wall_clock::is_wall_clock_synchronised;
