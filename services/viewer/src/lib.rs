//! Viewer process: serves the channels of a running robot to live viewers, such as Foxglove and Lichtblick.
//!
//! The channels and their messages are those of a recording. The core is the [`Hub`]: it holds the channels, and a
//! bounded queue for each viewer. [`LiveView`] reads the robot's frames and serves the hub by WebSocket.

mod channels;
mod hub;
mod io;
mod origin;
mod outbox;
mod protocol;

pub use hub::{ClientId, Hub, MAX_CLIENTS, Totals};
pub use io::listener::{ListenError, Listener};
pub use io::live_view::{LiveView, ViewError};
pub use origin::Origins;
pub use protocol::Outgoing;
