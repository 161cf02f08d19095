//! What is to be sent, a frame at a time.

use std::collections::VecDeque;

/// Entries that wait, in their order, where a frame has room for so many and no more.
#[derive(Debug)]
pub(crate) struct Backlog<T> {
    waiting: VecDeque<T>,
    room: usize,
}

impl<T> Backlog<T> {
    /// Nothing waits yet for frames with room for so many.
    pub(crate) fn new(room: usize) -> Self {
        Self { waiting: VecDeque::with_capacity(room), room }
    }

    pub(crate) fn add(&mut self, entries: impl IntoIterator<Item = T>) {
        self.waiting.extend(entries);
    }

    /// Takes what the next frame holds; the rest is of the frames after it.
    pub(crate) fn next_frame(&mut self) -> impl ExactSizeIterator<Item = T> {
        let fits = self.waiting.len().min(self.room);
        self.waiting.drain(..fits)
    }

    /// Whether nothing waits.
    pub(crate) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_frame_has_no_room_for_is_of_the_next_one() {
        let mut backlog = Backlog::new(3);
        assert_eq!(backlog.next_frame().len(), 0);
        backlog.add(0..7);
        assert_eq!(backlog.next_frame().collect::<Vec<_>>(), [0, 1, 2]);
        backlog.add(7..8);
        assert!(!backlog.is_empty());
        assert_eq!(backlog.next_frame().collect::<Vec<_>>(), [3, 4, 5]);
        assert_eq!(backlog.next_frame().collect::<Vec<_>>(), [6, 7]);
        assert!(backlog.is_empty());
    }
}
