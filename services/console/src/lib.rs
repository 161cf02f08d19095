//! Console process: prints one line per event, and serves the page on which people watch the robot and teach it.

mod arming;
mod black_box;
mod cells;
#[cfg(test)]
mod day;
mod fares;
mod hand;
mod lessons;
mod look;
mod narrator;
mod requests;
mod sheet;
mod shell;
mod tape;
pub mod top;
mod web;

pub use narrator::{Line, LineKind, Narrator, Transcript};
pub use sheet::Sheet;
pub use shell::run;
#[cfg(any(test, feature = "fed"))]
pub use web::fed;
