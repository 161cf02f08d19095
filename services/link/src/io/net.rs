//! The network: bytes to the other machine and from it, over QUIC, on a thread of its own.

use std::thread::JoinHandle;

use clock::Instant;
use config::leo::Link;
use crossbeam::channel::{Receiver, bounded};
use rustls::pki_types::UnixTime;
use tokio::sync::mpsc::{self, Sender, error::TrySendError};
use tokio::task::LocalSet;

use crate::agreement::Agreement;

mod congestion;
mod handshakes;
mod incoming;
mod keys;
mod peers;
mod refusal;
mod verifier;

pub use keys::KeyError;
pub(crate) use keys::Keys;

/// Messages that wait for the network, and for the loop.
const OUTGOING: usize = 4;
const INCOMING: usize = 256;

/// What a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sort {
    /// A pulse: waits for nothing, and is not said again where it is lost.
    Pulse,
    /// A bundle of frames: they come in order.
    Bundle,
}

/// A message that came.
#[derive(Debug)]
pub(crate) struct Message {
    pub(crate) sort: Sort,
    pub(crate) at: Instant,
    pub(crate) bytes: Vec<u8>,
}

/// The network as the loop has it: neither sending nor receiving waits. Dropping it takes leave of the other machine.
#[derive(Debug)]
pub(crate) struct Net {
    to: Option<Sender<(Sort, Vec<u8>)>>,
    from: Receiver<Message>,
    thread: Option<JoinHandle<()>>,
}

impl Net {
    /// Begins to connect, and goes on by itself.
    ///
    /// Of a machine that does not agree, no bundle is taken into memory.
    pub(crate) fn start(link: &Link, agreement: Agreement) -> Result<Self, String> {
        let keys = Keys::read(link).map_err(|error| error.to_string())?;
        if let Some(refusal) = keys.own_refusal(link, UnixTime::now()) {
            tracing::warn!("{refusal}");
        }
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(|error| format!("the link's network cannot be used: {error}"))?;
        let (to, outgoing) = mpsc::channel(OUTGOING);
        let (incoming, from) = bounded(INCOMING);
        let (listen, connect) = (link.listen.clone(), link.connect.clone());
        let carry = move || {
            let carried = peers::carry(keys, agreement, listen, connect, incoming, outgoing);
            runtime.block_on(LocalSet::new().run_until(carried));
            // A name that is still being looked up is not waited for.
            runtime.shutdown_background();
        };
        let thread = std::thread::Builder::new().name("link-net".to_owned()).spawn(carry);
        let thread = thread.map_err(|error| error.to_string())?;
        Ok(Self { to: Some(to), from, thread: Some(thread) })
    }

    /// Whether nothing goes out and comes in any more, for good: its thread is gone.
    pub(crate) fn is_over(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Whether a message could be handed over now.
    pub(crate) fn has_room(&self) -> bool {
        self.to.as_ref().is_some_and(|to| to.capacity() > 0)
    }

    /// Hands over a message. Where the network is busy it is dropped, as if it were lost on the way.
    pub(crate) fn send(&self, sort: Sort, bytes: Vec<u8>) {
        let Some(to) = &self.to else { return };
        match to.try_send((sort, bytes)) {
            Ok(()) | Err(TrySendError::Full(_) | TrySendError::Closed(_)) => {}
        }
    }

    /// A message that came.
    pub(crate) fn receive(&self) -> Option<Message> {
        self.from.try_recv().ok()
    }
}

impl Drop for Net {
    fn drop(&mut self) {
        // Its thread ends when nobody can send any more.
        self.to = None;
        if let Some(thread) = self.thread.take() {
            // What panicked there has been told by then.
            let _ended = thread.join();
        }
    }
}

/// Where what is sent comes out in a test, and where what comes is put in.
#[cfg(test)]
pub(crate) type Ends = (mpsc::Receiver<(Sort, Vec<u8>)>, crossbeam::channel::Sender<Message>);

#[cfg(test)]
impl Net {
    /// A network that tests carry.
    pub(crate) fn by_hand() -> (Self, Ends) {
        let (to, outgoing) = mpsc::channel(OUTGOING);
        let (incoming, from) = bounded(INCOMING);
        (Self { to: Some(to), from, thread: None }, (outgoing, incoming))
    }
}

#[cfg(test)]
mod tests;
