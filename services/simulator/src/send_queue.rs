//! A send queue that is emptied frame by frame.

use std::collections::VecDeque;
use std::collections::vec_deque::Drain;

/// Takes the entries of the next frame, at most `room`.
pub(crate) fn next_frame<T>(waiting: &mut VecDeque<T>, room: usize) -> Drain<'_, T> {
    waiting.drain(..waiting.len().min(room))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_beyond_the_capacity_are_published_in_the_next_frame() {
        let mut waiting = VecDeque::new();
        assert_eq!(next_frame(&mut waiting, 3).len(), 0);
        waiting.extend(0..7);
        assert_eq!(next_frame(&mut waiting, 3).collect::<Vec<_>>(), [0, 1, 2]);
        waiting.extend(7..8);
        assert_eq!(next_frame(&mut waiting, 3).collect::<Vec<_>>(), [3, 4, 5]);
        assert_eq!(next_frame(&mut waiting, 3).collect::<Vec<_>>(), [6, 7]);
        assert!(waiting.is_empty());
    }
}
