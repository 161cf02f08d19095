//! Raw ttys and pseudo-terminals with deadlines below a millisecond.
//!
//! [`Tty`] opens a serial line, [`Pty`] makes one whose other end this process is. Both carry
//! bytes as they are, wait until an instant of the monotonic clock and no longer, and allocate
//! nothing once they are open.

mod error;
mod port;
mod pty;
mod tty;

pub use error::{Lost, OpenError};
pub use pty::Pty;
pub use tty::Tty;
