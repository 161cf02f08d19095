//! Queue of frames to be sent.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use clock::{Duration, Instant};
use invariant::require;
use message::{Delivery, TopicId};
use quantity::number::saturating_u64;

use crate::order::publishing_order;
use crate::wire::Frame;

/// Maximum number of unacknowledged reliable frames, and their maximum age.
const MAX_UNACKED_FRAMES: usize = 4096;
const KEPT_FOR: Duration = Duration::from_secs(60);
/// Limit of reliable bytes in one batch, beyond the first frame.
const MAX_BATCH_BYTES: usize = 128 * 1024;
/// Maximum number of reliable frames in one batch.
const MAX_BATCH_FRAMES: usize = 256;
/// Maximum number of incomplete frame sets.
const MAX_INCOMPLETE_SETS: usize = 4;

/// Incarnation of a frame's writer, and the frame's sequence number.
pub(crate) type FrameNumber = (u64, u64);

/// Frames to be sent: the newest of most topics, and the newest complete set of the topics that belong
/// together. Frames of reliable topics are kept until they are acknowledged.
#[derive(Debug)]
pub(crate) struct Outbox {
    /// In the publishing order.
    newest: BTreeMap<(bool, TopicId), Arc<[u8]>>,
    together: Vec<TopicId>,
    incomplete: BTreeMap<FrameNumber, BTreeMap<TopicId, Arc<[u8]>>>,
    instant: BTreeMap<TopicId, Arc<[u8]>>,
    every: VecDeque<Kept>,
    /// Sequence numbers of the first frame in `every` and of the next one to be sent.
    oldest: u64,
    next: u64,
    pub(crate) overtaken: u64,
    pub(crate) expired: u64,
}

#[derive(Debug)]
struct Kept {
    topic: TopicId,
    bytes: Arc<[u8]>,
    since: Instant,
}

/// The content of one batch.
#[derive(Debug)]
pub(crate) struct Load {
    pub(crate) frames: Vec<Frame>,
    pub(crate) oldest: u64,
    pub(crate) first: u64,
    pub(crate) numbered: usize,
}

impl Outbox {
    /// Returns an empty queue for these topics.
    pub(crate) fn new(topics: &[TopicId]) -> Self {
        let together =
            topics.iter().copied().filter(|topic| topic.row().delivery == Delivery::Together).collect();
        Self {
            newest: BTreeMap::new(),
            together,
            incomplete: BTreeMap::new(),
            instant: BTreeMap::new(),
            every: VecDeque::new(),
            oldest: 1,
            next: 1,
            overtaken: 0,
            expired: 0,
        }
    }

    pub(crate) fn push(&mut self, now: Instant, topic: TopicId, number: FrameNumber, bytes: Arc<[u8]>) {
        match topic.row().delivery {
            Delivery::Local => {}
            Delivery::Newest => {
                let overtaken = self.newest.insert(publishing_order(topic), bytes);
                self.overtaken += u64::from(overtaken.is_some());
            }
            Delivery::Together => self.gather(topic, number, bytes),
            Delivery::Reliable | Delivery::Latched => {
                self.every.push_back(Kept { topic, bytes, since: now });
                if self.every.len() > MAX_UNACKED_FRAMES {
                    self.let_go();
                }
            }
        }
    }

    fn gather(&mut self, topic: TopicId, number: FrameNumber, bytes: Arc<[u8]>) {
        let frames = self.incomplete.entry(number).or_default();
        frames.insert(topic, bytes);
        if frames.len() == self.together.len() {
            let whole = require!(self.incomplete.remove(&number), "the set is incomplete until now");
            let whole = whole.unwrap_or_default();
            // Older or previous-incarnation sets can no longer be completed.
            let older: usize = self.incomplete.values().map(BTreeMap::len).sum();
            self.incomplete.clear();
            self.overtaken += saturating_u64(older + std::mem::replace(&mut self.instant, whole).len());
        } else if self.incomplete.len() > MAX_INCOMPLETE_SETS
            && let Some((_, frames)) = self.incomplete.pop_first()
        {
            self.overtaken += saturating_u64(frames.len());
        }
    }

    /// The content of the next batch, if there is any.
    pub(crate) fn load(&mut self, now: Instant) -> Option<Load> {
        while self.every.front().is_some_and(|kept| now.since(kept.since) > KEPT_FOR) {
            self.let_go();
        }
        let newest = std::mem::take(&mut self.newest).into_iter().map(|((_, topic), bytes)| (topic, bytes));
        let instant = std::mem::take(&mut self.instant).into_iter();
        let mut frames: Vec<Frame> =
            newest.chain(instant).map(|(topic, bytes)| Frame { topic, bytes }).collect();
        let first = self.next;
        let skip = usize::try_from(first - self.oldest).unwrap_or(usize::MAX);
        let (mut room, mut numbered) = (MAX_BATCH_BYTES, 0);
        for kept in self.every.iter().skip(skip).take(MAX_BATCH_FRAMES) {
            if numbered > 0 && kept.bytes.len() > room {
                break;
            }
            room = room.saturating_sub(kept.bytes.len());
            frames.push(Frame { topic: kept.topic, bytes: Arc::clone(&kept.bytes) });
            numbered += 1;
        }
        self.next += saturating_u64(numbered);
        let is_something = !frames.is_empty();
        is_something.then_some(Load { frames, oldest: self.oldest, first, numbered })
    }

    /// Processes an acknowledgement: `number` is the next reliable frame that the peer expects.
    pub(crate) fn wanted(&mut self, number: u64) {
        while self.oldest < number && self.every.pop_front().is_some() {
            self.oldest += 1;
        }
        self.next = self.next.max(self.oldest);
    }

    /// Whether sent reliable frames are unacknowledged.
    pub(crate) fn has_unacked(&self) -> bool {
        self.next > self.oldest
    }

    /// Schedules all unacknowledged frames for retransmission.
    pub(crate) fn again(&mut self) {
        self.next = self.oldest;
    }

    fn let_go(&mut self) {
        if self.every.pop_front().is_some() {
            self.oldest += 1;
            self.next = self.next.max(self.oldest);
            self.expired += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: u64) -> Instant {
        Instant::from_nanos(seconds * 1_000_000_000)
    }

    fn bytes(value: u8) -> Arc<[u8]> {
        vec![value].into()
    }

    fn sent(outbox: &mut Outbox) -> Vec<(TopicId, u8)> {
        let load = outbox.load(at(1));
        load.map_or(Vec::new(), |load| {
            load.frames.iter().map(|frame| (frame.topic, frame.bytes[0])).collect()
        })
    }

    #[test]
    fn a_newer_frame_replaces_a_waiting_older_one() {
        let mut outbox = Outbox::new(&[TopicId::Scene]);
        outbox.push(at(1), TopicId::Scene, (1, 1), bytes(1));
        outbox.push(at(1), TopicId::Scene, (1, 2), bytes(2));
        assert_eq!((sent(&mut outbox), outbox.overtaken), (vec![(TopicId::Scene, 2)], 1));
        assert!(outbox.load(at(1)).is_none());
    }

    #[test]
    fn all_frames_of_an_instant_are_sent_or_none() {
        let minds = [TopicId::Beliefs(0), TopicId::Beliefs(1), TopicId::Divergences(1)];
        let mut outbox = Outbox::new(&minds);
        for (value, number) in [(1, 1), (2, 2)] {
            for mind in minds {
                outbox.push(at(1), mind, (1, number), bytes(value));
            }
        }
        outbox.push(at(1), minds[0], (1, 3), bytes(3));
        assert_eq!(sent(&mut outbox), minds.map(|mind| (mind, 2)));
        assert_eq!(sent(&mut outbox), []);
        // A frame is missing: the next set is not delayed by it.
        for mind in minds {
            outbox.push(at(1), mind, (2, 4), bytes(4));
        }
        assert_eq!(sent(&mut outbox), minds.map(|mind| (mind, 4)));
        assert_eq!(outbox.overtaken, 4);
    }

    #[test]
    fn a_message_waits_until_it_is_acknowledged() {
        let mut outbox = Outbox::new(&[TopicId::Events]);
        for value in 1..=3 {
            outbox.push(at(1), TopicId::Events, (1, u64::from(value)), bytes(value));
        }
        let load = outbox.load(at(1)).unwrap();
        assert_eq!((load.oldest, load.first, load.numbered), (1, 1, 3));
        assert!(outbox.load(at(1)).is_none() && outbox.has_unacked());
        outbox.wanted(3);
        outbox.again();
        let load = outbox.load(at(1)).unwrap();
        assert_eq!((load.oldest, load.first, load.numbered, load.frames[0].bytes[0]), (3, 3, 1, 3));
        // An acknowledgement beyond the last frame is tolerated.
        outbox.wanted(u64::MAX);
        assert!(!outbox.has_unacked());
    }

    #[test]
    fn every_waiting_frame_is_sent_in_the_end() {
        let mut outbox = Outbox::new(&[TopicId::Events]);
        outbox.push(at(1), TopicId::Events, (1, 1), bytes(1));
        outbox.push(at(50), TopicId::Events, (1, 2), bytes(2));
        let load = outbox.load(at(62)).unwrap();
        assert_eq!((load.oldest, load.numbered, outbox.expired), (2, 1, 1));
        for value in 0..5000 {
            outbox.push(at(62), TopicId::Events, (1, value), bytes(0));
        }
        assert_eq!(outbox.every.len(), MAX_UNACKED_FRAMES);
    }
}
