//! One end of a session: pure state, driven by frames, messages and instants.

use std::sync::Arc;

use clock::{Duration, Instant};
use message::TopicId;

use crate::inbox::{Inbox, NewFrames};
use crate::offset::ClockOffset;
use crate::outbox::{FrameNumber, Outbox};
use crate::window::Window;
use crate::wire::{Batch, Heartbeat};

/// Heartbeat period; a heartbeat also follows every received batch.
const PULSE_EVERY: Duration = Duration::from_millis(50);
/// Minimum time-out of the peer.
const MIN_PEER_TIMEOUT: Duration = Duration::from_millis(1500);
/// The time-out in round trips: a heartbeat may wait behind batches.
const SILENT_BEYOND: u32 = 3;

/// Maximum time-out: the round trip depends on what the peer reports.
const MAX_PEER_TIMEOUT: Duration = Duration::from_secs(10);

/// One end of a session.
#[derive(Debug)]
pub struct Session {
    epoch: u64,
    number: u64,
    /// Number of the last batch with reliable frames.
    last_reliable_batch: u64,
    pub(crate) outbox: Outbox,
    window: Window,
    pub(crate) inbox: Inbox,
    pub(crate) offset: ClockOffset,
    peer: Option<Peer>,
    pulse_at: Instant,
    heartbeat_due: bool,
    pub(crate) established: u64,
    /// Messages of a machine other than the connected peer.
    pub(crate) foreign_messages: u64,
    /// Whether one was received since the last message of the peer.
    is_strange: bool,
    pub(crate) has_second_peer: bool,
    pub(crate) round_trip: Duration,
    /// Number of new local subscribers to the latched topic.
    pub(crate) latched_subscribers: u64,
    /// The session in which the peer last reported new subscribers, and their number.
    remote_latched_subscribers: (u64, u64),
    resync_pending: bool,
}

#[derive(Clone, Copy, Debug)]
struct Peer {
    epoch: u64,
    heard_at: Instant,
    sent_ns: u64,
    received_ns: u64,
    /// Whether the peer was sent what it needs to compute the clock offset. It ignores frames before that.
    is_answered: bool,
}

/// A received batch.
#[derive(Debug)]
pub struct ReceivedBatch {
    /// Its new frames.
    pub new: NewFrames,
    /// Transit time, and this machine's clock minus the peer's; `None` before the offset is known.
    pub transit: Option<(Duration, i64)>,
}

impl Session {
    /// A session without a peer. `epoch` is the epoch of this process; `topics` are those that it sends.
    #[must_use]
    pub fn new(epoch: u64, topics: &[TopicId], now: Instant) -> Self {
        Self {
            epoch,
            number: 0,
            last_reliable_batch: 0,
            outbox: Outbox::new(topics),
            window: Window::new(),
            inbox: Inbox::default(),
            offset: ClockOffset::default(),
            peer: None,
            pulse_at: now,
            heartbeat_due: false,
            established: 0,
            foreign_messages: 0,
            is_strange: false,
            has_second_peer: false,
            round_trip: Duration::ZERO,
            latched_subscribers: 0,
            remote_latched_subscribers: (0, 0),
            resync_pending: false,
        }
    }

    /// Whether the peer is connected.
    #[must_use]
    pub fn is_up(&self) -> bool {
        self.peer.is_some()
    }

    /// Queues a frame that was written on this machine.
    pub fn push(&mut self, now: Instant, topic: TopicId, number: FrameNumber, bytes: Arc<[u8]>) {
        self.outbox.push(now, topic, number, bytes);
    }

    /// Processes a heartbeat of the peer, received at `at`.
    pub fn receive_heartbeat(&mut self, at: Instant, pulse: &Heartbeat) {
        if !self.meet(at, pulse.epoch) {
            return;
        }
        let now_ns = at.as_nanos();
        if let Some(peer) = &mut self.peer {
            peer.heard_at = at;
            peer.sent_ns = pulse.sent_ns;
            peer.received_ns = now_ns;
        }
        if let Some(exchange) = pulse.exchange(now_ns) {
            self.offset.learn(at, &exchange);
            self.round_trip = exchange.round_trip().unwrap_or(self.round_trip);
        }
        // Existing subscribers may have missed frames that were given up during a disconnection.
        let remote_latched_subscribers = (self.established, pulse.latched_subscribers);
        self.resync_pending |=
            pulse.latched_subscribers > 0 && remote_latched_subscribers != self.remote_latched_subscribers;
        self.remote_latched_subscribers = remote_latched_subscribers;
        if pulse.acked_epoch == self.epoch {
            self.window.came(at, pulse.newest);
            self.outbox.wanted(pulse.wanted);
            // A later batch arrived without the reliable frames: they were lost.
            if pulse.newest >= self.last_reliable_batch && self.outbox.has_unacked() {
                self.outbox.again();
            }
        }
    }

    /// Processes a batch received at `at`; `None` if it is from a foreign peer.
    pub fn receive_batch(&mut self, at: Instant, bundle: Batch) -> Option<ReceivedBatch> {
        if !self.meet(at, bundle.epoch) {
            return None;
        }
        self.heartbeat_due = true;
        let transit = self.offset.estimate_ns().map(|ahead_ns| {
            let sent_ns = bundle.sent_ns.saturating_add_signed(ahead_ns.saturating_neg());
            (at.since(Instant::from_nanos(sent_ns)), ahead_ns.saturating_neg())
        });
        // Without the offset the frames are not usable. They are sent again or replaced.
        let new = if transit.is_some() { self.inbox.take(bundle) } else { NewFrames::default() };
        Some(ReceivedBatch { new, transit })
    }

    /// Whether the latched topic has to be replayed to the peer's subscribers; resets the flag.
    pub fn take_replay_request(&mut self) -> bool {
        std::mem::take(&mut self.resync_pending)
    }

    /// Whether a message is from the connected peer, which is identified by its epoch. The first peer stays
    /// connected until it times out: otherwise a second one with the same name would reset the session with
    /// every message.
    fn meet(&mut self, at: Instant, epoch: u64) -> bool {
        let peer_timeout = self.peer_timeout();
        match &mut self.peer {
            Some(peer) if peer.epoch == epoch => {
                peer.heard_at = at;
                // After a restart of the peer, messages of its former epoch do not alternate with new ones.
                self.has_second_peer |= std::mem::take(&mut self.is_strange);
                true
            }
            Some(peer) if at.since(peer.heard_at) <= peer_timeout => {
                self.is_strange = true;
                self.foreign_messages += 1;
                false
            }
            _ => {
                self.peer =
                    Some(Peer { epoch, heard_at: at, sent_ns: 0, received_ns: 0, is_answered: false });
                self.is_strange = false;
                self.established += 1;
                self.offset.forget();
                self.part();
                true
            }
        }
    }

    /// The current time-out of the peer.
    fn peer_timeout(&self) -> Duration {
        MIN_PEER_TIMEOUT.max(self.round_trip.min(MAX_PEER_TIMEOUT) * SILENT_BEYOND).min(MAX_PEER_TIMEOUT)
    }

    fn part(&mut self) {
        self.window.clear();
        self.outbox.again();
    }

    /// Checks the time-outs of the peer and of unacknowledged batches.
    pub fn listen(&mut self, now: Instant) {
        let peer_timeout = self.peer_timeout();
        if self.peer.is_some_and(|peer| now.since(peer.heard_at) > peer_timeout) {
            self.peer = None;
            self.part();
        }
        if self.window.give_up(now) {
            self.outbox.again();
        }
    }

    /// The heartbeat to send now, if one is due.
    pub fn pulse(&mut self, now: Instant) -> Option<Heartbeat> {
        if now < self.pulse_at && !self.heartbeat_due {
            return None;
        }
        self.heartbeat_due = false;
        self.pulse_at = now + PULSE_EVERY;
        let (acked_epoch, newest, wanted) = self.inbox.heard();
        let (asked_ns, heard_ns) = self.peer.map_or((0, 0), |peer| (peer.sent_ns, peer.received_ns));
        if let Some(peer) = &mut self.peer {
            peer.is_answered |= asked_ns != 0;
        }
        let (epoch, sent_ns, latched_subscribers) = (self.epoch, now.as_nanos(), self.latched_subscribers);
        Some(Heartbeat {
            epoch,
            sent_ns,
            asked_ns,
            heard_ns,
            acked_epoch,
            newest,
            wanted,
            latched_subscribers,
        })
    }

    /// The batch to send now, if there are frames and the window has room.
    pub fn bundle(&mut self, now: Instant) -> Option<Batch> {
        if !self.peer.is_some_and(|peer| peer.is_answered) || !self.window.has_room() {
            return None;
        }
        let load = self.outbox.load(now)?;
        self.number += 1;
        if load.numbered > 0 {
            self.last_reliable_batch = self.number;
        }
        let bytes = load.frames.iter().map(|frame| frame.bytes.len()).sum();
        self.window.sent(now, self.number, bytes);
        Some(Batch {
            epoch: self.epoch,
            number: self.number,
            sent_ns: now.as_nanos(),
            oldest: load.oldest,
            first: load.first,
            numbered: load.numbered,
            frames: load.frames,
        })
    }
}

#[cfg(test)]
mod tests;
