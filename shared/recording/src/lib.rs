//! Recordings of the robot's buffers as MCAP files: the raw frames, and messages for common viewers.
//!
//! A [`Writer`] writes [`Frame`]s that [`BufferSubscribers`] deliver in lockstep time, or that a [`Recorder`] takes
//! from a running robot. A [`Reader`] reads them, and a [`Difference`] describes where two differ. [`ViewerMessages`]
//! converts frames into messages for common viewers. `docs/recording.md` describes the file format.

mod about;
mod blocks;
mod cdr;
mod channel;
mod counts;
mod difference;
mod disk_space;
mod error;
mod fail_fast_writer;
mod frame;
mod marker;
mod pipe_writer;
mod reader;
mod recorder;
mod renamed;
mod ring;
mod subscribers;
mod viewer_messages;
mod writer;

pub use about::{About, Subject, Time, robot_pose};
pub use channel::{Channel, recorded_topics};
pub use counts::{Count, Counts};
pub use difference::Difference;
pub use error::{ReadError, RecordError};
pub use frame::Frame;
pub use reader::Reader;
pub use recorder::Recorder;
pub use ring::{Ring, RingSnapshot, SaveError};
pub use subscribers::BufferSubscribers;
pub use viewer_messages::{Schema, ViewerMessage, ViewerMessages};
pub use writer::{StartError, Writer};
