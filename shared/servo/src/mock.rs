//! Servos that behave: whole control tables with their rules, a motor behind each, and a line with
//! several of them on which faults can be put in on purpose.
//!
//! Time is an argument, so they live as well in simulated time, and two lines that hear the same
//! at the same instants, with the same seed, do the same to the last bit.

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
