use arrayvec::ArrayVec;
use clock::{Duration, Instant};
use invariant::{invariant, require};
use serial::LineLostError;
use servo::{Id, Status};

/// Maximum number of servos on one bus.
pub const MAX_SERVOS: usize = 32;
/// Capacity of a request in bytes: goals for every servo and reads from every servo, with byte stuffing.
const BYTES: usize = 1024;
/// Capacity of the data of one answer in bytes.
pub(crate) const DATA: usize = 128;
/// Bytes of a status packet without data: header, identifier, length, instruction, error, check sum.
pub(crate) const STATUS_BYTES: usize = 11;
/// Bytes of a fast sync read status before the first answer: header, identifier, length, instruction.
const CHAIN_BYTES: usize = 8;
/// Bytes of one answer within a fast sync read status, without data: error, identifier, check sum.
const LINK_BYTES: usize = 4;
/// Capacity of the answers to one request. Further answers are dropped.
const ANSWERS: usize = 4 * MAX_SERVOS;

/// Kind of a part of a request, and of the answers to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// Goals of the cycle, and the measurements of the servos that support fast sync read.
    FastRead,
    /// The measurements of the other servos (sync read).
    PlainRead,
    /// Repeated read of servos that did not answer in this cycle (sync read).
    Reread,
    /// Torque enable, after torque was switched off.
    Torque,
    /// The job of one servo.
    Job,
    /// The condition of one servo; skipped if the servo has not answered the measurements.
    ReadCondition,
    /// The condition of servos that have just reported an alert.
    AlertCondition,
}

/// Number of kinds of parts.
const PART_KINDS: usize = PartKind::AlertCondition as usize + 1;

/// One part of a request: instructions, and the answers to wait for before the next part may be sent.
#[derive(Clone, Debug)]
pub struct Part {
    /// Kind of the part.
    pub kind: PartKind,
    /// Bytes sent.
    pub sent: usize,
    /// Data bytes expected in each answer.
    pub data: usize,
    ids: ArrayVec<u8, MAX_SERVOS>,
}

impl Part {
    pub(crate) fn new(
        kind: PartKind,
        sent: usize,
        data: usize,
        servos: impl IntoIterator<Item = Id>,
    ) -> Self {
        Self { kind, sent, data, ids: servos.into_iter().map(Id::get).take(MAX_SERVOS).collect() }
    }

    /// Identifiers of the servos that answer, in this order.
    #[must_use]
    pub fn ids(&self) -> &[u8] {
        &self.ids
    }

    /// Bytes of one answer.
    #[must_use]
    pub const fn bytes_of_answer(&self) -> usize {
        let around = if matches!(self.kind, PartKind::FastRead) { LINK_BYTES } else { STATUS_BYTES };
        around + self.data
    }

    /// Bytes of all answers together.
    #[must_use]
    pub const fn bytes_of_answers(&self) -> usize {
        let before = if matches!(self.kind, PartKind::FastRead) { CHAIN_BYTES } else { 0 };
        before + self.ids.len() * self.bytes_of_answer()
    }

    /// Time of the instruction on a wire of `baud` bits per second, with ten bits a byte.
    #[must_use]
    pub fn time_to_send(&self, baud: u32) -> Duration {
        time_on_wire(self.sent, baud)
    }

    /// Time of one answer on the wire.
    #[must_use]
    pub fn time_to_answer(&self, baud: u32) -> Duration {
        time_on_wire(self.bytes_of_answer(), baud)
    }
}

fn time_on_wire(bytes: usize, baud: u32) -> Duration {
    let bits = u64::try_from(10 * bytes).unwrap_or(u64::MAX);
    Duration::from_nanos(bits.saturating_mul(1_000_000_000) / u64::from(baud.max(1)))
}

/// The request to one bus in one cycle. The line is half-duplex: a part is sent when the part before it was answered,
/// or its timeout is over.
#[derive(Clone, Debug)]
pub struct Request {
    bytes: [u8; BYTES],
    end: usize,
    parts: ArrayVec<Part, 3>,
}

impl Default for Request {
    fn default() -> Self {
        Self { bytes: [0; BYTES], end: 0, parts: ArrayVec::new() }
    }
}

impl Request {
    /// Starts a new request.
    pub(crate) fn clear(&mut self) {
        self.end = 0;
        self.parts.clear();
    }

    /// Adds a part. `write` gets the identifiers, writes the bytes to the buffer and returns their number. An empty part
    /// is left out.
    pub(crate) fn add(
        &mut self,
        kind: PartKind,
        servos: impl IntoIterator<Item = Id>,
        data: usize,
        write: impl FnOnce(&[u8], &mut [u8]) -> usize,
    ) {
        let mut part = Part::new(kind, 0, data, servos);
        let free = require!(self.bytes.get_mut(self.end..), "a request ends at byte {}", self.end);
        part.sent = write(&part.ids, free.unwrap_or_default());
        let sent = part.sent;
        if sent > 0
            && invariant!(self.parts.try_push(part).is_ok(), "a request has room for a part of {sent} bytes")
        {
            self.end += sent;
        }
    }

    /// The parts with their bytes, in sending order.
    pub fn parts(&self) -> impl Iterator<Item = (&Part, &[u8])> {
        let mut start = 0;
        self.parts.iter().map(move |part| {
            let bytes = self.bytes.get(start..start + part.sent);
            let bytes = require!(bytes, "a part of {} bytes begins at byte {start}", part.sent);
            start += part.sent;
            (part, bytes.unwrap_or_default())
        })
    }
}

/// One answer.
#[derive(Clone, Debug)]
pub(crate) struct Answer {
    kind: PartKind,
    data: ArrayVec<u8, DATA>,
    id: Id,
    alert: bool,
    fault: Option<servo::Fault>,
}

impl Answer {
    pub(crate) fn status(&self) -> Status<'_> {
        Status { id: self.id, alert: self.alert, fault: self.fault, params: &self.data }
    }
}

/// What became of the parts of one kind.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PartRecord {
    /// When the part was sent.
    pub(crate) asked_at: Instant,
    /// Bytes received.
    pub(crate) bytes: usize,
    /// Corrupt answers.
    pub(crate) corrupt: u32,
}

/// The replies of a bus to a request.
#[derive(Clone, Debug, Default)]
pub struct Replies {
    pub(crate) answers: ArrayVec<Answer, ANSWERS>,
    /// By kind of part.
    parts: [PartRecord; PART_KINDS],
    /// Bytes that arrived too late and were discarded.
    pub(crate) late: usize,
    /// Longest silence before received bytes, beyond the time of one answer on the wire.
    pub(crate) slow: Duration,
    /// Whether bytes were received that belong to no answer.
    pub(crate) noisy: bool,
    /// Why the replies are incomplete: the line was lost.
    pub(crate) lost: Option<LineLostError>,
}

impl Replies {
    /// Clears the replies for a new request.
    pub fn clear(&mut self) {
        self.answers.clear();
        self.parts.iter_mut().for_each(|part| (part.bytes, part.corrupt) = (0, 0));
        self.late = 0;
        self.slow = Duration::ZERO;
        self.noisy = false;
        self.lost = None;
    }

    /// Sets all send times to `now`: simulated time does not advance during an exchange.
    pub(crate) fn stamp(&mut self, now: Instant) {
        self.parts.iter_mut().for_each(|part| part.asked_at = now);
    }

    /// What became of the parts of a kind.
    pub(crate) fn part(&self, kind: PartKind) -> PartRecord {
        require!(self.parts.get(kind as usize), "{kind:?} has a record").copied().unwrap_or_default()
    }

    /// Changes the record of a kind of part.
    pub(crate) fn record(&mut self, kind: PartKind, change: impl FnOnce(&mut PartRecord)) {
        if let Some(part) = require!(self.parts.get_mut(kind as usize), "{kind:?} has a record") {
            change(part);
        }
    }

    /// Adds an answer to a part of the request. An answer that is longer than any expected one, or exceeds the
    /// capacity, is dropped and counts as noise.
    pub fn add(&mut self, kind: PartKind, status: &Status<'_>) {
        let Status { id, alert, fault, params } = *status;
        let answer = ArrayVec::try_from(params).map(|data| Answer { kind, data, id, alert, fault });
        self.noisy |= !answer.is_ok_and(|answer| self.answers.try_push(answer).is_ok());
    }

    pub(crate) fn about(&self, kind: PartKind) -> impl Iterator<Item = Status<'_>> {
        self.answers.iter().filter(move |answer| answer.kind == kind).map(Answer::status)
    }

    pub(crate) fn has_from(&self, id: u8) -> bool {
        self.answers.iter().any(|answer| answer.id.get() == id)
    }
}
