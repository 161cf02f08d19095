//! Mock servo bus: the other end of the wire, with whole control tables.
//!
//! Every bus of `motor.toml` whose device is `mock` gets a pseudo-terminal, with servos that
//! behave behind it; any Dynamixel master can talk to it. A bus is found by the symbolic link
//! `bus-<name>` in the folder of the domain.

mod alone;
mod end;
mod faults;
mod lateness;
mod pacer;
mod ptys;
mod servos;
mod shell;

pub use alone::{Alone, AloneError, alone};
pub use end::PlugError;
pub use faults::{Faults, parse};
pub use pacer::Pacer;
pub use ptys::{Progress, Ptys, PtysError};
pub use servos::line;
pub use shell::run;
