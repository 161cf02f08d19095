//! All input and output of this process: shared memory, files, devices, the clock and other processes.

pub(crate) mod run;
