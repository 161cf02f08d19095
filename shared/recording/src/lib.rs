//! Recordings: what the robot's buffers hold, byte by byte, in an MCAP file; and beside it what common
//! viewers show of it.
//!
//! A [`Writer`] puts down one [`Frame`] after the other, from [`Inlets`] of a robot in lockstep time, or
//! by a [`Recorder`] that looks at a running one. A [`Reader`] gives them back, and a [`Difference`] says
//! where two differ. `docs/recording.md` describes the file.

mod about;
mod blocks;
mod buffer;
mod cdr;
mod counts;
mod difference;
mod error;
mod frame;
mod fused;
mod inlets;
mod marker;
mod reader;
mod recorder;
mod ring;
mod room;
mod views;
mod writer;

pub use about::{About, Subject, Time, stands};
pub use buffer::Buffer;
pub use counts::{Count, Counts};
pub use difference::Difference;
pub use error::{ReadError, RecordError};
pub use frame::Frame;
pub use inlets::Inlets;
pub use reader::Reader;
pub use recorder::Recorder;
pub use ring::{Last, NotSaved, Ring};
pub use writer::{NotBegun, Writer};
