//! All input and output of this process: shared memory, sockets and threads.

mod handshake;
pub(crate) mod listener;
pub(crate) mod live_view;
mod server;
mod session;
mod shared;
