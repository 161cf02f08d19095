//! Plays arbitrary bytes to one end of a session and checks its guarantees. Shared by a property test and a
//! fuzz target.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "helpers of tests may fail them")]

use std::sync::Arc;

use clock::{Duration, Instant};
use link_process::{Batch, Compatibility, Frame, Heartbeat, ReceivedBatch, Session, TimestampFields};
use message::TopicId;

/// Epoch of this end.
const LIFE: u64 = 7;
/// The peer's clock minus this one, in consistent messages.
const AHEAD_NS: u64 = 3_000_000_000;
/// Maximum time-out of the peer, whatever it sends.
const MAX_SILENCE: Duration = Duration::from_secs(10);
/// Maximum number of frames in a batch.
const MAX_FRAMES: usize = 1024;

/// Source of values from bytes; zeros at the end.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn some(&mut self, count: usize) -> &'a [u8] {
        let (now, later) = self.0.split_at(count.min(self.0.len()));
        self.0 = later;
        now
    }

    fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut taken = [0; N];
        let some = self.some(N);
        taken[..some.len()].copy_from_slice(some);
        taken
    }

    fn byte(&mut self) -> u8 {
        self.take::<1>()[0]
    }

    /// Mostly a small number, sometimes one near the end of the range, or any.
    fn number(&mut self) -> u64 {
        match self.byte() {
            0..=199 => u64::from(self.byte()),
            200..=227 => u64::MAX - u64::from(self.byte()),
            228.. => u64::from_le_bytes(self.take()),
        }
    }

    /// Mostly an instant near `now`, sometimes any number.
    fn instant(&mut self, now: Instant) -> u64 {
        match self.byte() {
            0..=199 => now.as_nanos().saturating_sub(u64::from(self.byte()) * 1_000_000),
            200.. => self.number(),
        }
    }

    fn topic(&mut self) -> TopicId {
        loop {
            let (code, number) = (u32::from(self.byte() % 10), u32::from(self.byte() % 4));
            let number = if matches!(code, 1 | 2) { number } else { 0 };
            if let Some(topic) = TopicId::of_link_code(code, number) {
                return topic;
            }
        }
    }

    fn frame(&mut self) -> Frame {
        let topic = self.topic();
        let length = usize::from(self.byte() / 4);
        Frame { topic, bytes: self.some(length).into() }
    }

    /// Mostly the same epoch.
    fn epoch(&mut self) -> u64 {
        match self.byte() {
            0..=229 => 1,
            230..=250 => 2,
            251.. => self.number(),
        }
    }

    /// Mostly a heartbeat with consistent timestamps and the peer's clock ahead.
    fn pulse(&mut self, now: Instant) -> Heartbeat {
        let mut pulse = Heartbeat {
            epoch: self.epoch(),
            sent_ns: now.as_nanos() + AHEAD_NS,
            asked_ns: now.as_nanos() - u64::from(self.byte()) * 1_000_000,
            heard_ns: now.as_nanos() + AHEAD_NS,
            acked_epoch: LIFE,
            newest: u64::from(self.byte()),
            wanted: u64::from(self.byte()),
            latched_subscribers: u64::from(self.byte() % 4),
        };
        if self.byte() >= 128 {
            pulse.sent_ns = self.instant(now);
            pulse.asked_ns = self.instant(now);
            pulse.heard_ns = self.instant(now);
            (pulse.acked_epoch, pulse.newest, pulse.wanted) = (self.number(), self.number(), self.number());
            pulse.latched_subscribers = self.number();
        }
        pulse
    }

    /// Mostly the next batch of its epoch.
    fn bundle(&mut self, now: Instant, next: u64) -> Batch {
        let frames: Vec<Frame> = (0..self.byte() % 4).map(|_| self.frame()).collect();
        let numbered = usize::from(self.byte() % 4).min(frames.len());
        let (epoch, step) = (self.epoch(), u64::from(self.byte() % 3));
        let oldest = u64::from(self.byte() % 4);
        let mut bundle = Batch {
            epoch,
            number: next.saturating_add(step),
            sent_ns: now.as_nanos() + AHEAD_NS,
            oldest,
            first: oldest + u64::from(self.byte() % 3),
            numbered,
            frames,
        };
        if self.byte() >= 160 {
            (bundle.number, bundle.sent_ns) = (self.number(), self.instant(now));
            (bundle.oldest, bundle.first) = (self.number(), self.number());
        }
        bundle
    }
}

/// Coverage of a script.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seen {
    /// Refused messages.
    pub refused: usize,
    /// Accepted heartbeats and batches.
    pub understood: usize,
    /// Frames that would be published.
    pub frames: usize,
    /// Batches sent by this end.
    pub sent: usize,
}

struct End {
    session: Session,
    compatibility: Compatibility,
    now: Instant,
    /// Epoch of the peer whose batches are received, and what was acknowledged: newest batch and next frame.
    epoch: u64,
    told: (u64, u64),
    /// When a message was last accepted.
    heard_at: Instant,
    /// Number of the next batch to receive and of the newest one sent.
    next: u64,
    sent: u64,
    seen: Seen,
}

/// Plays a script of messages and time steps to one end of a session.
pub(crate) fn play(script: &[u8]) -> Seen {
    let mut script = Bytes(script);
    let mine = [TopicId::JointStates, TopicId::Beliefs(0), TopicId::Beliefs(1), TopicId::Events];
    let now = Instant::from_nanos(5_000_000_000);
    let mut end = End {
        session: Session::new(LIFE, &mine, now),
        compatibility: Compatibility {
            version: 1,
            layouts: 2,
            joints: 3,
            percepts: 4,
            perspectives: 5,
            remote_processes: 6,
        },
        now,
        epoch: 0,
        told: (0, 0),
        heard_at: now,
        next: 1,
        sent: 0,
        seen: Seen::default(),
    };
    let head = Heartbeat {
        epoch: 0,
        sent_ns: 0,
        asked_ns: 0,
        heard_ns: 0,
        acked_epoch: 0,
        newest: 0,
        wanted: 0,
        latched_subscribers: 0,
    };
    let head = head.to_bytes(end.compatibility);
    // The common start of all messages: magic number and compatibility values.
    let head = &head[..head.len() - 8 * 8];
    while !script.0.is_empty() {
        match script.byte() % 10 {
            0 => end.now += Duration::from_millis(u64::from(script.byte())),
            1 => end.now += Duration::from_millis(u64::from(script.byte() % 24) * 100),
            2 => {
                let length = usize::from(script.byte() / 4);
                end.hear(script.some(length));
            }
            3 => {
                let length = usize::from(script.byte() / 2);
                end.hear(&[head, script.some(length)].concat());
            }
            4 | 5 => {
                let pulse = script.pulse(end.now).to_bytes(end.compatibility);
                end.hear(&pulse);
            }
            6 | 7 => {
                let bundle = script.bundle(end.now, end.next);
                end.next = bundle.number.saturating_add(1);
                end.hear(&bundle.to_bytes(end.compatibility));
            }
            8 => {
                let (topic, place) = (mine[usize::from(script.byte() % 4)], (1, script.number()));
                let length = usize::from(script.byte() / 8);
                end.session.push(end.now, topic, place, script.some(length).into());
            }
            _ => end.cycle(),
        }
    }
    end.seen
}

impl End {
    /// Receives bytes, decoded as a heartbeat and as a batch: at most one succeeds.
    fn hear(&mut self, bytes: &[u8]) {
        let pulse = Heartbeat::decode(bytes, self.compatibility);
        let bundle = Batch::decode(bytes, self.compatibility);
        if pulse.is_err() && bundle.is_err() {
            self.seen.refused += 1;
        } else {
            self.heard_at = self.now;
        }
        if let Ok(pulse) = pulse {
            self.seen.understood += 1;
            assert_eq!(pulse.to_bytes(self.compatibility), bytes, "a pulse is its bytes");
            self.session.receive_heartbeat(self.now, &pulse);
            let _told_once = self.session.take_replay_request();
        }
        if let Ok(bundle) = bundle {
            self.seen.understood += 1;
            assert_eq!(bundle.to_bytes(self.compatibility), bytes, "a bundle is its bytes");
            let (frames, numbered, epoch) = (bundle.frames.clone(), bundle.numbered, bundle.epoch);
            if let Some(came) = self.session.receive_batch(self.now, bundle) {
                if came.transit.is_some() && std::mem::replace(&mut self.epoch, epoch) != epoch {
                    // Acknowledgements restart with a new epoch.
                    self.told = (0, 0);
                }
                self.publish(&came, &frames, numbered);
            }
        }
    }

    /// Published frames are from the batch, each at most once, and in its order.
    fn publish(&mut self, came: &ReceivedBatch, frames: &[Frame], numbered: usize) {
        let ReceivedBatch { new, transit } = came;
        if new.said.is_empty() && new.newest.is_empty() {
            return;
        }
        let (_delay, ahead_ns) = transit.expect("nothing is published before the clocks are known");
        let (newest, said) = frames.split_at(frames.len() - numbered);
        assert_eq!(new.newest, newest);
        assert!(said.windows(new.said.len().max(1)).any(|some| some == new.said) || new.said.is_empty());
        for frame in new.said.iter().chain(&new.newest) {
            self.seen.frames += 1;
            let mut bytes = frame.bytes.to_vec();
            let instants = TimestampFields::of(frame.topic);
            instants.shift(&mut bytes, ahead_ns);
            assert_eq!(bytes.len(), frame.bytes.len());
            let [head, entry] = frame.topic.frame_kinds();
            let rest = bytes.len().checked_sub(head.size());
            let rest = rest.filter(|rest| rest.is_multiple_of(entry.size()));
            assert_eq!(instants.entries(bytes.len()), rest.map(|rest| rest / entry.size()));
        }
    }

    /// Runs a cycle of this end and checks that its messages can be decoded.
    fn cycle(&mut self) {
        self.session.listen(self.now);
        assert!(!self.session.is_up() || self.now.since(self.heard_at) <= MAX_SILENCE, "nothing is heard");
        if let Some(pulse) = self.session.pulse(self.now) {
            assert_eq!(Heartbeat::decode(&pulse.to_bytes(self.compatibility), self.compatibility), Ok(pulse));
            assert_eq!(pulse.epoch, LIFE);
            // Within an epoch, acknowledgements never go back.
            let (newest, wanted) = self.told;
            assert_eq!(pulse.acked_epoch, self.epoch);
            assert!(pulse.newest >= newest && pulse.wanted >= wanted, "{pulse:?}: {newest}, {wanted} before");
            self.told = (pulse.newest, pulse.wanted);
        }
        if let Some(bundle) = self.session.bundle(self.now) {
            assert!(self.session.is_up(), "nothing is sent to nobody");
            self.seen.sent += 1;
            self.sent += 1;
            assert!(bundle.number == self.sent && bundle.frames.len() <= MAX_FRAMES);
            let bytes: Arc<[u8]> = bundle.to_bytes(self.compatibility).into();
            assert_eq!(Batch::decode(&bytes, self.compatibility), Ok(bundle));
        }
    }
}
