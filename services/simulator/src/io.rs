//! All input and output of this process: shared memory, files, devices, the clock and other processes.

pub(crate) mod lesson_controller;
pub(crate) mod run;
pub(crate) mod saving;
