//! Mock servo buses: simulated servos behind pseudo-terminals.
//!
//! Every bus of `motor.toml` whose device is `mock` gets a pseudo-terminal with simulated servos; any Dynamixel host
//! can use it. The symbolic link `bus-<name>` in the domain's folder points to it.

mod faults;
mod io;
mod lateness;
mod pacer;
mod servos;

pub use faults::{Faults, parse};
pub use io::end::{PtyError, Servos};
pub use io::ptys::{MockBuses, MockBusesError};
pub use io::run::run;
pub use io::run_standalone::{StandaloneError, StandaloneOptions, run_standalone};
pub use pacer::Pacer;
pub use servos::line;
