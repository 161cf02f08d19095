//! All input and output of this process: shared memory, files, devices, the clock and other processes.

pub(crate) mod ending;
pub(crate) mod health_publisher;
pub(crate) mod line;
pub(crate) mod run;
pub(crate) mod threads;
