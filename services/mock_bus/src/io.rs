//! All input and output of this process: shared memory, files, devices, the clock and other processes.

pub(crate) mod end;
pub(crate) mod ptys;
pub(crate) mod run;
pub(crate) mod run_standalone;
