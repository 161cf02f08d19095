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
pub mod black_box;
pub mod emergency;
mod launch;
mod loop_timing;
mod motor_processes;
mod non_blocking_writer;
mod process_error;
mod process_node;
pub mod state;
mod stop;
mod stop_socket;
mod terminal;
mod torque_off_report;
mod umask;
mod watch_thread;

pub use emergency::{Emergency, EmergencyFlag};
pub use launch::Launch;
pub use motor_processes::MotorProcess;
pub use non_blocking_writer::NonBlockingWriter;
pub use process_error::ProcessError;
pub use process_node::{ProcessNode, Progress, queues};
pub use stop::stop_flag;
pub use stop_socket::{StopAnswer, StopSocket, StoppedRobot};
pub use terminal::{Terminal, TerminalEvent, TerminalOutput};
pub use torque_off_report::{TORQUE_OFF_MESSAGE, report_torque_off};
pub use umask::restrict_umask;
