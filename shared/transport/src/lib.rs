//! Shared memory between Leo's processes.
//!
//! A [`Domain`] is a place of its own: two domains on one machine exchange nothing. A process
//! [joins](Node::join) one and opens [`Outlet`]s and [`Inlet`]s on topics of the `message` crate,
//! each of which has exactly one writer. Frames are written in place in shared memory and read in
//! place: nothing is copied or serialised between processes.
//!
//! Where a supervisor runs, readers take frames only from the processes that its roster names: see
//! [`Node::follow_roster`].
//!
//! A slow reader costs nobody anything but its own drops: when its queue is full, the oldest
//! frame is dropped for it alone, and it sees the gap in the sequence numbers. In lockstep time
//! nothing may be dropped: there a full queue is an error that names the topic.
//!
//! Only this crate knows iceoryx2. Per frame, iceoryx2 0.10 allocates once on the heap of the
//! writer (48 bytes of bookkeeping of the loan) and never at the reader.

pub mod bare;
mod board;
mod domain;
mod error;
mod inlet;
pub mod janitor;
mod node;
mod outlet;
mod queues;
mod segment;
mod service;
mod writers;

pub use board::{
    BusesReader, BusesWriter, HealthReader, HealthWriter, JointsReader, JointsWriter, LinkReader, LinkWriter,
    PerspectivesReader, PerspectivesWriter, RosterReader, RosterWriter, SourcesReader, SourcesWriter,
};
pub use domain::{Domain, DomainError, OtherProgram};
pub use error::{JoinError, PortError, ReceiveError, SendError};
pub use inlet::{Frame, Inlet};
pub use node::Node;
pub use outlet::Outlet;
pub use queues::{Delivery, Queues};
pub use segment::{Replaced, Segment};
pub use writers::Unlisted;
