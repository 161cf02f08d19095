//! All input and output of this process: shared memory, files, devices, the clock and other processes.

pub(crate) mod arming;
mod background;
pub(crate) mod black_box;
pub(crate) mod hand;
pub(crate) mod lessons;
pub(crate) mod look;
pub(crate) mod metrics_poller;
pub(crate) mod requester;
pub(crate) mod run;
pub(crate) mod tape;
pub mod top;
pub(crate) mod web;
