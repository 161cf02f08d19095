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

impl PartKind {
    const COUNT: usize = 7;

    /// The entry of this kind in a table with one entry a kind.
    const fn of<T>(self, table: &[T; Self::COUNT]) -> &T {
        let [fast, plain, again, torque, job, condition, alert] = table;
        match self {
            Self::FastRead => fast,
            Self::PlainRead => plain,
            Self::Reread => again,
            Self::Torque => torque,
            Self::Job => job,
            Self::ReadCondition => condition,
            Self::AlertCondition => alert,
        }
    }

    /// As [`of`](Self::of), to be changed.
    const fn of_mut<T>(self, table: &mut [T; Self::COUNT]) -> &mut T {
        let [fast, plain, again, torque, job, condition, alert] = table;
        match self {
            Self::FastRead => fast,
            Self::PlainRead => plain,
            Self::Reread => again,
            Self::Torque => torque,
            Self::Job => job,
            Self::ReadCondition => condition,
            Self::AlertCondition => alert,
        }
    }
}

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

    /// Adds a part. `write` writes its bytes to the buffer and returns their number; an empty part is left out.
    pub(crate) fn add(
        &mut self,
        kind: PartKind,
        servos: impl IntoIterator<Item = Id>,
        data: usize,
        write: impl FnOnce(&mut [u8]) -> usize,
    ) {
        let free = require!(self.bytes.get_mut(self.end..), "a request ends at byte {}", self.end);
        let sent = write(free.unwrap_or_default());
        if sent == 0 {
            return;
        }
        let is_added = self.parts.try_push(Part::new(kind, sent, data, servos)).is_ok();
        if invariant!(is_added, "a request has room for a part of {sent} bytes") {
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
#[derive(Clone, Copy, Debug)]
pub(crate) struct Answer {
    pub(crate) kind: PartKind,
    data: [u8; DATA],
    length: usize,
    id: Id,
    alert: bool,
    fault: Option<servo::Fault>,
}

impl Answer {
    pub(crate) fn status(&self) -> Status<'_> {
        let params = require!(self.data.get(..self.length), "{} bytes", self.length).unwrap_or_default();
        Status { id: self.id, alert: self.alert, fault: self.fault, params }
    }
}

/// The replies of a bus to a request.
#[derive(Clone, Debug)]
pub struct Replies {
    answers: Vec<Answer>,
    /// When each kind of part was sent.
    sent_at: [Instant; PartKind::COUNT],
    /// Bytes received by kind of part.
    bytes: [usize; PartKind::COUNT],
    /// Corrupt answers by kind of part.
    corrupt_replies: [u32; PartKind::COUNT],
    /// Bytes that arrived too late and were discarded.
    pub(crate) late: usize,
    /// Longest silence before received bytes, beyond the time of one answer on the wire.
    pub(crate) slow: Duration,
    /// Whether bytes were received that belong to no answer.
    pub(crate) noisy: bool,
    /// Why the replies are incomplete: the line was lost.
    pub(crate) lost: Option<LineLostError>,
}

impl Default for Replies {
    fn default() -> Self {
        Self {
            answers: Vec::with_capacity(ANSWERS),
            sent_at: [Instant::EPOCH; PartKind::COUNT],
            bytes: [0; PartKind::COUNT],
            corrupt_replies: [0; PartKind::COUNT],
            late: 0,
            slow: Duration::ZERO,
            noisy: false,
            lost: None,
        }
    }
}

impl Replies {
    /// Clears the replies for a new request.
    pub fn clear(&mut self) {
        self.answers.clear();
        self.bytes = [0; PartKind::COUNT];
        self.corrupt_replies = [0; PartKind::COUNT];
        self.late = 0;
        self.slow = Duration::ZERO;
        self.noisy = false;
        self.lost = None;
    }

    /// Records when a part was sent.
    pub(crate) fn asked(&mut self, kind: PartKind, at: Instant) {
        *kind.of_mut(&mut self.sent_at) = at;
    }

    /// Sets all send times to `now`: simulated time does not advance during an exchange.
    pub(crate) fn stamp(&mut self, now: Instant) {
        self.sent_at = [now; PartKind::COUNT];
    }

    /// When a part was sent.
    pub(crate) fn asked_at(&self, kind: PartKind) -> Instant {
        *kind.of(&self.sent_at)
    }

    /// Records received bytes of a part.
    pub(crate) fn hear(&mut self, kind: PartKind, bytes: usize) {
        *kind.of_mut(&mut self.bytes) += bytes;
    }

    /// Bytes received for a part.
    pub(crate) fn heard(&self, kind: PartKind) -> usize {
        *kind.of(&self.bytes)
    }

    /// Records corrupt answers to a part.
    pub(crate) fn record_corrupt(&mut self, kind: PartKind, count: u32) {
        *kind.of_mut(&mut self.corrupt_replies) += count;
    }

    /// Corrupt answers to a part.
    pub(crate) fn corrupt_replies(&self, kind: PartKind) -> u32 {
        *kind.of(&self.corrupt_replies)
    }

    /// Adds an answer to a part of the request. An answer that is longer than any expected one, or exceeds the
    /// capacity, is dropped and counts as noise.
    pub fn add(&mut self, kind: PartKind, status: &Status<'_>) {
        let mut data = [0; DATA];
        let place = data.get_mut(..status.params.len());
        let Some(place) = place.filter(|_| self.answers.len() < self.answers.capacity()) else {
            self.noisy = true;
            return;
        };
        place.copy_from_slice(status.params);
        let (id, alert, fault) = (status.id, status.alert, status.fault);
        self.answers.push(Answer { kind, data, length: status.params.len(), id, alert, fault });
    }

    /// Records that the line was lost.
    pub fn lose(&mut self, why: LineLostError) {
        self.lost = Some(why);
    }

    pub(crate) fn all(&self) -> &[Answer] {
        &self.answers
    }

    pub(crate) fn about(&self, kind: PartKind) -> impl Iterator<Item = Status<'_>> {
        self.answers.iter().filter(move |answer| answer.kind == kind).map(Answer::status)
    }

    pub(crate) fn has_from(&self, id: u8) -> bool {
        self.answers.iter().any(|answer| answer.id.get() == id)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.answers.is_empty()
    }
}
