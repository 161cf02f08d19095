use clock::Duration;
use serial::Lost;
use servo::Status;

/// Servos on one bus at most.
pub const SERVOS_MOST: usize = 32;
/// Bytes of a request: goals for every servo and questions to every servo, stuffed.
const BYTES: usize = 1024;
/// Data of one answer.
const DATA: usize = 96;
/// Bytes of a status without data: header, address, length, instruction, error, check sum.
const STATUS_BYTES: usize = 11;

/// What a part of a request waits for before the next part may go out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Part {
    /// Bytes sent.
    pub sent: usize,
    /// Answers expected.
    pub answers: usize,
    /// Data bytes expected in each.
    pub data: usize,
}

impl Part {
    /// How long the part takes on a wire of `baud` bits per second, ten bits a byte.
    #[must_use]
    pub fn time_on_wire(&self, baud: u32) -> Duration {
        let bytes = self.sent + self.answers * (STATUS_BYTES + self.data);
        let bits = u64::try_from(10 * bytes).unwrap_or(u64::MAX);
        Duration::from_nanos(bits * 1_000_000_000 / u64::from(baud.max(1)))
    }
}

/// What one bus is told and asked in one cycle. The line is half-duplex: a part goes out when
/// the part before it was answered, or its time is over.
#[derive(Clone, Debug)]
pub struct Request {
    bytes: [u8; BYTES],
    end: usize,
    parts: [Part; 2],
    count: usize,
}

impl Default for Request {
    fn default() -> Self {
        Self { bytes: [0; BYTES], end: 0, parts: [Part::default(); 2], count: 0 }
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
        answers: usize,
        data: usize,
        write: impl FnOnce(&mut [u8]) -> usize,
    ) -> bool {
        let sent = write(self.bytes.get_mut(self.end..).unwrap_or_default());
        let Some(place) = self.parts.get_mut(self.count).filter(|_| sent > 0) else { return false };
        *place = Part { sent, answers, data };
        self.end += sent;
        self.count += 1;
        true
    }

    /// The parts with their bytes, in the order in which they go out.
    pub fn parts(&self) -> impl Iterator<Item = (Part, &[u8])> {
        let mut start = 0;
        self.parts.iter().take(self.count).map(move |part| {
            let bytes = self.bytes.get(start..start + part.sent).unwrap_or_default();
            start += part.sent;
            (*part, bytes)
        })
    }
}

/// One answer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Answer {
    /// The part of the request that it answers.
    pub(crate) part: usize,
    status: [u8; DATA],
    length: usize,
    id: servo::Id,
    alert: bool,
    fault: Option<servo::Fault>,
}

impl Answer {
    pub(crate) fn status(&self) -> Status<'_> {
        let params = self.status.get(..self.length).unwrap_or_default();
        Status { id: self.id, alert: self.alert, fault: self.fault, params }
    }
}

/// What a bus answered to a request.
#[derive(Clone, Debug)]
pub struct Replies {
    answers: Vec<Answer>,
    /// Why there are no more: the line is gone.
    pub(crate) lost: Option<Lost>,
}

impl Default for Replies {
    fn default() -> Self {
        Self { answers: Vec::with_capacity(SERVOS_MOST + 1), lost: None }
    }
}

impl Replies {
    /// Begins to collect the replies to a new request.
    pub fn clear(&mut self) {
        self.answers.clear();
        self.lost = None;
    }

    /// Adds an answer to a part of the request. What is longer than anything that was asked for,
    /// or one too many, is dropped.
    pub fn add(&mut self, part: usize, status: &Status<'_>) {
        let mut data = [0; DATA];
        let Some(place) = data.get_mut(..status.params.len()) else { return };
        place.copy_from_slice(status.params);
        if self.answers.len() < self.answers.capacity() {
            let (id, alert, fault) = (status.id, status.alert, status.fault);
            self.answers.push(Answer { part, status: data, length: status.params.len(), id, alert, fault });
        }
    }

    /// Notes that the line is gone.
    pub fn lose(&mut self, why: Lost) {
        self.lost = Some(why);
    }

    pub(crate) fn of_part(&self, part: usize) -> impl Iterator<Item = &Answer> {
        self.answers.iter().filter(move |answer| answer.part == part)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.answers.is_empty()
    }
}
