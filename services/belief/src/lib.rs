//! Belief process: one belief system per perspective, woken by the percept buffer.
//!
//! Hot path. The core is [`Believer`]: it takes a frame of the percept buffer and brings every perspective
//! to the instant of that frame. [`Divergences`] compares them with each other. Both read no clock, open
//! nothing, and after `new` allocate nothing.

mod believer;
mod divergences;
mod io;

pub use believer::{Believer, Own, Unbelieving};
pub use divergences::Divergences;
pub use io::run::run;
