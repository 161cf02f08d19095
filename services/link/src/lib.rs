//! Link process: frames between this machine and another one.
//!
//! On each of two machines runs a link process. It reads the topics whose writers run there, as any reader does,
//! which costs those writers nothing, and publishes the topics whose writers run on the other one, in their stead.
//! Between the two go bundles of frames, over QUIC, whose library only this crate knows.
//!
//! Nobody waits for the network. Where it is slower than what is written, older frames are overtaken by newer ones
//! and never sent; what was said is kept until the other machine has it. How much may be under way follows the
//! delay, so that a frame that comes is young. Instants are told in the time of the machine that reads them, and
//! the link's board says how wrong they may be.

mod agreement;
mod inbox;
mod instants;
mod io;
mod offset;
mod outbox;
mod stream;
mod talk;
mod window;
mod wire;

pub use agreement::{Agreement, Disagreement};
pub use inbox::New;
pub use instants::Instants;
pub use io::net::KeyError;
pub use io::run::{check, run};
pub use offset::{Exchange, Offset};
pub use stream::{Class, Stream};
pub use talk::{Came, Talk};
pub use wire::{Bundle, Frame, Nonsense, Pulse};
