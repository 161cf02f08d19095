//! Notifications to the service manager (systemd), if it has started the supervisor.

use std::ffi::{OsStr, OsString};
use std::os::linux::net::SocketAddrExt as _;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::{env, io};

use crate::policy::RobotState;

/// Why the service manager was not notified.
#[derive(Debug, thiserror::Error)]
enum NotifyError {
    /// The address is of no supported kind.
    #[error(
        "NOTIFY_SOCKET is `{}`: it has to be a path that begins with `/`, or `@` and the name of an abstract socket",
        _0.display()
    )]
    Address(OsString),
    /// The message cannot be sent.
    #[error("NOTIFY_SOCKET is `{}`: {source}; does the service manager listen there?", address.display())]
    Send {
        /// The address.
        address: OsString,
        /// The cause.
        source: io::Error,
    },
}

/// Client of the socket at `NOTIFY_SOCKET`, see sd_notify(3). Does nothing if the variable is not set or empty.
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
        let Some(address) = env::var_os("NOTIFY_SOCKET").filter(|address| !address.is_empty()) else {
            return;
        };
        if let Err(error) = send(&address, assignment)
            && !std::mem::replace(&mut self.failed, true)
        {
            tracing::warn!("the service manager is not notified: {error}");
        }
    }
}

/// Sends a line to the service manager's socket.
fn send(address: &OsStr, assignment: &str) -> Result<(), NotifyError> {
    let failed = |source| NotifyError::Send { address: address.to_owned(), source };
    let socket_address = match address.as_bytes() {
        [b'@', name @ ..] if !name.is_empty() => SocketAddr::from_abstract_name(name),
        [b'/', ..] => SocketAddr::from_pathname(address),
        // Other kinds, such as `vsock:`, belong to virtual machines.
        _ => return Err(NotifyError::Address(address.to_owned())),
    };
    let socket_address = socket_address.map_err(failed)?;
    let socket = UnixDatagram::unbound().map_err(failed)?;
    // The queue of a listener that does not read fills up, and the supervising loop must not wait for it.
    socket.set_nonblocking(true).map_err(failed)?;
    socket.send_to_addr(format!("{assignment}\n").as_bytes(), &socket_address).map_err(failed)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sockets_with_a_path_and_abstract_ones_are_notified() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let name = format!("leo-notify-{}", std::process::id());
        let abstract_address = SocketAddr::from_abstract_name(&name).unwrap();
        let cases = [
            (path.clone().into_os_string(), UnixDatagram::bind(&path).unwrap()),
            (format!("@{name}").into(), UnixDatagram::bind_addr(&abstract_address).unwrap()),
        ];
        for (address, socket) in cases {
            send(&address, "READY=1").unwrap();
            let mut bytes = [0; 64];
            let count = socket.recv(&mut bytes).unwrap();
            assert_eq!(&bytes[..count], b"READY=1\n", "{}", address.display());
        }
    }

    #[test]
    fn a_listener_that_does_not_read_is_an_error_and_blocks_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let _unread = UnixDatagram::bind(&path).unwrap();
        // Far more messages than the queue of a socket takes.
        let error = (0..100_000).find_map(|_| send(path.as_os_str(), "WATCHDOG=1").err()).unwrap();
        let NotifyError::Send { source, .. } = &error else { panic!("{error:?}") };
        assert_eq!(source.kind(), io::ErrorKind::WouldBlock, "{error}");
        assert!(error.to_string().contains("does the service manager listen there?"), "{error}");
    }

    #[test]
    fn addresses_of_other_kinds_and_without_a_listener_are_refused_by_name() {
        let refused = ["vsock:2:9999", "notify", "@", "/nowhere/notify"].map(|address| {
            let error = send(address.as_ref(), "READY=1").unwrap_err();
            assert_eq!(matches!(error, NotifyError::Address(_)), !address.starts_with('/'), "{error:?}");
            error.to_string()
        });
        insta::assert_snapshot!(refused.join("\n"));
    }
}
