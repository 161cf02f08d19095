//! Console process: prints one line per event, and serves the page on which people watch the robot and teach it.

mod cells;
#[cfg(test)]
mod endurance_tests;
mod io;
mod narrator;
mod requests;
mod state_store;
mod view;

pub use io::run::run;
pub use io::top;
#[cfg(any(test, feature = "fed"))]
pub use io::web::fed;
pub use io::web::{PageAddressError, check_port};
pub use narrator::{Line, Narrator, Transcript};
pub use state_store::StateStore;
