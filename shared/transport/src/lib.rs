//! Publish-subscribe and boards in shared memory between Leo's processes, on top of iceoryx2.
//!
//! A [`Domain`] isolates the processes of one robot: two domains on a machine share nothing. A process
//! [joins](Node::join) a domain, and opens [`FramePublisher`]s (publishers) and [`FrameSubscriber`]s (subscribers) on
//! the topics of the `message` crate. Each topic has exactly one writer. Frames are written and read in place in shared
//! memory, without copies or serialisation.
//!
//! Under a supervisor, subscribers accept frames only from the processes on its roster: see [`Node::follow_roster`].
//!
//! A slow subscriber affects only itself: if its queue is full, its oldest frame is dropped, which shows as a gap of
//! the sequence numbers. In lockstep time nothing may be dropped, so a full queue is an error that names the topic.
//!
//! Only this crate uses iceoryx2. Per frame, iceoryx2 0.10 allocates once on the heap of the publisher (48 bytes, for
//! the loan) and never at the subscriber.

pub mod bare;
mod board;
mod domain;
mod error;
mod inlet;
pub mod janitor;
mod node;
mod outlet;
mod queues;
mod reserve;
mod segment;
mod service;
mod topic_ports;
mod writers;

pub use board::{
    Board, BoardReader, BoardWriter, CurrentBoard, HealthReader, HealthWriter, RosterReader, RosterWriter,
};
pub use domain::{Domain, DomainError, IncompatibleProgramError};
pub use error::{JoinError, PortError, ReceiveError, SendError};
pub use inlet::{Frame, FrameSubscriber};
pub use node::Node;
pub use outlet::FramePublisher;
pub use queues::{OverflowPolicy, Queues};
pub use reserve::ReserveError;
pub use segment::{Replaced, Segment};
pub use topic_ports::TopicPorts;
pub use writers::RefusedFrames;
