//! One end of a session: pure state, driven by frames, messages and instants.

use std::sync::Arc;

use clock::{Duration, Instant};

use crate::Stream;
use crate::inbox::{Inbox, New};
use crate::offset::Offset;
use crate::outbox::{Outbox, Place};
use crate::window::Window;
use crate::wire::{Bundle, Pulse};

/// Heartbeat period; a heartbeat also follows every received batch.
const PULSE_EVERY: Duration = Duration::from_millis(50);
/// Minimum time-out of the peer.
const SILENT_AFTER: Duration = Duration::from_millis(1500);
/// The time-out in round trips: a heartbeat may wait behind batches.
const SILENT_BEYOND: u32 = 3;

/// Maximum time-out: the round trip depends on what the peer reports.
const SILENT_MOST: Duration = Duration::from_secs(10);

/// One end of a session.
#[derive(Debug)]
pub struct Talk {
    life: u64,
    number: u64,
    /// Number of the last batch with reliable frames.
    said_in: u64,
    pub(crate) outbox: Outbox,
    window: Window,
    pub(crate) inbox: Inbox,
    pub(crate) offset: Offset,
    peer: Option<Peer>,
    pulse_at: Instant,
    owes_pulse: bool,
    pub(crate) hearings: u64,
    /// Messages of a machine other than the connected peer.
    pub(crate) strange: u64,
    /// Whether one was received since the last message of the peer.
    is_strange: bool,
    is_crowded: bool,
    pub(crate) round_trip: Duration,
    /// Number of new local subscribers to the latched topic.
    pub(crate) joined: u64,
    /// The session in which the peer last reported new subscribers, and their number.
    joined_there: (u64, u64),
    owes_telling: bool,
}

#[derive(Clone, Copy, Debug)]
struct Peer {
    life: u64,
    heard_at: Instant,
    sent_ns: u64,
    received_ns: u64,
    /// Whether the peer was sent what it needs to compute the clock offset. It ignores frames before that.
    is_answered: bool,
}

/// A received batch.
#[derive(Debug)]
pub struct Came {
    /// Its new frames.
    pub new: New,
    /// Transit time, and this machine's clock minus the peer's; `None` before the offset is known.
    pub way: Option<(Duration, i64)>,
}

impl Talk {
    /// A session without a peer. `life` is the epoch of this process; `streams` are those that it sends.
    #[must_use]
    pub fn new(life: u64, streams: &[Stream], now: Instant) -> Self {
        Self {
            life,
            number: 0,
            said_in: 0,
            outbox: Outbox::new(streams),
            window: Window::new(),
            inbox: Inbox::default(),
            offset: Offset::default(),
            peer: None,
            pulse_at: now,
            owes_pulse: false,
            hearings: 0,
            strange: 0,
            is_strange: false,
            is_crowded: false,
            round_trip: Duration::ZERO,
            joined: 0,
            joined_there: (0, 0),
            owes_telling: false,
        }
    }

    /// Whether the peer is connected.
    #[must_use]
    pub fn is_heard(&self) -> bool {
        self.peer.is_some()
    }

    /// Whether messages of two peers alternate: one of them does not belong to this robot.
    pub(crate) fn is_crowded(&self) -> bool {
        self.is_crowded
    }

    /// Queues a frame that was written on this machine.
    pub fn push(&mut self, now: Instant, stream: Stream, place: Place, bytes: Arc<[u8]>) {
        self.outbox.push(now, stream, place, bytes);
    }

    /// Processes a heartbeat of the peer, received at `at`.
    pub fn hear_pulse(&mut self, at: Instant, pulse: &Pulse) {
        if !self.meet(at, pulse.life) {
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
        let joined_there = (self.hearings, pulse.joined);
        self.owes_telling |= pulse.joined > 0 && joined_there != self.joined_there;
        self.joined_there = joined_there;
        if pulse.of_life == self.life {
            self.window.came(at, pulse.newest);
            self.outbox.wanted(pulse.wanted);
            // A later batch arrived without the reliable frames: they were lost.
            if pulse.newest >= self.said_in && self.outbox.awaits() {
                self.outbox.again();
            }
        }
    }

    /// Processes a batch received at `at`; `None` if it is from a foreign peer.
    pub fn hear_bundle(&mut self, at: Instant, bundle: Bundle) -> Option<Came> {
        if !self.meet(at, bundle.life) {
            return None;
        }
        self.owes_pulse = true;
        let way = self.offset.estimate_ns().map(|ahead_ns| {
            let sent_ns = bundle.sent_ns.saturating_add_signed(ahead_ns.saturating_neg());
            (at.since(Instant::from_nanos(sent_ns)), ahead_ns.saturating_neg())
        });
        // Without the offset the frames are not usable. They are sent again or replaced.
        let new = if way.is_some() { self.inbox.take(bundle) } else { New::default() };
        Some(Came { new, way })
    }

    /// Whether the latched topic has to be replayed to the peer's subscribers; resets the flag.
    pub fn take_newcomers(&mut self) -> bool {
        std::mem::take(&mut self.owes_telling)
    }

    /// Whether a message is from the connected peer, which is identified by its epoch. The first peer stays
    /// connected until it times out: otherwise a second one with the same name would reset the session with
    /// every message.
    fn meet(&mut self, at: Instant, life: u64) -> bool {
        let patience = self.patience();
        match &mut self.peer {
            Some(peer) if peer.life == life => {
                peer.heard_at = at;
                // After a restart of the peer, messages of its former epoch do not alternate with new ones.
                self.is_crowded |= std::mem::take(&mut self.is_strange);
                true
            }
            Some(peer) if at.since(peer.heard_at) <= patience => {
                self.is_strange = true;
                self.strange += 1;
                false
            }
            _ => {
                self.peer = Some(Peer { life, heard_at: at, sent_ns: 0, received_ns: 0, is_answered: false });
                self.is_strange = false;
                self.hearings += 1;
                self.offset.forget();
                self.part();
                true
            }
        }
    }

    /// The current time-out of the peer.
    fn patience(&self) -> Duration {
        SILENT_AFTER.max(self.round_trip.min(SILENT_MOST) * SILENT_BEYOND).min(SILENT_MOST)
    }

    fn part(&mut self) {
        self.window.clear();
        self.outbox.again();
    }

    /// Checks the time-outs of the peer and of unacknowledged batches.
    pub fn listen(&mut self, now: Instant) {
        let patience = self.patience();
        if self.peer.is_some_and(|peer| now.since(peer.heard_at) > patience) {
            self.peer = None;
            self.part();
        }
        if self.window.give_up(now) {
            self.outbox.again();
        }
    }

    /// The heartbeat to send now, if one is due.
    pub fn pulse(&mut self, now: Instant) -> Option<Pulse> {
        if now < self.pulse_at && !self.owes_pulse {
            return None;
        }
        self.owes_pulse = false;
        self.pulse_at = now + PULSE_EVERY;
        let (of_life, newest, wanted) = self.inbox.heard();
        let (asked_ns, heard_ns) = self.peer.map_or((0, 0), |peer| (peer.sent_ns, peer.received_ns));
        if let Some(peer) = &mut self.peer {
            peer.is_answered |= asked_ns != 0;
        }
        let (life, sent_ns, joined) = (self.life, now.as_nanos(), self.joined);
        Some(Pulse { life, sent_ns, asked_ns, heard_ns, of_life, newest, wanted, joined })
    }

    /// The batch to send now, if there are frames and the window has room.
    pub fn bundle(&mut self, now: Instant) -> Option<Bundle> {
        if !self.peer.is_some_and(|peer| peer.is_answered) || !self.window.has_room() {
            return None;
        }
        let load = self.outbox.load(now)?;
        self.number += 1;
        if load.numbered > 0 {
            self.said_in = self.number;
        }
        let bytes = load.frames.iter().map(|frame| frame.bytes.len()).sum();
        self.window.sent(now, self.number, bytes);
        Some(Bundle {
            life: self.life,
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
