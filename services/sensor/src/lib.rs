//! Sensor process: acquires observations and publishes percept snapshots. Hot path.
//!
//! The core is [`Sensor`]: it validates the sources' reports, transforms them into the robot's base frame,
//! and perceives. It reads no clock, does no I/O, and allocates only in `new`.

mod disturbance;
mod recordings;
mod sensor;
mod shell;
mod source;

pub use disturbance::Disturbance;
pub use recordings::{Reason, Unplayable, check_traces};
pub use sensor::{News, Sensor, Unsensing};
pub use shell::run;
