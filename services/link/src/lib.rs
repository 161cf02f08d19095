//! Link process: bridges topics between two machines over QUIC.
//!
//! A link process runs on each of the two machines. It subscribes to the topics written on its machine and
//! publishes the topics written on the other one. Local writers are not affected. QUIC is used only in this
//! crate.
//!
//! No process blocks on the network. If it is slower than a writer, newer frames replace older unsent ones.
//! Frames of reliable topics are kept until the peer acknowledges them. The amount of data in flight follows
//! the delay, so that received frames are young. Timestamps are converted to the reader's clock, and the
//! link's health board has the bound of the clock error.

mod compatibility;
mod inbox;
mod instants;
mod io;
mod offset;
mod order;
mod outbox;
mod session;
mod slots;
mod window;
mod wire;

pub use compatibility::{Compatibility, IncompatiblePeer};
pub use inbox::NewFrames;
pub use instants::TimestampFields;
pub use io::net::KeyError;
pub use io::run::{check, run};
pub use offset::{ClockExchange, ClockOffset};
pub use session::{ReceivedBatch, Session};
pub use wire::{Batch, DecodeError, Frame, Heartbeat};
