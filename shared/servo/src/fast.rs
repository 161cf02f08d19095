use crate::chain::{Chain, after, head, length_field};
use crate::crc::extend;
use crate::frame::{HEADER, PREFIX, SUFFIX};
use crate::parser::number;
use crate::{Id, Status};

/// The bytes of an answer at most: as many as a [`Parser`](crate::Parser) keeps.
const BYTES_MOST: usize = 4096;
/// As many as there are identifiers.
const SERVOS_MOST: usize = 253;
/// Bytes of noise before a part behind which it is looked for.
const NOISE_MOST: usize = 8;

/// Takes the one frame apart with which several servos answer a
/// [fast sync read](crate::Instruction::FastSyncRead) or a
/// [fast bulk read](crate::Instruction::FastBulkRead).
///
/// Every servo's part ends with a check sum of everything before it. So each part is verified as
/// soon as it is there, whatever follows; and since a sum stands for all that it sums up, a part
/// can also be verified behind one that is broken, from the sum in which that one ends. A bit that
/// flips costs one servo, one in a sum two, one in the header all. A few bytes too many before a
/// part, or one that is said twice, cost nobody. Bytes that are missing, or many too many, cost the
/// servos behind them, and never those before.
///
/// It is told what it awaits and given to [`Parser::next_part`](crate::Parser::next_part):
///
/// ```
/// use servo::{FastReply, Id, Parser};
/// let id = |id| Id::new(id).unwrap();
/// let mut reply = FastReply::new();
/// reply.expect([3, 7].map(|servo| (id(servo), 1)))?;
///
/// let mut parser = Parser::new();
/// // Servo 3 answers, and servo 7 does not.
/// parser.push(&[0xFF, 0xFF, 0xFD, 0, 0xFE, 11, 0, 0x55, 0, 3, 0x19, 0x6F, 0xF9]);
/// let status = parser.next_part(&mut reply).unwrap();
/// assert_eq!((status.id, status.params), (id(3), &[0x19][..]));
/// assert!(parser.next_part(&mut reply).is_none());
/// assert_eq!(reply.missing().collect::<Vec<_>>(), [id(7)]);
/// # Ok::<(), servo::TooMuch>(())
/// ```
#[derive(Clone, Debug)]
pub struct FastReply {
    awaited: [Awaited; SERVOS_MOST],
    count: usize,
    /// What the length field must say: an answer to another question says something else.
    length: u16,
    /// The frame under way.
    frame: Option<Walk>,
    /// Whether a frame has come to its end.
    over: bool,
}

#[derive(Clone, Copy, Debug)]
struct Awaited {
    id: u8,
    length: u16,
    told: bool,
}

/// How far a frame has been walked through.
#[derive(Clone, Copy, Debug)]
struct Walk {
    /// Which place of the stream it begins at.
    origin: u64,
    /// The next part, from the frame's first byte on.
    at: usize,
    /// Who is next.
    place: usize,
    /// The check sum up to `at`.
    sum: u16,
    /// The check sum up to the part before it, if that was verified.
    sum_before: Option<u16>,
    /// Where another frame may begin if this one is broken: behind its header, or behind the last
    /// part that was verified.
    resume: usize,
    broken: bool,
}

/// More was asked for than one frame brings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{servos} servos would answer with {bytes} bytes, and a frame has at most {BYTES_MOST} from {SERVOS_MOST}: ask for less, or in parts"
)]
pub struct TooMuch {
    /// The servos asked.
    pub servos: usize,
    /// The bytes of the answer.
    pub bytes: usize,
}

/// What the bytes that are there make of a reply.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// The frame is still to be found.
    Search,
    /// More bytes are needed.
    Wait,
    /// One servo's part, its data so many bytes behind the frame's first.
    Part { id: Id, error: u8, data: usize, length: usize },
    /// A part whose sum was wrong.
    Broken,
    /// So many bytes before a part that are none of it.
    Noise(usize),
    /// The frame is over, and so many bytes belong to it.
    Over(usize),
}

/// Whether bytes begin the awaited frame, as far as they go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Begin {
    Yes,
    No,
    Perhaps,
}

impl Default for FastReply {
    fn default() -> Self {
        Self::new()
    }
}

impl FastReply {
    /// Awaits nobody.
    #[must_use]
    pub const fn new() -> Self {
        let nobody = Awaited { id: 0, length: 0, told: true };
        Self { awaited: [nobody; SERVOS_MOST], count: 0, length: 0, frame: None, over: false }
    }

    /// Awaits the answer of these servos in this order, each with so many bytes of data, and
    /// forgets what was awaited before.
    ///
    /// # Errors
    ///
    /// The answer would not fit into one frame. Nobody is awaited then.
    pub fn expect(&mut self, servos: impl IntoIterator<Item = (Id, u16)>) -> Result<(), TooMuch> {
        (self.count, self.frame, self.over) = (0, None, false);
        let (mut count, mut bytes) = (0, PREFIX + 1);
        for (id, length) in servos {
            if let Some(place) = self.awaited.get_mut(count) {
                *place = Awaited { id: id.get(), length, told: false };
            }
            count += 1;
            bytes += Chain::PART + usize::from(length);
        }
        let lengths = self.awaited.iter().take(count).map(|awaited| awaited.length);
        match length_field(lengths) {
            Some(length) if bytes <= BYTES_MOST && count <= SERVOS_MOST => {
                (self.count, self.length) = (count, length);
                Ok(())
            }
            _ => Err(TooMuch { servos: count, bytes }),
        }
    }

    /// Whether everybody who was awaited has answered.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.awaited.iter().take(self.count).all(|awaited| awaited.told)
    }

    /// Whether a frame has come to its end, though parts of it be broken or missing: nobody has anything
    /// more to say.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        self.over
    }

    /// Who has not answered, in the order in which they were to.
    pub fn missing(&self) -> impl Iterator<Item = Id> {
        let silent = self.awaited.iter().take(self.count).filter(|awaited| !awaited.told);
        silent.filter_map(|awaited| Id::new(awaited.id))
    }

    /// Whether `bytes` begin the awaited frame.
    pub(crate) fn begins(&self, bytes: &[u8]) -> Begin {
        let head = head(self.length);
        let there = bytes.len().min(head.len());
        match bytes.get(..there) == head.get(..there) {
            false => Begin::No,
            true if there == head.len() => Begin::Yes,
            true => Begin::Perhaps,
        }
    }

    /// Begins to walk through a frame that begins at this place of the stream.
    pub(crate) fn enter(&mut self, origin: u64) {
        let head = head(self.length);
        let sum = extend(0, &head);
        self.frame = Some(Walk {
            origin,
            at: head.len(),
            place: 0,
            sum,
            sum_before: None,
            resume: HEADER.len(),
            broken: false,
        });
    }

    /// The bytes up to the end of the part that was told last: they are done with, and what comes
    /// later can never be told from them again.
    pub(crate) fn take(&mut self) -> usize {
        let Some(walk) = &mut self.frame else { return 0 };
        let taken = std::mem::take(&mut walk.at);
        walk.resume = 0;
        walk.origin = walk.origin.wrapping_add(number(taken));
        taken
    }

    /// Walks on through the bytes, of which the first stands at `origin` of the stream.
    pub(crate) fn step(&mut self, origin: u64, bytes: &[u8]) -> Step {
        // Where bytes were taken or dropped meanwhile, the frame is gone.
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

    fn walk(&mut self, walk: &mut Walk, bytes: &[u8]) -> Step {
        loop {
            let Some(own) = self.awaited.get(walk.place).filter(|_| walk.place < self.count).copied() else {
                // Behind what is broken another frame may begin anywhere.
                return Step::Over(if walk.broken { walk.resume } else { walk.at });
            };
            let Some(part) = bytes.get(walk.at..) else { return Step::Wait };
            let Some(&[error, id]) = part.first_chunk() else { return Step::Wait };
            // Where servos are silent those behind them may go on: a part is whose it says it is.
            let still = self.awaited.iter_mut().enumerate().take(self.count).skip(walk.place);
            if let Some((place, claimed)) = still.into_iter().find(|(_, awaited)| awaited.id == id) {
                let Some((summed, field)) = split(part, claimed.length) else { return Step::Wait };
                if extend(walk.sum, summed).to_le_bytes() == field {
                    let (data, length) = (walk.at + 2, usize::from(claimed.length));
                    walk.at += length + Chain::PART;
                    walk.sum_before = Some(walk.sum);
                    (walk.place, walk.sum, walk.resume) = (place + 1, after(field), walk.at);
                    match Id::new(id) {
                        Some(id) if !std::mem::replace(&mut claimed.told, true) => {
                            return Step::Part { id, error, data, length };
                        }
                        // It has told the same already, in a frame before this one.
                        _ => continue,
                    }
                }
            }
            let Some((_, field)) = split(part, own.length) else { return Step::Wait };
            if let Some(bytes) = self.too_many(walk, part, own) {
                walk.at += bytes;
                return Step::Noise(bytes);
            }
            walk.at += usize::from(own.length) + Chain::PART;
            walk.sum_before = None;
            (walk.place, walk.sum, walk.broken) = (walk.place + 1, after(field), true);
            return Step::Broken;
        }
    }

    /// How many bytes stand before the awaited part at the beginning of `part`: the one before it once
    /// more, or a few that are anything. None where it is not behind them, as far as the bytes go:
    /// whoever waited for more would take a servo that answers nonsense for one that is silent. Nor
    /// where the part before it was broken: every sum that is tried may be right by chance.
    fn too_many(&self, walk: &Walk, part: &[u8], own: Awaited) -> Option<usize> {
        let sum = walk.sum_before?;
        let before = *self.awaited.get(walk.place.checked_sub(1)?)?;
        let header = head(self.length);
        // The first part is said twice with its header.
        let again = if sum == extend(0, &header) { part.strip_prefix(&header) } else { Some(part) };
        let again = again.and_then(|again| Some(part.len() - again.len() + verified(sum, again, before)?));
        let noise =
            |bytes: &usize| part.get(*bytes..).is_some_and(|part| verified(walk.sum, part, own).is_some());
        again.or_else(|| (1..=NOISE_MOST).find(noise))
    }
}

/// The bytes of a servo's part at the beginning of these, behind what has this sum.
fn verified(sum: u16, part: &[u8], whose: Awaited) -> Option<usize> {
    let (summed, field) = split(part, whose.length).filter(|(summed, _)| summed.get(1) == Some(&whose.id))?;
    (extend(sum, summed).to_le_bytes() == field).then_some(summed.len() + SUFFIX)
}

/// What a part with so many bytes of data sums up, and its sum, if it is there.
fn split(part: &[u8], length: u16) -> Option<(&[u8], [u8; SUFFIX])> {
    let (summed, rest) = part.split_at_checked(2 + usize::from(length))?;
    rest.first_chunk().map(|field| (summed, *field))
}

impl<'a> Step {
    /// The status of a part in the bytes of its frame.
    pub(crate) fn status(self, bytes: &'a [u8]) -> Option<Status<'a>> {
        let Self::Part { id, error, data, length } = self else { return None };
        Some(Status::with_error_byte(id, error, bytes.get(data..data + length)?))
    }
}

#[cfg(test)]
mod tests;
