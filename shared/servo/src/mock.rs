//! Simulated servos: full control tables with their access rules, motor dynamics, and a bus of servos with fault
//! injection.
//!
//! Time is an argument, so the simulation also runs in simulated time. It is deterministic: the same seed and the same
//! bytes at the same instants give bit-identical results.

mod answer;
mod corrupt;
mod dynamics;
mod exchange;
mod indirect;
mod injection;
mod injector;
mod line;
mod memory;
mod reception;
mod servo;

pub use answer::{Replies, Reply};
pub use exchange::FollowerBehaviour;
pub use injection::{FaultKind, FaultSpec, FaultSpecError};
pub use injector::{FaultCounts, Injector};
pub use line::Line;
pub use servo::{HardwareError, Servo};
