//! Raw ttys and pseudo-terminals with deadlines below a millisecond.
//!
//! [`Tty`] opens a serial line. [`Pty`] creates one whose other end is this process. Both transfer bytes unchanged,
//! wait until an instant of the monotonic clock at most, and do not allocate once they are open.

mod error;
mod port;
mod pty;
mod tty;

pub use error::{LineLostError, OpenError};
pub use pty::Pty;
pub use tty::Tty;
