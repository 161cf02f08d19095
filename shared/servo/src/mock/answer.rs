use clock::Duration;

use crate::frame::HEADER;

/// What one servo says, or the host's echo.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Answer {
    /// Who says it; 254 where it is an echo.
    pub id: u8,
    /// How long it waits once the line is free.
    pub wait: Duration,
    /// The bytes.
    pub bytes: Vec<u8>,
}

impl Answer {
    /// What is on the wire when another servo says something at once, `shift` bytes later: a low
    /// level wins.
    pub(super) fn collide(&mut self, other: &[u8], shift: usize) {
        self.bytes.resize(self.bytes.len().max(other.len() + shift), 0xFF);
        for (byte, other) in self.bytes.iter_mut().skip(shift).zip(other) {
            *byte &= other;
        }
    }

    /// Whether a frame begins here: a later part of a fast reply has no header.
    pub(super) fn has_header(&self) -> bool {
        self.bytes.starts_with(&HEADER)
    }
}

/// What is said to an instruction, in its order. Its memory is used again.
#[derive(Clone, Debug, Default)]
pub struct Answers {
    list: Vec<Answer>,
    spare: Vec<Vec<u8>>,
}

/// As long an answer as is usual, in bytes.
const USUAL: usize = 128;

/// Instructions that are heard at once, as a rule, by a line that was late: a host that had no answer in time asks
/// again.
const AT_ONCE: usize = 4;

impl Answers {
    /// None, with memory for what so many servos say to several instructions at once, and for an echo of each.
    #[must_use]
    pub fn for_servos(servos: usize) -> Self {
        let count = AT_ONCE * (servos + 1);
        let spare = std::iter::repeat_with(|| Vec::with_capacity(USUAL)).take(count).collect();
        Self { list: Vec::with_capacity(count), spare }
    }

    /// Forgets them.
    pub fn clear(&mut self) {
        self.truncate(0);
    }

    /// The answers.
    #[must_use]
    pub fn get(&self) -> &[Answer] {
        &self.list
    }

    pub(super) fn get_mut(&mut self) -> &mut Vec<Answer> {
        &mut self.list
    }

    pub(super) fn truncate(&mut self, count: usize) {
        let count = count.min(self.list.len());
        self.spare.extend(self.list.drain(count..).map(|answer| answer.bytes));
    }

    pub(super) fn add(&mut self, id: u8, wait: Duration, said: &[u8]) {
        let mut bytes = self.spare.pop().unwrap_or_default();
        bytes.clear();
        bytes.extend_from_slice(said);
        self.list.push(Answer { id, wait, bytes });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_memory_for_all_that_is_said_at_once_and_it_is_used_again() {
        let mut answers = Answers::for_servos(3);
        let room = |answers: &Answers| (answers.list.capacity(), answers.spare.capacity());
        let before = room(&answers);
        for _ in 0..3 {
            (0..AT_ONCE * 4).for_each(|_| answers.add(1, Duration::ZERO, &[0; USUAL]));
            assert!(answers.spare.is_empty() && answers.get().len() == AT_ONCE * 4);
            assert!(answers.get().iter().all(|answer| answer.bytes.capacity() == USUAL));
            answers.clear();
        }
        assert_eq!(room(&answers), before);
    }
}
