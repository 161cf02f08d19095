//! One end of the link: pure, over the frames and the messages that it is told.

use std::sync::Arc;

use clock::{Duration, Instant};

use crate::Stream;
use crate::inbox::{Inbox, New};
use crate::offset::Offset;
use crate::outbox::{Outbox, Place};
use crate::window::Window;
use crate::wire::{Bundle, Pulse};

/// A pulse is sent this often, and after every bundle that came.
const PULSE_EVERY: Duration = Duration::from_millis(50);
/// Who was not heard for so long is not there.
const SILENT_AFTER: Duration = Duration::from_millis(1500);
/// With a way of so many seconds, silence begins later: a pulse that waits behind bundles is on its way.
const SILENT_BEYOND: u32 = 3;

/// ... and so late at most: the round trip is what the other machine says.
const SILENT_MOST: Duration = Duration::from_secs(10);

/// One end of the link.
#[derive(Debug)]
pub struct Talk {
    life: u64,
    number: u64,
    /// The last bundle that held frames of which every one is wanted.
    said_in: u64,
    pub(crate) outbox: Outbox,
    window: Window,
    pub(crate) inbox: Inbox,
    pub(crate) offset: Offset,
    peer: Option<Peer>,
    pulse_at: Instant,
    owes_pulse: bool,
    pub(crate) hearings: u64,
    /// Messages of a machine that is not the one that is heard.
    pub(crate) strange: u64,
    /// Whether one came since the other machine was heard last.
    is_strange: bool,
    is_crowded: bool,
    pub(crate) round_trip: Duration,
    /// How often somebody began to listen here to what newcomers are told once more.
    pub(crate) joined: u64,
    /// How often that was so on the other machine, and in which of its hearings.
    joined_there: (u64, u64),
    owes_telling: bool,
}

#[derive(Clone, Copy, Debug)]
struct Peer {
    life: u64,
    heard_at: Instant,
    sent_ns: u64,
    received_ns: u64,
    /// Whether it was told what it needs to know the difference of the clocks: before, it takes no frames.
    is_answered: bool,
}

/// A bundle that came.
#[derive(Debug)]
pub struct Came {
    /// What of it is new.
    pub new: New,
    /// How long it was under way, and what this machine's clock is ahead of the other's by; `None` before that is
    /// known.
    pub way: Option<(Duration, i64)>,
}

impl Talk {
    /// An end that has heard nobody yet, of a life of the link process, for frames of these streams.
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

    /// Whether the other machine is heard.
    #[must_use]
    pub fn is_heard(&self) -> bool {
        self.peer.is_some()
    }

    /// Whether two other machines were heard by turns: one of them is none of this robot's.
    pub(crate) fn is_crowded(&self) -> bool {
        self.is_crowded
    }

    /// A frame that somebody on this machine wrote.
    pub fn push(&mut self, now: Instant, stream: Stream, place: Place, bytes: Arc<[u8]>) {
        self.outbox.push(now, stream, place, bytes);
    }

    /// A pulse of the other machine, heard at `at`.
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
        // Whoever listened through a silence may have missed what was given up meanwhile.
        let joined_there = (self.hearings, pulse.joined);
        self.owes_telling |= pulse.joined > 0 && joined_there != self.joined_there;
        self.joined_there = joined_there;
        if pulse.of_life == self.life {
            self.window.came(at, pulse.newest);
            self.outbox.wanted(pulse.wanted);
            // What was said on the way was lost where a later bundle came without it.
            if pulse.newest >= self.said_in && self.outbox.awaits() {
                self.outbox.again();
            }
        }
    }

    /// A bundle of the other machine, heard at `at`; `None` where it is of yet another one.
    pub fn hear_bundle(&mut self, at: Instant, bundle: Bundle) -> Option<Came> {
        if !self.meet(at, bundle.life) {
            return None;
        }
        self.owes_pulse = true;
        let way = self.offset.estimate_ns().map(|ahead_ns| {
            let sent_ns = bundle.sent_ns.saturating_add_signed(ahead_ns.saturating_neg());
            (at.since(Instant::from_nanos(sent_ns)), ahead_ns.saturating_neg())
        });
        // Without it nothing can be made of it: it comes again, or something newer.
        let new = if way.is_some() { self.inbox.take(bundle) } else { New::default() };
        Some(Came { new, way })
    }

    /// Whether those who listen on the other machine have yet to be told what newcomers are told; once for each time.
    pub fn take_newcomers(&mut self) -> bool {
        std::mem::take(&mut self.owes_telling)
    }

    /// Whether it is the other machine that is heard, of this life. The first one stays it until it is silent: a
    /// second one with the same name would else begin everything anew with each word of either.
    fn meet(&mut self, at: Instant, life: u64) -> bool {
        let patience = self.patience();
        match &mut self.peer {
            Some(peer) if peer.life == life => {
                peer.heard_at = at;
                // A life that ended is not heard after the one that follows it.
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

    /// Who was not heard for longer is not there.
    fn patience(&self) -> Duration {
        SILENT_AFTER.max(self.round_trip.min(SILENT_MOST) * SILENT_BEYOND).min(SILENT_MOST)
    }

    fn part(&mut self) {
        self.window.clear();
        self.outbox.again();
    }

    /// Notes who has not been heard for too long.
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

    /// The pulse to be sent now, if one is due.
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

    /// The bundle to be sent now, if there is anything to send and the network has room for it.
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
