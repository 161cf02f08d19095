//! Mock servo bus: the other end of the wire, with whole control tables.
//!
//! Every bus of `motor.toml` whose device is `mock` gets a pseudo-terminal, with servos that
//! behave behind it; any Dynamixel master can talk to it. A bus is found by the symbolic link
//! `bus-<name>` in the folder of the domain.

mod faults;
mod io;
mod lateness;
mod pacer;
mod servos;

pub use faults::{Faults, parse};
pub use io::alone::{Alone, AloneError, alone};
pub use io::end::PlugError;
pub use io::ptys::{Progress, Ptys, PtysError};
pub use io::run::run;
pub use pacer::Pacer;
pub use servos::line;
