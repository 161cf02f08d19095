//! All input and output of this process: shared memory, files, devices, the clock and other processes.

pub(crate) mod memory;
pub(crate) mod persister;
pub(crate) mod run;

pub use store::{OpenError, StoreState as MemoryState, VERSION as MEMORY_VERSION};
