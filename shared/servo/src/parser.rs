use invariant::require;
use quantity::number::saturating_u64;

use crate::crc::crc;
use crate::fast::{HeaderMatch, Step};
use crate::frame::{HEADER, PREFIX, SUFFIX, is_stuffed, unstuff};
use crate::status::STATUS;
use crate::{Address, FastReply, Frame, Status};

/// Buffer size in bytes; the replies of a whole bus fit.
const CAPACITY: usize = 4096;
/// Maximum accepted length field. A servo's whole control table is shorter, and a corrupt length must not swallow the
/// packets after it.
const MAX_LENGTH: usize = 1024;

/// Statistics of lost bytes and packets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Losses {
    /// Bytes outside any packet.
    pub noise: u64,
    /// Headers with an invalid length or ID.
    pub malformed: u64,
    /// Packets with a wrong CRC.
    pub corrupt: u64,
    /// Packets cut short by the next one.
    pub cut: u64,
    /// Bytes dropped on buffer overflow.
    pub overrun: u64,
    /// Bytes of valid replies that were not expected, such as a reply to an earlier request.
    pub stray: u64,
}

/// Finds packets in a byte stream with arbitrary noise. A corrupt packet never affects the packets after it.
#[derive(Clone, Debug)]
pub struct Parser {
    bytes: [u8; CAPACITY],
    start: usize,
    end: usize,
    /// The stream position of the first buffered byte.
    origin: u64,
    losses: Losses,
}

enum ScanResult {
    /// More bytes are needed.
    Part,
    /// A complete packet of this many bytes.
    Whole(Address, usize),
    /// No packet can begin within this many bytes; how they are counted.
    Lost(usize, fn(&mut Losses, u64)),
}

impl Default for Parser {
    fn default() -> Self {
        Self::new()
    }
}

impl Parser {
    /// A parser with an empty buffer.
    #[must_use]
    pub const fn new() -> Self {
        let losses = Losses { noise: 0, malformed: 0, corrupt: 0, cut: 0, overrun: 0, stray: 0 };
        Self { bytes: [0; CAPACITY], start: 0, end: 0, origin: 0, losses }
    }

    /// Appends received bytes. On overflow the oldest bytes are dropped.
    pub fn push(&mut self, bytes: &[u8]) {
        let kept = bytes.get(bytes.len().saturating_sub(CAPACITY)..).unwrap_or_default();
        self.bytes.copy_within(self.start..self.end, 0);
        self.end -= self.start;
        self.start = 0;
        let excess = (self.end + kept.len()).saturating_sub(CAPACITY);
        self.bytes.copy_within(excess..self.end, 0);
        self.end -= excess;
        let place = self.bytes.get_mut(self.end..self.end + kept.len());
        if let Some(place) = require!(place, "{} bytes fit behind byte {}", kept.len(), self.end) {
            place.copy_from_slice(kept);
            self.end += kept.len();
        }
        let dropped = saturating_u64(excess + (bytes.len() - kept.len()));
        self.losses.overrun += dropped;
        self.origin = self.origin.wrapping_add(dropped);
    }

    /// The next complete packet; `None` if more bytes are needed.
    pub fn next_frame(&mut self) -> Option<Frame<'_>> {
        let (address, length) = self.find()?;
        let body = self.start + PREFIX;
        self.skip(length);
        let body = self.bytes.get_mut(body..body + length - PREFIX - SUFFIX);
        let body = require!(body, "a packet of {length} bytes is in the buffer")?;
        let kept = unstuff(body);
        let body = body.get(..kept).and_then(<[u8]>::split_first);
        let (&instruction, params) = require!(body, "a packet of {length} bytes has an instruction")?;
        Some(Frame { address, instruction, params })
    }

    /// The next servo's block of a fast reply; `None` if more bytes are needed, or if every servo has replied. Packets
    /// before it are dropped. Dropped instruction packets do not count as losses, because some adapters echo them.
    /// Bytes after the block stay buffered.
    pub fn next_part(&mut self, reply: &mut FastReply) -> Option<Status<'_>> {
        loop {
            let step = reply.step(self.origin, self.waiting());
            match step {
                Step::Part { .. } => {
                    let start = self.start;
                    self.skip(reply.take());
                    let status = self.bytes.get(start..self.end).and_then(|bytes| step.status(bytes));
                    return require!(status, "the block is in the buffer");
                }
                Step::Wait => return None,
                Step::Broken => self.losses.corrupt += 1,
                Step::Noise(bytes) => self.losses.noise += saturating_u64(bytes),
                Step::Over(length) => self.skip(length),
                Step::Search if reply.is_complete() => return None,
                Step::Search => match reply.begins(self.waiting()) {
                    HeaderMatch::Yes => reply.enter(self.origin),
                    HeaderMatch::Partial => return None,
                    HeaderMatch::No => match scan(self.waiting()) {
                        ScanResult::Whole(_, length) => {
                            if self.waiting().get(PREFIX) == Some(&STATUS) {
                                self.losses.stray += saturating_u64(length);
                            }
                            self.skip(length);
                        }
                        ScanResult::Part => return None,
                        ScanResult::Lost(bytes, count) => self.lose(bytes, count),
                    },
                },
            }
        }
    }

    /// Drops buffered bytes, at the end of a transaction.
    pub fn clear(&mut self) {
        let waiting = self.waiting().len();
        self.losses.noise += saturating_u64(waiting);
        self.skip(waiting);
    }

    /// The losses since [`new`](Self::new).
    #[must_use]
    pub const fn losses(&self) -> Losses {
        self.losses
    }

    fn find(&mut self) -> Option<(Address, usize)> {
        loop {
            match scan(self.waiting()) {
                ScanResult::Part => return None,
                ScanResult::Whole(address, length) => return Some((address, length)),
                ScanResult::Lost(bytes, count) => self.lose(bytes, count),
            }
        }
    }

    /// Counts lost bytes and skips them.
    fn lose(&mut self, bytes: usize, count: fn(&mut Losses, u64)) {
        count(&mut self.losses, saturating_u64(bytes));
        self.skip(bytes);
    }

    fn skip(&mut self, bytes: usize) {
        self.start += bytes;
        self.origin = self.origin.wrapping_add(saturating_u64(bytes));
    }

    fn waiting(&self) -> &[u8] {
        let waiting = self.bytes.get(self.start..self.end);
        require!(waiting, "the buffer holds bytes {} to {}", self.start, self.end).unwrap_or_default()
    }
}

fn scan(bytes: &[u8]) -> ScanResult {
    let noise =
        (0..bytes.len()).find(|&at| begins(bytes.get(at..).unwrap_or_default())).unwrap_or(bytes.len());
    if noise > 0 {
        return ScanResult::Lost(noise, |losses, bytes| losses.noise += bytes);
    }
    if bytes.is_empty() {
        return ScanResult::Part;
    }
    let Some(&[_, _, _, _, address, low, high]) = bytes.first_chunk::<PREFIX>() else {
        return ScanResult::Part;
    };
    let length = usize::from(u16::from_le_bytes([low, high]));
    let Some(address) = Address::from_byte(address).filter(|_| (SUFFIX + 1..=MAX_LENGTH).contains(&length))
    else {
        return ScanResult::Lost(HEADER.len(), |losses, _| losses.malformed += 1);
    };
    let body = length - SUFFIX;
    let begun = bytes.get(PREFIX..bytes.len().min(PREFIX + body)).unwrap_or_default();
    if !is_stuffed(begun, body) {
        return ScanResult::Lost(HEADER.len(), |losses, _| losses.cut += 1);
    }
    let whole = PREFIX + length;
    match (bytes.get(..whole - SUFFIX), bytes.get(whole - SUFFIX..whole)) {
        (Some(summed), Some(sum)) if crc(summed).to_le_bytes() == sum => ScanResult::Whole(address, whole),
        // A corrupt length cannot be trusted, so the search resumes after the header.
        (Some(_), Some(_)) => ScanResult::Lost(HEADER.len(), |losses, _| losses.corrupt += 1),
        (_, _) => ScanResult::Part,
    }
}

/// Whether the available bytes are a prefix of a header.
fn begins(bytes: &[u8]) -> bool {
    let begun = bytes.len().min(HEADER.len());
    bytes.get(..begun) == HEADER.get(..begun)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Id, Status};
    use proptest::prelude::*;

    fn status(id: u8, params: &[u8]) -> Vec<u8> {
        let mut out = vec![0; 2 * params.len() + 16];
        let length =
            Status { id: Id::new(id).unwrap(), alert: false, fault: None, params }.encode(&mut out).unwrap();
        out.truncate(length);
        out
    }

    /// The replies of servos 1 to 13 to a sync read, one chunk each.
    fn chain() -> Vec<Vec<u8>> {
        (1..=13).map(|id| status(id, &[id, 0, 1, 2, 3, 4, 5, 6, 7, 8])).collect()
    }

    fn ids(chunks: &[Vec<u8>]) -> (Vec<u8>, Losses) {
        let mut parser = Parser::new();
        parser.push(&chunks.concat());
        let mut ids = Vec::new();
        while let Some(frame) = parser.next_frame() {
            ids.push(Status::parse(&frame).unwrap().id.get());
        }
        (ids, parser.losses())
    }

    fn all_but_the_fifth() -> Vec<u8> {
        (1..=13).filter(|&id| id != 5).collect()
    }

    #[test]
    fn one_damaged_reply_costs_one_servo_its_reading() {
        type Spoil = fn(&mut Vec<u8>);
        let spoil: [(&str, Spoil); 7] = [
            ("silent", Vec::clear),
            ("bit flip", |frame| frame[9] ^= 4),
            ("truncated by one", |frame| frame.truncate(20)),
            ("truncated to its length", |frame| frame.truncate(9)),
            ("length zero", |frame| frame[5] = 0),
            ("length 65535", |frame| frame[5..7].fill(0xFF)),
            ("length too long by fifty", |frame| frame[5] += 50),
        ];
        for (name, spoil) in spoil {
            let mut chunks = chain();
            spoil(&mut chunks[4]);
            assert_eq!(ids(&chunks).0, all_but_the_fifth(), "{name}");
        }
    }

    #[test]
    fn a_false_length_does_not_block_the_parser() {
        let mut chunks = chain();
        chunks[11][5..7].copy_from_slice(&1000_u16.to_le_bytes());
        let (ids, losses) = ids(&chunks);
        assert_eq!(ids, (1..=13).filter(|&id| id != 12).collect::<Vec<_>>());
        assert_eq!(losses.cut, 1);
    }

    #[test]
    fn a_byte_of_noise_costs_no_servo() {
        for noise in [0x00, 0x55, 0xFD, 0xFF] {
            let mut chunks = chain();
            chunks[4].push(noise);
            let (ids, losses) = ids(&chunks);
            assert_eq!(ids, (1..=13).collect::<Vec<_>>(), "{noise:#x}");
            assert_eq!(losses, Losses { noise: 1, ..Losses::default() });
        }
    }

    #[test]
    fn a_full_parser_drops_the_oldest_bytes() {
        let mut parser = Parser::new();
        parser.push(&[0; 3 * CAPACITY]);
        parser.push(&status(7, &[]));
        assert!(parser.next_frame().is_some());
        assert_eq!(parser.losses().overrun, 2 * 4096 + 11);
    }

    proptest! {
        #[test]
        fn a_frame_with_any_parameters_is_read_back(params in params(), id in 0..=252u8, cuts in 1..9usize) {
            let mut parser = Parser::new();
            for chunk in status(id, &params).chunks(cuts) {
                parser.push(chunk);
            }
            let frame = parser.next_frame().unwrap();
            let status = Status::parse(&frame).unwrap();
            prop_assert_eq!((status.id.get(), status.params), (id, &params[..]));
            prop_assert_eq!(parser.losses(), Losses::default());
        }

        #[test]
        fn a_valid_frame_is_found_after_garbage(garbage in params()) {
            let mut parser = Parser::new();
            parser.push(&garbage);
            while parser.next_frame().is_some() {}
            // A false header in the garbage delays parsing for at most the longest packet.
            let good = status(9, &[1, 2, 3]);
            let mut found = 0;
            for _ in 0..MAX_LENGTH / good.len() + 2 {
                parser.push(&good);
                while parser.next_frame().is_some() {
                    found += 1;
                }
            }
            prop_assert!(found >= MAX_LENGTH / good.len(), "{found}");
        }
    }

    /// Byte strings with frequent headers and stuffing.
    fn params() -> impl Strategy<Value = Vec<u8>> {
        let byte = prop_oneof![4 => Just(0xFF), 3 => Just(0xFD), 2 => Just(0), 1 => any::<u8>()];
        proptest::collection::vec(byte, 0..200)
    }
}
