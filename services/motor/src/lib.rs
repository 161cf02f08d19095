//! Motor process: joint goals in, servo buses, joint states out.
//!
//! [`Motor`] is the pure core: it turns goals into one [`Request`] per bus and cycle, and the
//! [`Replies`] into joint states. [`exchange()`] carries a request over a [`Port`].

mod bus;
mod exchange;
mod job;
mod joint;
mod motor;
mod request;
mod shell;
mod stage;
mod threads;

pub use exchange::{Port, exchange};
pub use joint::Trouble;
pub use motor::{Counts, Motor, MotorError};
pub use request::{Part, Replies, Request, SERVOS_MOST};
pub use shell::run;

#[cfg(test)]
mod tests;
