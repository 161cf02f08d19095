//! Mock servo bus: the other end of the wire, with whole control tables.
//!
//! Every bus of `motor.toml` whose device is `mock` gets a pseudo-terminal, with servos that
//! behave behind it; any Dynamixel master can talk to it. A bus is found by the symbolic link
//! `bus-<name>` in the folder of the domain.

mod pacer;
mod ptys;
mod servos;
mod shell;

pub use pacer::Pacer;
pub use ptys::{Ptys, PtysError};
pub use servos::line;
pub use shell::run;
