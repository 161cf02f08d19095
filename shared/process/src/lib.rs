//! Common parts of all process shells: joining the domain, timing of the main loop, health, and shutdown.
//!
//! A process's shell is a loop around its core, the same in wall time and in lockstep time:
//!
//! ```text
//! let mut node = ProcessNode::join(launch, Process::Sensor, &config.buffers, &config.sensor.realtime)?;
//! let mut observations = node.subscriber::<Observations>(Some(0))?;
//! let mut percepts = node.publisher::<Percepts>(None, capacity)?;
//! member.begin(Some(config.sensor.rate_hz.period()))?;
//! while let Some(now) = node.next_cycle()? {
//!     // receive, step the core, send
//!     node.end_cycle(Progress::More)?;
//! }
//! ```

pub mod arming;
mod aside;
pub mod black_box;
pub mod emergency;
mod failure;
mod launch;
mod member;
mod motor_processes;
mod pace;
pub mod state;
mod stop;
mod stop_socket;
mod torque_off_report;
mod umask;
mod watch_thread;

pub use aside::NonBlockingWriter;
pub use emergency::{Emergency, EmergencyFlag};
pub use failure::Failure;
pub use launch::Launch;
pub use member::{ProcessNode, Progress, queues};
pub use motor_processes::MotorProcess;
pub use stop::stop_flag;
pub use stop_socket::{StopAnswer, StopSocket, StoppedRobot};
pub use torque_off_report::{TORQUE_OFF_MESSAGE, report_torque_off};
pub use umask::restrict_umask;
