//! The network: sends and receives messages over QUIC on a thread of its own.

use std::thread::JoinHandle;

use clock::Instant;
use config::leo::Link;
use crossbeam::channel::{Receiver, bounded};
use rustls::pki_types::UnixTime;
use tokio::sync::mpsc::{self, Sender, error::TrySendError};
use tokio::task::LocalSet;

use crate::compatibility::Compatibility;

mod congestion;
mod handshakes;
mod incoming;
mod keys;
mod peers;
mod refusal;
mod reports;
mod verifier;

pub use keys::KeyError;
pub(crate) use keys::Keys;
use reports::Reports;

/// Capacities of the queues to and from the network thread, in messages.
const OUTGOING: usize = 4;
const INCOMING: usize = 256;

/// The kind of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MessageKind {
    /// Heartbeat: an unreliable datagram.
    Heartbeat,
    /// Batch of frames, reliable and in order.
    Batch,
}

/// A received message.
#[derive(Debug)]
pub(crate) struct Message {
    pub(crate) sort: MessageKind,
    pub(crate) at: Instant,
    pub(crate) bytes: Vec<u8>,
}

/// Handle of the network thread; sending and receiving never block. Dropping it closes all connections.
#[derive(Debug)]
pub(crate) struct Net {
    to: Option<Sender<(MessageKind, Vec<u8>)>>,
    from: Receiver<Message>,
    thread: Option<JoinHandle<()>>,
}

impl Net {
    /// Starts the thread, which keeps connecting.
    ///
    /// Batches of an incompatible peer are refused before they are in memory.
    pub(crate) fn start(link: &Link, compatibility: Compatibility) -> Result<Self, String> {
        let keys = Keys::read(link).map_err(|error| error.to_string())?;
        if let Some(refusal) = keys.own_refusal(link, UnixTime::now()) {
            tracing::warn!("{refusal}");
        }
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(|error| format!("the link's network cannot be used: {error}"))?;
        let (to, outgoing) = mpsc::channel(OUTGOING);
        let (incoming, from) = bounded(INCOMING);
        let (listen, connect) = (link.listen.clone(), link.connect.clone());
        let (reports, reporting) = Reports::start(keys.files.clone(), |line| tracing::warn!("{line}"))?;
        let carry = move || {
            let carried = peers::carry(keys, compatibility, reports, listen, connect, incoming, outgoing);
            runtime.block_on(LocalSet::new().run_until(carried));
            // Does not wait for a name lookup in progress.
            runtime.shutdown_background();
            // All connections are gone by now, and their last reports are logged.
            let _ended = reporting.join();
        };
        let thread = std::thread::Builder::new().name("link-net".to_owned()).spawn(carry);
        let thread = thread.map_err(|error| error.to_string())?;
        Ok(Self { to: Some(to), from, thread: Some(thread) })
    }

    /// Whether the thread has ended, which is permanent.
    pub(crate) fn is_over(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Whether a message can be queued now.
    pub(crate) fn has_room(&self) -> bool {
        self.to.as_ref().is_some_and(|to| to.capacity() > 0)
    }

    /// Queues a message. It is dropped if the queue is full, like a packet lost on the way.
    pub(crate) fn send(&self, sort: MessageKind, bytes: Vec<u8>) {
        let Some(to) = &self.to else { return };
        match to.try_send((sort, bytes)) {
            Ok(()) | Err(TrySendError::Full(_) | TrySendError::Closed(_)) => {}
        }
    }

    /// The next received message, if any.
    pub(crate) fn receive(&self) -> Option<Message> {
        self.from.try_recv().ok()
    }
}

impl Drop for Net {
    fn drop(&mut self) {
        // The thread ends when the last sender is dropped.
        self.to = None;
        if let Some(thread) = self.thread.take() {
            // The panic hook has reported any panic by now.
            let _ended = thread.join();
        }
    }
}

#[cfg(test)]
mod tests;
