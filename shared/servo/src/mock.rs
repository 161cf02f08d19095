//! Simulated servos: full control tables with their access rules, motor dynamics, and a bus of servos with fault
//! injection.
//!
//! Time is an argument, so the simulation also runs in simulated time. It is deterministic: the same seed and the same
//! bytes at the same instants give bit-identical results.

mod answer;
mod dynamics;
mod exchange;
mod hearing;
mod indirect;
mod injection;
mod injector;
mod line;
mod memory;
mod servo;
mod spoil;

pub use answer::{Answer, Answers};
pub use injection::{BadInjection, Injection, Kind};
pub use injector::{Injected, Injector};
pub use line::{Followers, Line};
pub use servo::{HardwareError, Servo};
