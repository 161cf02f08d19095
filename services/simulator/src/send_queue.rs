//! A send queue that is emptied frame by frame.

use std::collections::VecDeque;

/// A queue of entries for frames of bounded size.
#[derive(Debug)]
pub(crate) struct SendQueue<T> {
    waiting: VecDeque<T>,
    room: usize,
}

impl<T> SendQueue<T> {
    /// An empty queue for frames of at most `room` entries.
    pub(crate) fn new(room: usize) -> Self {
        Self { waiting: VecDeque::with_capacity(room), room }
    }

    pub(crate) fn add(&mut self, entries: impl IntoIterator<Item = T>) {
        self.waiting.extend(entries);
    }

    /// Takes the entries of the next frame; the others stay queued.
    pub(crate) fn next_frame(&mut self) -> impl ExactSizeIterator<Item = T> {
        let fits = self.waiting.len().min(self.room);
        self.waiting.drain(..fits)
    }

    /// Whether the queue is empty.
    pub(crate) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surplus_entries_go_into_the_next_frame() {
        let mut send_queue = SendQueue::new(3);
        assert_eq!(send_queue.next_frame().len(), 0);
        send_queue.add(0..7);
        assert_eq!(send_queue.next_frame().collect::<Vec<_>>(), [0, 1, 2]);
        send_queue.add(7..8);
        assert!(!send_queue.is_empty());
        assert_eq!(send_queue.next_frame().collect::<Vec<_>>(), [3, 4, 5]);
        assert_eq!(send_queue.next_frame().collect::<Vec<_>>(), [6, 7]);
        assert!(send_queue.is_empty());
    }
}
