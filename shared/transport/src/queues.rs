/// Readers that a topic has at most: its process, a recorder, a bench and somebody who looks.
pub(crate) const READERS: usize = 8;
/// Publishers that a topic of the robot's processes has at most: its process, one that was killed and is not cleaned up
/// yet, and some that are none of the robot's and must not keep it out.
pub(crate) const WRITERS: usize = 4;
/// Frames that a reader holds at a time.
pub(crate) const BORROWED: usize = 2;
/// Frames that the writer writes at a time.
pub(crate) const LOANED: usize = 1;

/// The queue of somebody who looks on is so many times as long as that of the robot's own processes: an onlooker
/// is scheduled after all of them, and wants every frame where they want the newest.
const ONLOOKERS: usize = 8;

/// What happens when a reader's queue is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// Its oldest frame is dropped, and it sees a gap: wall time.
    Newest,
    /// Sending fails with an error that names the topic: lockstep time.
    Every,
}

/// How frames wait for their readers; the same for every port of a domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Queues {
    /// Frames that wait for a reader that is one of the robot's processes.
    pub frames: usize,
    /// What happens when there are more.
    pub delivery: Delivery,
}

impl Queues {
    /// Frames of a topic that its memory has room for: so many are alive at most, so that whoever writes always
    /// finds room for the next.
    #[must_use]
    pub fn alive(self) -> usize {
        alive(self.delivery, self.longest(), READERS, BORROWED)
    }

    /// Frames that wait for a reader at most, whoever it is.
    pub(crate) fn longest(self) -> usize {
        match self.delivery {
            Delivery::Newest => self.frames.saturating_mul(ONLOOKERS),
            Delivery::Every => self.frames,
        }
    }
}

/// Frames of a topic that are alive at most, where each of so many `readers` has a queue that is no longer than the
/// `longest` and may hold some `borrowed` frames.
///
/// Where a queue that is full forgets its oldest frame, each holds nothing but the last frames sent, and all of
/// them together what the longest holds; only what is borrowed can be older, and one frame is being written.
/// Where none is forgotten, every reader may have stopped at another place.
pub(crate) fn alive(delivery: Delivery, longest: usize, readers: usize, borrowed: usize) -> usize {
    match delivery {
        Delivery::Newest => longest.saturating_add(readers.saturating_mul(borrowed)),
        Delivery::Every => longest.saturating_add(borrowed).saturating_mul(readers),
    }
    .saturating_add(LOANED)
}
