//! Mock servo buses: simulated servos behind pseudo-terminals.
//!
//! Every bus of `motor.toml` whose device is `mock` gets a pseudo-terminal with simulated servos; any Dynamixel host
//! can use it. The symbolic link `bus-<name>` in the domain's folder points to it.

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
