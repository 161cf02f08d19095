use clock::Duration;

use crate::frame::HEADER;

/// The reply of one servo, or an echo of the host's bytes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reply {
    /// The ID of the servo; 254 for an echo.
    pub id: u8,
    /// Delay after the bus is free.
    pub wait: Duration,
    /// The bytes.
    pub bytes: Vec<u8>,
}

impl Reply {
    /// Superimposes another servo's bytes, sent at the same time and `shift` bytes later. A low level wins on the bus.
    pub(super) fn collide(&mut self, other: &[u8], shift: usize) {
        self.bytes.resize(self.bytes.len().max(other.len() + shift), 0xFF);
        for (byte, other) in self.bytes.iter_mut().skip(shift).zip(other) {
            *byte &= other;
        }
    }

    /// Whether the bytes begin with a header; the later blocks of a fast reply do not.
    pub(super) fn has_header(&self) -> bool {
        self.bytes.starts_with(&HEADER)
    }
}

/// The replies to an instruction, in order. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub struct Replies {
    /// The replies.
    pub list: Vec<Reply>,
    spare: Vec<Vec<u8>>,
}

/// Capacity of a reply buffer, in bytes; it suffices for usual replies.
const USUAL: usize = 128;

/// Maximum number of instructions processed at once without allocation. A bus that is late receives several, because a
/// host without a reply asks again.
const AT_ONCE: usize = 4;

impl Replies {
    /// An empty list, with buffers for the replies of so many servos, and an echo, to several instructions at once.
    #[must_use]
    pub fn for_servos(servos: usize) -> Self {
        let count = AT_ONCE * (servos + 1);
        let spare = std::iter::repeat_with(|| Vec::with_capacity(USUAL)).take(count).collect();
        Self { list: Vec::with_capacity(count), spare }
    }

    /// Removes all replies and keeps their buffers.
    pub fn clear(&mut self) {
        self.truncate(0);
    }

    pub(super) fn truncate(&mut self, count: usize) {
        let count = count.min(self.list.len());
        self.spare.extend(self.list.drain(count..).map(|answer| answer.bytes));
    }

    pub(super) fn add(&mut self, id: u8, wait: Duration, said: &[u8]) {
        let mut bytes = self.spare.pop().unwrap_or_default();
        bytes.clear();
        bytes.extend_from_slice(said);
        self.list.push(Reply { id, wait, bytes });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reply_memory_holds_all_replies_and_is_reused() {
        let mut answers = Replies::for_servos(3);
        let room = |answers: &Replies| (answers.list.capacity(), answers.spare.capacity());
        let before = room(&answers);
        for _ in 0..3 {
            (0..AT_ONCE * 4).for_each(|_| answers.add(1, Duration::ZERO, &[0; USUAL]));
            assert!(answers.spare.is_empty() && answers.list.len() == AT_ONCE * 4);
            assert!(answers.list.iter().all(|answer| answer.bytes.capacity() == USUAL));
            answers.clear();
        }
        assert_eq!(room(&answers), before);
    }
}
