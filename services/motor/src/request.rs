use clock::{Duration, Instant};
use serial::Lost;
use servo::{Id, Status};

/// Servos on one bus at most.
pub const SERVOS_MOST: usize = 32;
/// Bytes of a request: goals for every servo and questions to every servo, stuffed.
const BYTES: usize = 1024;
/// Data of one answer.
const DATA: usize = 128;
/// Bytes of a status without data: header, address, length, instruction, error, check sum.
pub(crate) const STATUS_BYTES: usize = 11;
/// Bytes of a chain before the first answer in it: header, address, length, instruction.
const CHAIN_BYTES: usize = 8;
/// Bytes of one answer within a chain, without data: error, identifier, check sum.
const LINK_BYTES: usize = 4;
/// Answers to one request: two to each of three questions to everybody would be too many already.
const ANSWERS: usize = 3 * SERVOS_MOST;

/// What a part of a request, and an answer to it, is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// The goals of the cycle, and the measurements of the servos that answer in one chain (fast
    /// sync read).
    Chain,
    /// The measurements of the servos that answer each for itself (sync read).
    Each,
    /// The measurements of servos that were not heard in this cycle, once more (sync read).
    Again,
    /// Whether torque is off, after it was switched off.
    Torque,
    /// What one servo is told or asked besides.
    Job,
    /// How one servo is that was asked for its measurements too: only who gave them is asked.
    Look,
    /// How a servo is that has just reported an alert.
    Alarm,
}

impl Topic {
    const COUNT: usize = 7;
}

/// What a part of a request waits for before the next part may go out.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// What it is about.
    pub topic: Topic,
    /// Bytes sent.
    pub sent: usize,
    /// Data bytes expected in each answer.
    pub data: usize,
    ids: [u8; SERVOS_MOST],
    count: usize,
}

impl Part {
    pub(crate) fn new(topic: Topic, sent: usize, data: usize, who: impl IntoIterator<Item = Id>) -> Self {
        let (mut ids, mut count) = ([0; SERVOS_MOST], 0);
        for (place, id) in ids.iter_mut().zip(who) {
            *place = id.get();
            count += 1;
        }
        Self { topic, sent, data, ids, count }
    }

    /// Who answers, in this order.
    #[must_use]
    pub fn ids(&self) -> &[u8] {
        self.ids.get(..self.count).unwrap_or_default()
    }

    /// Bytes of one answer.
    #[must_use]
    pub const fn bytes_of_answer(&self) -> usize {
        let around = if matches!(self.topic, Topic::Chain) { LINK_BYTES } else { STATUS_BYTES };
        around + self.data
    }

    /// Bytes of all answers together.
    #[must_use]
    pub const fn bytes_of_answers(&self) -> usize {
        let before = if matches!(self.topic, Topic::Chain) { CHAIN_BYTES } else { 0 };
        before + self.count * self.bytes_of_answer()
    }

    /// How long the instruction takes on a wire of `baud` bits per second, ten bits a byte.
    #[must_use]
    pub fn time_to_send(&self, baud: u32) -> Duration {
        time_on_wire(self.sent, baud)
    }

    /// How long one answer takes.
    #[must_use]
    pub fn time_to_answer(&self, baud: u32) -> Duration {
        time_on_wire(self.bytes_of_answer(), baud)
    }
}

fn time_on_wire(bytes: usize, baud: u32) -> Duration {
    let bits = u64::try_from(10 * bytes).unwrap_or(u64::MAX);
    Duration::from_nanos(bits.saturating_mul(1_000_000_000) / u64::from(baud.max(1)))
}

/// What one bus is told and asked in one cycle. The line is half-duplex: a part goes out when
/// the part before it was answered, or its time is over.
#[derive(Clone, Debug)]
pub struct Request {
    bytes: [u8; BYTES],
    end: usize,
    parts: [Option<Part>; 3],
    count: usize,
}

impl Default for Request {
    fn default() -> Self {
        Self { bytes: [0; BYTES], end: 0, parts: [None; 3], count: 0 }
    }
}

impl Request {
    /// Begins a new request.
    pub(crate) fn clear(&mut self) {
        (self.end, self.count) = (0, 0);
    }

    /// Adds a part, whose bytes `write` writes to the beginning of what it is given. It returns
    /// how many these were; a part of none is left out.
    pub(crate) fn add(
        &mut self,
        topic: Topic,
        who: impl IntoIterator<Item = Id>,
        data: usize,
        write: impl FnOnce(&mut [u8]) -> usize,
    ) {
        let sent = write(self.bytes.get_mut(self.end..).unwrap_or_default());
        let Some(place) = self.parts.get_mut(self.count).filter(|_| sent > 0) else { return };
        *place = Some(Part::new(topic, sent, data, who));
        self.end += sent;
        self.count += 1;
    }

    /// The parts with their bytes, in the order in which they go out.
    pub fn parts(&self) -> impl Iterator<Item = (&Part, &[u8])> {
        let mut start = 0;
        self.parts.iter().take(self.count).flatten().map(move |part| {
            let bytes = self.bytes.get(start..start + part.sent).unwrap_or_default();
            start += part.sent;
            (part, bytes)
        })
    }
}

/// One answer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Answer {
    pub(crate) topic: Topic,
    data: [u8; DATA],
    length: usize,
    id: Id,
    alert: bool,
    fault: Option<servo::Fault>,
}

impl Answer {
    pub(crate) fn status(&self) -> Status<'_> {
        let params = self.data.get(..self.length).unwrap_or_default();
        Status { id: self.id, alert: self.alert, fault: self.fault, params }
    }
}

/// What a bus answered to a request.
#[derive(Clone, Debug)]
pub struct Replies {
    answers: Vec<Answer>,
    /// When each topic was asked about.
    sent_at: [Instant; Topic::COUNT],
    /// Bytes that came to each topic.
    bytes: [usize; Topic::COUNT],
    /// Answers to each topic that arrived broken.
    spoilt: [u32; Topic::COUNT],
    /// Bytes that came after their time and were thrown away.
    pub(crate) late: usize,
    /// For how long at most nothing came, beyond an answer's time on the wire, before something did.
    pub(crate) slow: Duration,
    /// Whether bytes came that belong to no answer.
    pub(crate) noisy: bool,
    /// Why there are no more: the line is gone.
    pub(crate) lost: Option<Lost>,
}

impl Default for Replies {
    fn default() -> Self {
        Self {
            answers: Vec::with_capacity(ANSWERS),
            sent_at: [Instant::EPOCH; Topic::COUNT],
            bytes: [0; Topic::COUNT],
            spoilt: [0; Topic::COUNT],
            late: 0,
            slow: Duration::ZERO,
            noisy: false,
            lost: None,
        }
    }
}

impl Replies {
    /// Begins to collect the replies to a new request.
    pub fn clear(&mut self) {
        self.answers.clear();
        self.bytes = [0; Topic::COUNT];
        self.spoilt = [0; Topic::COUNT];
        self.late = 0;
        self.slow = Duration::ZERO;
        self.noisy = false;
        self.lost = None;
    }

    /// Notes when a topic was asked about.
    pub(crate) fn asked(&mut self, topic: Topic, at: Instant) {
        if let Some(place) = self.sent_at.get_mut(topic as usize) {
            *place = at;
        }
    }

    /// Lets everything be of one instant: simulated time stands still while a bus speaks.
    pub(crate) fn stamp(&mut self, now: Instant) {
        self.sent_at = [now; Topic::COUNT];
    }

    /// When a topic was asked about.
    pub(crate) fn asked_at(&self, topic: Topic) -> Instant {
        self.sent_at.get(topic as usize).copied().unwrap_or(Instant::EPOCH)
    }

    /// Notes that bytes came to a topic.
    pub(crate) fn hear(&mut self, topic: Topic, bytes: usize) {
        if let Some(place) = self.bytes.get_mut(topic as usize) {
            *place += bytes;
        }
    }

    /// Bytes that came to a topic.
    pub(crate) fn heard(&self, topic: Topic) -> usize {
        self.bytes.get(topic as usize).copied().unwrap_or(0)
    }

    /// Notes broken answers to a topic.
    pub(crate) fn spoil(&mut self, topic: Topic, count: u32) {
        if let Some(place) = self.spoilt.get_mut(topic as usize) {
            *place += count;
        }
    }

    /// Broken answers to a topic.
    pub(crate) fn spoilt(&self, topic: Topic) -> u32 {
        self.spoilt.get(topic as usize).copied().unwrap_or(0)
    }

    /// Adds an answer to a part of the request. What is longer than anything that was asked for,
    /// or one too many, is dropped.
    pub fn add(&mut self, topic: Topic, status: &Status<'_>) {
        let mut data = [0; DATA];
        let Some(place) = data.get_mut(..status.params.len()) else { return };
        place.copy_from_slice(status.params);
        if self.answers.len() < self.answers.capacity() {
            let (id, alert, fault) = (status.id, status.alert, status.fault);
            self.answers.push(Answer { topic, data, length: status.params.len(), id, alert, fault });
        }
    }

    /// Notes that the line is gone.
    pub fn lose(&mut self, why: Lost) {
        self.lost = Some(why);
    }

    pub(crate) fn all(&self) -> &[Answer] {
        &self.answers
    }

    pub(crate) fn about(&self, topic: Topic) -> impl Iterator<Item = Status<'_>> {
        self.answers.iter().filter(move |answer| answer.topic == topic).map(Answer::status)
    }

    pub(crate) fn has_from(&self, id: u8) -> bool {
        self.answers.iter().any(|answer| answer.id.get() == id)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.answers.is_empty()
    }
}
