//! Sensor process: acquires observations, publishes the percept buffer. Hot path.
//!
//! The core is [`Sensor`]: it judges what the sources report, brings it into the robot's base
//! frame, and perceives. It reads no clock, opens nothing, and after `new` allocates nothing.

mod disturbance;
mod io;
mod recordings;
mod sensor;
mod source;

pub use disturbance::Disturbance;
pub use io::run::run;
pub use recordings::{Reason, Unplayable, check_traces};
pub use sensor::{News, Sensor, Unsensing};
