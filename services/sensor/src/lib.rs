//! Sensor process: acquires observations and publishes percept snapshots. Hot path.
//!
//! The core is [`Sensor`]: it validates the sources' reports, transforms them into the robot's base frame,
//! and perceives. It reads no clock, does no I/O, and allocates only in `new`.

mod fault_injector;
mod io;
mod recordings;
mod sensor;
mod source;

pub use fault_injector::FaultInjector;
pub use io::run::run;
pub use recordings::{TraceError, TraceSourceError, check_traces};
pub use sensor::{Sensor, SensorError, SourceEvent};
