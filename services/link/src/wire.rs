//! Wire format of the link: 8-byte little-endian numbers, then frames.
//!
//! Input is untrusted. A message that is too short, too long, of another version or of an incompatible robot
//! is refused as a whole.

use std::sync::Arc;

use quantity::number::saturating_u64;

use message::{Bytes, TopicId};

use crate::compatibility::{Compatibility, IncompatiblePeer, LANGUAGE, NUMBERS};
use crate::offset::ClockExchange;
use crate::order::is_carried;

/// The first number of a message: "LEOLINK" and the protocol version.
const MAGIC: u64 = u64::from_be_bytes(*b"LEOLINK\0") | LANGUAGE;
/// Maximum number of frames in a batch.
const MAX_FRAMES: usize = 1024;

/// A frame in transit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Its topic.
    pub topic: TopicId,
    /// Head, then entries; timestamps are of the sender's clock.
    pub bytes: Arc<[u8]>,
}

/// Heartbeat: the sender's epoch, its acknowledgements, and timestamps for the clock offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heartbeat {
    /// Epoch of the sender.
    pub epoch: u64,
    /// Send time.
    pub sent_ns: u64,
    /// Send time of the peer's newest heartbeat, by the peer's clock; zero before the first.
    pub asked_ns: u64,
    /// When that heartbeat was received here.
    pub heard_ns: u64,
    /// Epoch of the peer whose batches are acknowledged.
    pub acked_epoch: u64,
    /// Number of the newest batch received; zero before the first.
    pub newest: u64,
    /// Number of the next reliable frame expected.
    pub wanted: u64,
    /// Number of new subscribers to the latched topic on the sender's machine.
    pub latched_subscribers: u64,
}

impl Heartbeat {
    /// The clock exchange of a heartbeat received at `now_ns`; `None` if it answers no heartbeat.
    #[must_use]
    pub fn exchange(&self, now_ns: u64) -> Option<ClockExchange> {
        (self.asked_ns != 0).then_some(ClockExchange {
            asked_ns: self.asked_ns,
            heard_there_ns: self.heard_ns,
            answered_there_ns: self.sent_ns,
            heard_ns: now_ns,
        })
    }
}

/// Frames that are sent together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Batch {
    /// Epoch of the sender.
    pub epoch: u64,
    /// Sequence number of the batch in this epoch, from one, without gaps.
    pub number: u64,
    /// Send time.
    pub sent_ns: u64,
    /// Number of the oldest reliable frame that can still be sent.
    pub oldest: u64,
    /// Number of the first reliable frame in this batch.
    pub first: u64,
    /// Number of reliable frames; they are the last ones in `frames`.
    pub numbered: usize,
    /// The frames.
    pub frames: Vec<Frame>,
}

/// A message cannot be decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The bytes are malformed.
    #[error("the other machine sent a malformed link message")]
    Malformed,
    /// The sender is incompatible.
    #[error("{0}")]
    IncompatiblePeer(IncompatiblePeer),
}

struct Numbers<'a>(&'a [u8]);

impl<'a> Numbers<'a> {
    fn next_array<const N: usize>(&mut self) -> Result<[u64; N], DecodeError> {
        self.bytes(8 * N).map(Bytes::get)
    }

    /// The next number; it is malformed if its type cannot hold it.
    fn next<T: TryFrom<u64>>(&mut self) -> Result<T, DecodeError> {
        let [number] = self.next_array()?;
        T::try_from(number).map_err(|_| DecodeError::Malformed)
    }

    fn bytes(&mut self, length: usize) -> Result<&'a [u8], DecodeError> {
        let (bytes, rest) = self.0.split_at_checked(length).ok_or(DecodeError::Malformed)?;
        self.0 = rest;
        Ok(bytes)
    }

    fn begin(&mut self, compatibility: Compatibility) -> Result<(), DecodeError> {
        let first: u64 = self.next()?;
        if first != MAGIC {
            let there = first ^ (MAGIC ^ LANGUAGE);
            let is_other = there <= u64::from(u8::MAX);
            let language = DecodeError::IncompatiblePeer(IncompatiblePeer::Language { there });
            return Err(if is_other { language } else { DecodeError::Malformed });
        }
        let there = Compatibility::of_numbers(self.next_array()?);
        if compatibility.agrees(there) {
            Ok(())
        } else {
            Err(DecodeError::IncompatiblePeer(IncompatiblePeer::Meaning { here: compatibility, there }))
        }
    }

    fn end(&self) -> Result<(), DecodeError> {
        if self.0.is_empty() { Ok(()) } else { Err(DecodeError::Malformed) }
    }
}

/// The first part of every message.
fn begun(compatibility: Compatibility, size: usize) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(8 * (1 + NUMBERS) + size);
    MAGIC.put(&mut bytes);
    compatibility.numbers().put(&mut bytes);
    bytes
}

impl Heartbeat {
    /// Encodes the heartbeat.
    #[must_use]
    pub fn to_bytes(&self, compatibility: Compatibility) -> Vec<u8> {
        let Self { epoch, sent_ns, asked_ns, heard_ns, acked_epoch, newest, wanted, latched_subscribers } =
            *self;
        let mut bytes = begun(compatibility, 64);
        [epoch, sent_ns, asked_ns, heard_ns, acked_epoch, newest, wanted, latched_subscribers]
            .put(&mut bytes);
        bytes
    }

    /// Decodes a heartbeat.
    ///
    /// # Errors
    ///
    /// [`DecodeError`] if the bytes are malformed or the sender is incompatible.
    pub fn decode(bytes: &[u8], compatibility: Compatibility) -> Result<Self, DecodeError> {
        let mut numbers = Numbers(bytes);
        numbers.begin(compatibility)?;
        let [epoch, sent_ns, asked_ns, heard_ns, acked_epoch, newest, wanted, latched_subscribers] =
            numbers.next_array()?;
        numbers.end()?;
        Ok(Self { epoch, sent_ns, asked_ns, heard_ns, acked_epoch, newest, wanted, latched_subscribers })
    }
}

impl Batch {
    /// Encodes the batch.
    #[must_use]
    pub fn to_bytes(&self, compatibility: Compatibility) -> Vec<u8> {
        let Self { epoch, number, sent_ns, oldest, first, numbered, ref frames } = *self;
        let size: usize = frames.iter().map(|frame| frame.bytes.len() + 24).sum();
        let mut bytes = begun(compatibility, size + 56);
        [epoch, number, sent_ns, oldest, first, saturating_u64(numbered), saturating_u64(frames.len())]
            .put(&mut bytes);
        for frame in frames {
            let (code, of) = frame.topic.link_code();
            [u64::from(code), u64::from(of), saturating_u64(frame.bytes.len())].put(&mut bytes);
            bytes.extend_from_slice(&frame.bytes);
        }
        bytes
    }

    /// Decodes a batch.
    ///
    /// # Errors
    ///
    /// [`DecodeError`] if the bytes are malformed or the sender is incompatible.
    pub fn decode(bytes: &[u8], compatibility: Compatibility) -> Result<Self, DecodeError> {
        let mut numbers = Numbers(bytes);
        numbers.begin(compatibility)?;
        let [epoch, number, sent_ns, oldest, first] = numbers.next_array()?;
        let numbered = numbers.next()?;
        let mut bundle = Self { epoch, number, sent_ns, oldest, first, numbered, frames: Vec::new() };
        let frames: usize = numbers.next()?;
        let is_counted = bundle.first.checked_add(saturating_u64(bundle.numbered)).is_some();
        if frames > MAX_FRAMES || bundle.numbered > frames || bundle.first < bundle.oldest || !is_counted {
            return Err(DecodeError::Malformed);
        }
        for _frame in 0..frames {
            let (code, of, length) = (numbers.next()?, numbers.next()?, numbers.next()?);
            let topic = TopicId::of_link_code(code, of).filter(|topic| is_carried(*topic));
            let topic = topic.ok_or(DecodeError::Malformed)?;
            bundle.frames.push(Frame { topic, bytes: numbers.bytes(length)?.into() });
        }
        numbers.end()?;
        Ok(bundle)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn compatibility() -> Compatibility {
        Compatibility::of_numbers([1, 2, 3, 4, 5, 6])
    }

    fn bundle() -> Batch {
        let frame = |topic, length| Frame { topic, bytes: vec![7; length].into() };
        Batch {
            epoch: 1,
            number: 2,
            sent_ns: 3,
            oldest: 4,
            first: 5,
            numbered: 1,
            frames: vec![frame(TopicId::Beliefs(2), 300), frame(TopicId::Utterances, 0)],
        }
    }

    const PULSE: Heartbeat = Heartbeat {
        epoch: 1,
        sent_ns: 2,
        asked_ns: 3,
        heard_ns: 4,
        acked_epoch: 5,
        newest: 6,
        wanted: 7,
        latched_subscribers: 8,
    };

    #[test]
    fn a_written_message_is_read_back_unchanged() {
        let compatibility = compatibility();
        assert_eq!(Batch::decode(&bundle().to_bytes(compatibility), compatibility), Ok(bundle()));
        assert_eq!(Heartbeat::decode(&PULSE.to_bytes(compatibility), compatibility), Ok(PULSE));
    }

    #[test]
    fn a_peer_with_another_meaning_is_distinguished() {
        let here = compatibility();
        let there = Compatibility { layouts: 99, ..here };
        let disagreement = DecodeError::IncompatiblePeer(IncompatiblePeer::Meaning { here, there });
        assert_eq!(Batch::decode(&bundle().to_bytes(there), here), Err(disagreement));
        assert_eq!(Heartbeat::decode(&PULSE.to_bytes(there), here), Err(disagreement));
    }

    #[test]
    fn another_protocol_version_is_distinguished_from_malformed_bytes() {
        let mut bytes = PULSE.to_bytes(compatibility());
        bytes[0] = 7;
        let other = DecodeError::IncompatiblePeer(IncompatiblePeer::Language { there: 7 });
        assert_eq!(Heartbeat::decode(&bytes, compatibility()), Err(other));
        insta::assert_snapshot!(other);
        // Even if the rest is missing.
        assert_eq!(Heartbeat::decode(&bytes[..8], compatibility()), Err(other));
        bytes[1] = 0;
        assert_eq!(Heartbeat::decode(&bytes, compatibility()), Err(DecodeError::Malformed));
    }

    #[test]
    fn a_frame_of_a_topic_that_stays_on_its_machine_is_malformed() {
        let compatibility = compatibility();
        let codes: Vec<(u32, u32)> = (0..20).flat_map(|code| [(code, 0), (code, 1)]).collect();
        let accepted = codes.into_iter().filter(|&(code, number)| {
            let batch = Batch { frames: bundle().frames[..1].to_vec(), numbered: 0, ..bundle() };
            let mut bytes = batch.to_bytes(compatibility);
            let place = 8 * (1 + NUMBERS + 7);
            bytes[place..place + 4].copy_from_slice(&code.to_le_bytes());
            bytes[place + 8..place + 12].copy_from_slice(&number.to_le_bytes());
            Batch::decode(&bytes, compatibility).is_ok()
        });
        let carried =
            [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (3, 0), (4, 0), (5, 0), (6, 0), (7, 0), (8, 0), (9, 0)];
        assert_eq!(accepted.collect::<Vec<_>>(), carried);
    }

    #[test]
    fn a_batch_beyond_the_last_sequence_number_is_malformed() {
        let last = Batch { first: u64::MAX - 1, ..bundle() };
        assert_eq!(Batch::decode(&last.to_bytes(compatibility()), compatibility()), Ok(last));
        let beyond = Batch { first: u64::MAX, ..bundle() };
        assert_eq!(
            Batch::decode(&beyond.to_bytes(compatibility()), compatibility()),
            Err(DecodeError::Malformed)
        );
    }

    #[test]
    fn a_truncated_or_overlong_batch_is_malformed() {
        let whole = bundle().to_bytes(compatibility());
        for length in 0..whole.len() {
            assert_eq!(Batch::decode(&whole[..length], compatibility()), Err(DecodeError::Malformed));
        }
        let more = [&whole[..], &[0]].concat();
        assert_eq!(Batch::decode(&more, compatibility()), Err(DecodeError::Malformed));
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_are_decoded_without_a_panic(place in 56_usize..460, value: u8, more in proptest::collection::vec(any::<u8>(), 0..90)) {
            let mut bytes = bundle().to_bytes(compatibility());
            if let Some(byte) = bytes.get_mut(place) {
                *byte = value;
            }
            // Any result is fine; a panic is not.
            let _either = Batch::decode(&bytes, compatibility());
            let _either = Batch::decode(&more, compatibility());
            let _either = Heartbeat::decode(&more, compatibility());
        }
    }
}
