use quantity::number::saturating_u64;

use crate::chain::{FastReplyWriter, after, head, length_field};
use crate::crc::extend;
use crate::frame::{HEADER, PREFIX, SUFFIX};
use crate::{Id, Status};

/// Maximum length of a reply in bytes: the capacity of a [`Parser`](crate::Parser).
const MAX_FRAME_BYTES: usize = 4096;
/// Maximum number of servos: the number of valid IDs.
const MAX_SERVOS: usize = 253;
/// Maximum number of noise bytes before a block that are skipped.
const MAX_NOISE_BYTES: usize = 8;

/// Parses the single packet with which several servos reply to a [fast sync read](crate::Instruction::FastSyncRead) or
/// a [fast bulk read](crate::Instruction::FastBulkRead).
///
/// Every servo's block ends with a CRC of everything before it, so a block is verified as soon as it has arrived. A CRC
/// stands for everything that it covers. So a block after a corrupt one is verified by continuing from the CRC field of
/// the corrupt block.
///
/// Effect of errors: a flipped bit loses one servo's block, in a CRC field two, in the header all. A few extra bytes
/// before a block, or a repeated block, lose nothing. Missing bytes, or many extra ones, lose the blocks after them,
/// never those before.
///
/// [`expect`](Self::expect) sets the expected servos, and [`Parser::next_part`](crate::Parser::next_part) uses it:
///
/// ```
/// use servo::{FastReply, Id, Parser};
/// let id = |id| Id::new(id).unwrap();
/// let mut reply = FastReply::new();
/// reply.expect([3, 7].map(|servo| (id(servo), 1)))?;
///
/// let mut parser = Parser::new();
/// // Servo 3 replies, and servo 7 stays silent.
/// parser.push(&[0xFF, 0xFF, 0xFD, 0, 0xFE, 11, 0, 0x55, 0, 3, 0x19, 0x6F, 0xF9]);
/// let status = parser.next_part(&mut reply).unwrap();
/// assert_eq!((status.id, status.params), (id(3), &[0x19][..]));
/// assert!(parser.next_part(&mut reply).is_none());
/// assert_eq!(reply.missing().collect::<Vec<_>>(), [id(7)]);
/// # Ok::<(), servo::ReplyTooLongError>(())
/// ```
#[derive(Clone, Debug)]
pub struct FastReply {
    awaited: [ExpectedServo; MAX_SERVOS],
    count: usize,
    /// The expected length field; the reply to another request has a different one.
    length: u16,
    /// The packet being parsed.
    frame: Option<ParsePosition>,
    /// Whether a packet was parsed to its end.
    over: bool,
}

#[derive(Clone, Copy, Debug)]
struct ExpectedServo {
    id: u8,
    length: u16,
    is_reported: bool,
}

/// The parsing position within a packet.
#[derive(Clone, Copy, Debug)]
struct ParsePosition {
    /// The stream position of the packet's first byte.
    origin: u64,
    /// Offset of the next block from the packet's first byte.
    at: usize,
    /// Index of the next expected servo.
    place: usize,
    /// The CRC up to `at`.
    sum: u16,
    /// The CRC up to the previous block, if that block was verified.
    sum_before: Option<u16>,
    /// The offset at which another packet may begin if this one is corrupt: after the header, or after the last
    /// verified block.
    resume: usize,
    broken: bool,
}

/// The requested reply does not fit into one packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{servos} servos would answer with {bytes} bytes, and a frame has at most {MAX_FRAME_BYTES} from {MAX_SERVOS}: ask for less, or in parts"
)]
pub struct ReplyTooLongError {
    /// Number of requested servos.
    pub servos: usize,
    /// Length of the reply, in bytes.
    pub bytes: usize,
}

/// The result of one parsing step.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// The packet has not been found yet.
    Search,
    /// More bytes are needed.
    Wait,
    /// A servo's block; its data are `data` bytes after the packet's first byte.
    Part { id: Id, error: u8, data: usize, length: usize },
    /// A block with a wrong CRC.
    Broken,
    /// This many noise bytes before a block.
    Noise(usize),
    /// The packet ended after this many bytes.
    Over(usize),
}

/// Whether the available bytes are a prefix of the expected packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HeaderMatch {
    Yes,
    No,
    Partial,
}

impl Default for FastReply {
    fn default() -> Self {
        Self::new()
    }
}

impl FastReply {
    /// A reply that expects no servo.
    #[must_use]
    pub const fn new() -> Self {
        let nobody = ExpectedServo { id: 0, length: 0, is_reported: true };
        Self { awaited: [nobody; MAX_SERVOS], count: 0, length: 0, frame: None, over: false }
    }

    /// Sets the expected servos in the order of their replies, each with its data length in bytes. Earlier expectations
    /// are dropped.
    ///
    /// # Errors
    ///
    /// The reply would not fit into one packet. Then no servo is expected.
    pub fn expect(&mut self, servos: impl IntoIterator<Item = (Id, u16)>) -> Result<(), ReplyTooLongError> {
        (self.count, self.frame, self.over) = (0, None, false);
        let (mut count, mut bytes) = (0, PREFIX + 1);
        for (id, length) in servos {
            if let Some(place) = self.awaited.get_mut(count) {
                *place = ExpectedServo { id: id.get(), length, is_reported: false };
            }
            count += 1;
            bytes += FastReplyWriter::PART + usize::from(length);
        }
        let lengths = self.awaited.iter().take(count).map(|awaited| awaited.length);
        match length_field(lengths) {
            Some(length) if bytes <= MAX_FRAME_BYTES && count <= MAX_SERVOS => {
                (self.count, self.length) = (count, length);
                Ok(())
            }
            _ => Err(ReplyTooLongError { servos: count, bytes }),
        }
    }

    /// Whether every expected servo has replied.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.awaited.iter().take(self.count).all(|awaited| awaited.is_reported)
    }

    /// Whether a packet was parsed to its end, even if blocks were corrupt or missing. No further block will arrive.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        self.over
    }

    /// The servos that have not replied, in the expected order.
    pub fn missing(&self) -> impl Iterator<Item = Id> {
        let silent = self.awaited.iter().take(self.count).filter(|awaited| !awaited.is_reported);
        silent.filter_map(|awaited| Id::new(awaited.id))
    }

    /// Whether `bytes` begin the expected packet.
    pub(crate) fn begins(&self, bytes: &[u8]) -> HeaderMatch {
        let head = head(self.length);
        let there = bytes.len().min(head.len());
        match bytes.get(..there) == head.get(..there) {
            false => HeaderMatch::No,
            true if there == head.len() => HeaderMatch::Yes,
            true => HeaderMatch::Partial,
        }
    }

    /// Starts parsing a packet at this stream position.
    pub(crate) fn enter(&mut self, origin: u64) {
        let head = head(self.length);
        let sum = extend(0, &head);
        self.frame = Some(ParsePosition {
            origin,
            at: head.len(),
            place: 0,
            sum,
            sum_before: None,
            resume: HEADER.len(),
            broken: false,
        });
    }

    /// Returns the number of bytes up to the end of the last delivered block, and rebases the position to there.
    pub(crate) fn take(&mut self) -> usize {
        let Some(walk) = &mut self.frame else { return 0 };
        let taken = std::mem::take(&mut walk.at);
        walk.resume = 0;
        walk.origin = walk.origin.wrapping_add(saturating_u64(taken));
        taken
    }

    /// Continues parsing; the first of `bytes` is at stream position `origin`.
    pub(crate) fn step(&mut self, origin: u64, bytes: &[u8]) -> Step {
        // If bytes were consumed or dropped in between, the packet is lost.
        let Some(mut walk) = self.frame.filter(|walk| walk.origin == origin) else {
            self.frame = None;
            return Step::Search;
        };
        let step = self.walk(&mut walk, bytes);
        let is_over = matches!(step, Step::Over(_));
        self.over |= is_over;
        self.frame = Some(walk).filter(|_| !is_over);
        step
    }

    fn walk(&mut self, walk: &mut ParsePosition, bytes: &[u8]) -> Step {
        loop {
            let Some(own) = self.awaited.get(walk.place).filter(|_| walk.place < self.count).copied() else {
                // After a corrupt block another packet may begin anywhere.
                return Step::Over(if walk.broken { walk.resume } else { walk.at });
            };
            let Some(part) = bytes.get(walk.at..) else { return Step::Wait };
            let Some(&[error, id]) = part.first_chunk() else { return Step::Wait };
            // Servos after a silent one may still reply, so the ID in the block decides.
            let still = self.awaited.iter_mut().enumerate().take(self.count).skip(walk.place);
            if let Some((place, claimed)) = still.into_iter().find(|(_, awaited)| awaited.id == id) {
                let Some((summed, field)) = split(part, claimed.length) else { return Step::Wait };
                if extend(walk.sum, summed).to_le_bytes() == field {
                    let (data, length) = (walk.at + 2, usize::from(claimed.length));
                    walk.at += length + FastReplyWriter::PART;
                    walk.sum_before = Some(walk.sum);
                    (walk.place, walk.sum, walk.resume) = (place + 1, after(field), walk.at);
                    match Id::new(id) {
                        Some(id) if !std::mem::replace(&mut claimed.is_reported, true) => {
                            return Step::Part { id, error, data, length };
                        }
                        // The servo has already replied in an earlier packet.
                        _ => continue,
                    }
                }
            }
            let Some((_, field)) = split(part, own.length) else { return Step::Wait };
            if let Some(bytes) = self.too_many(walk, part, own) {
                walk.at += bytes;
                return Step::Noise(bytes);
            }
            walk.at += usize::from(own.length) + FastReplyWriter::PART;
            walk.sum_before = None;
            (walk.place, walk.sum, walk.broken) = (walk.place + 1, after(field), true);
            return Step::Broken;
        }
    }

    /// The number of extra bytes before the expected block at the beginning of `part`: a repetition of the previous
    /// block, or at most `MAX_NOISE_BYTES` noise bytes. `None` if the expected block is not found in the available bytes. It
    /// never waits for more bytes: otherwise a servo that sends garbage would look silent. It also gives up after a
    /// corrupt block, because each CRC tried may match by chance.
    fn too_many(&self, walk: &ParsePosition, part: &[u8], own: ExpectedServo) -> Option<usize> {
        let sum = walk.sum_before?;
        let before = *self.awaited.get(walk.place.checked_sub(1)?)?;
        let header = head(self.length);
        // A repetition of the first block includes the header.
        let again = if sum == extend(0, &header) { part.strip_prefix(&header) } else { Some(part) };
        let again = again.and_then(|again| Some(part.len() - again.len() + verified(sum, again, before)?));
        let noise =
            |bytes: &usize| part.get(*bytes..).is_some_and(|part| verified(walk.sum, part, own).is_some());
        again.or_else(|| (1..=MAX_NOISE_BYTES).find(noise))
    }
}

/// The length of a servo's valid block at the beginning of `part`, given the CRC before it.
fn verified(sum: u16, part: &[u8], whose: ExpectedServo) -> Option<usize> {
    let (summed, field) = split(part, whose.length).filter(|(summed, _)| summed.get(1) == Some(&whose.id))?;
    (extend(sum, summed).to_le_bytes() == field).then_some(summed.len() + SUFFIX)
}

/// The CRC-covered bytes of a block with this data length, and its CRC field, if complete.
fn split(part: &[u8], length: u16) -> Option<(&[u8], [u8; SUFFIX])> {
    let (summed, rest) = part.split_at_checked(2 + usize::from(length))?;
    rest.first_chunk().map(|field| (summed, *field))
}

impl<'a> Step {
    /// The status of a block within the bytes of its packet.
    pub(crate) fn status(self, bytes: &'a [u8]) -> Option<Status<'a>> {
        let Self::Part { id, error, data, length } = self else { return None };
        Some(Status::with_error_byte(id, error, bytes.get(data..data + length)?))
    }
}

#[cfg(test)]
mod tests;
