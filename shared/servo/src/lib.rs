//! ROBOTIS X-series servos: the protocol, the control table, and a simulated servo.
//!
//! A pure codec of Dynamixel Protocol 2.0 (<https://emanual.robotis.com/docs/en/dxl/protocol2/>): no I/O, no clock, no
//! allocation. [`Instruction`] is an instruction packet of the host, [`Status`] a status packet of a servo. Both are
//! encoded to bytes and parsed from a [`Frame`] that a [`Parser`] finds in a byte stream with arbitrary noise.
//!
//! ```
//! use servo::{Id, Instruction, Parser};
//! let mut bytes = [0; 16];
//! let length = Instruction::Ping.encode(Id::new(1).unwrap().into(), &mut bytes)?;
//! assert_eq!(&bytes[..length], [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4E]);
//!
//! let mut parser = Parser::new();
//! parser.push(b"noise");
//! parser.push(&bytes[..length]);
//! assert_eq!(Instruction::parse(&parser.next_frame().unwrap()), Ok(Instruction::Ping));
//! # Ok::<(), servo::BufferTooShortError>(())
//! ```

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
