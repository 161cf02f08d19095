#![doc = include_str!("../README.md")]
//!
//! # Protocol
//!
//! A pure codec of Dynamixel Protocol 2.0 (<https://emanual.robotis.com/docs/en/dxl/protocol2/>). [`Instruction`] is an
//! instruction packet of the host, [`Status`] a status packet of a servo. Both are encoded to bytes and parsed from a
//! [`Frame`] that a [`Parser`] finds in a byte stream.

mod chain;
mod crc;
mod fast;
mod frame;
mod hardware;
mod id;
mod instruction;
pub mod mock;
mod model;
mod parser;
mod profile;
mod reading;
mod status;
pub mod table;

pub use chain::FastReplyWriter;
pub use fast::{FastReply, ReplyTooLongError};
pub use frame::{BufferTooShortError, Frame};
pub use hardware::HardwareErrors;
pub use id::{Address, Id};
pub use instruction::{Backup, Instruction, Reset, Span, spans, writes};
pub use model::{
    Model, acceleration_count, baud_number, baud_rate, position_count, position_rad, velocity_count,
    velocity_rad_s,
};
pub use parser::{Losses, Parser};
pub use profile::{Limits, Motion};
pub use reading::Reading;
pub use status::{Fault, Status};
