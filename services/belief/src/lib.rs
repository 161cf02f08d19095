//! Belief process: one belief system per perspective, triggered by the percept buffer.
//!
//! Hot path. The core is [`Believer`]: it takes a frame of the percept buffer and advances every perspective to the
//! instant of that frame. [`Divergences`] compares the perspectives. Neither reads a clock or opens a resource, and
//! neither allocates after `new`. [`symbols`] names what beliefs refer to by number.

mod believer;
mod divergences;
mod io;
mod symbols;

pub use believer::{BeliefProcessError, Believer, Own};
pub use divergences::Divergences;
pub use io::run::run;
pub use symbols::symbols;
