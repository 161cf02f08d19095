//! Notifications to the service manager (systemd), if it has started the supervisor.

use std::os::linux::net::SocketAddrExt as _;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::{env, io};

use crate::policy::RobotState;

/// Client of the socket at `NOTIFY_SOCKET`, see sd_notify(3). Does nothing if the variable is not set.
#[derive(Debug, Default)]
pub(crate) struct ServiceManager {
    said: Option<RobotState>,
    failed: bool,
}

impl ServiceManager {
    /// Reports that all processes run for the first time, so that units ordered after the robot may start.
    pub(crate) fn ready(&mut self) {
        self.tell("READY=1");
    }

    /// Reports the robot's state if it changed, and triggers the watchdog if all processes run. If a process hangs
    /// and cannot be replaced, the watchdog expires.
    pub(crate) fn report_state(&mut self, robot_state: RobotState) {
        let before = self.said.replace(robot_state);
        if robot_state.is_ending && !before.is_some_and(|before| before.is_ending) {
            self.tell("STOPPING=1");
        }
        if before != Some(robot_state) {
            self.tell(&format!("STATUS={robot_state}"));
        }
        if robot_state.were_ready && robot_state.is_well() {
            self.tell("WATCHDOG=1");
        }
    }

    fn tell(&mut self, assignment: &str) {
        if let Err(error) = send(assignment)
            && !std::mem::replace(&mut self.failed, true)
        {
            tracing::warn!(%error, "the service manager does not listen");
        }
    }
}

/// Sends a line to the service manager's socket. A path that begins with `@` is an abstract address.
fn send(assignment: &str) -> io::Result<()> {
    let Some(path) = env::var_os("NOTIFY_SOCKET") else { return Ok(()) };
    let address = match path.as_bytes().strip_prefix(b"@") {
        Some(name) => SocketAddr::from_abstract_name(name)?,
        None => SocketAddr::from_pathname(&path)?,
    };
    UnixDatagram::unbound()?.send_to_addr(format!("{assignment}\n").as_bytes(), &address)?;
    Ok(())
}
