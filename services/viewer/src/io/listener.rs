//! The socket at which viewers connect.

use std::io;
use std::net::{SocketAddr, TcpListener};

/// A socket that listens for viewers.
#[derive(Debug)]
pub struct Listener {
    socket: TcpListener,
    address: SocketAddr,
}

/// Why viewers cannot connect at an address.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// Another program listens there.
    #[error(
        "{0} is in use: end the program that uses it (`ss -ltnp` names it), or choose another address with --listen"
    )]
    InUse(SocketAddr),
    /// The address is that of another machine, or its network is down.
    #[error(
        "this machine has no address {} now; `ip address` lists those that it has: choose one of them with --listen",
        _0.ip()
    )]
    Absent(SocketAddr),
    /// The system refuses the address.
    #[error("cannot listen at {address}: {source}; choose another address with --listen")]
    Refused {
        /// The address.
        address: SocketAddr,
        /// The error of the operating system.
        source: io::Error,
    },
}

impl Listener {
    /// Listens at an address. Port 0 stands for any free port.
    ///
    /// # Errors
    ///
    /// The address is in use, is not one of this machine, or is refused by the system.
    pub fn bind(address: SocketAddr) -> Result<Self, ListenError> {
        let bound = || {
            let socket = TcpListener::bind(address)?;
            // The server waits for it together with its other events.
            socket.set_nonblocking(true)?;
            let address = socket.local_addr()?;
            Ok(Self { socket, address })
        };
        bound().map_err(|source: io::Error| {
            if source.kind() == io::ErrorKind::AddrInUse {
                ListenError::InUse(address)
            } else if source.kind() == io::ErrorKind::AddrNotAvailable {
                ListenError::Absent(address)
            } else {
                ListenError::Refused { address, source }
            }
        })
    }

    /// The address, with the port that was chosen.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    pub(super) fn into_socket(self) -> TcpListener {
        self.socket
    }
}
