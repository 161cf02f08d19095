//! Motor process: takes joint goals, drives the servo buses, and publishes joint states.
//!
//! [`Motor`] is the pure core. It turns goals into one [`Request`] per bus and cycle, and the [`Replies`] into joint
//! states. A [`Master`] carries out a request over a [`Port`].

mod bus;
mod counts;
mod derating;
mod duplicate_id_check;
mod exchange;
mod group_dependencies;
mod io;
mod job;
mod joint;
mod motor;
mod notice;
mod reply_timeout;
mod reporter;
mod request;
mod servo_clock;
mod trouble;

pub use counts::MotorCounters;
pub use exchange::{Master, Port, Received, Sent};
pub use io::line::Line;
pub use io::run::run;
pub use io::threads::{BusThreads, ThreadError};
pub use motor::{Motor, MotorError};
pub use notice::Notice;
pub use request::{MAX_SERVOS, Part, PartKind, Replies, Request};
pub use trouble::JointFault;

#[cfg(test)]
mod tests;
