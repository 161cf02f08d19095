/// Maximum number of subscribers to a topic: its process, a recorder, a benchmark and observers.
pub(crate) const READERS: usize = 8;
/// Maximum number of publishers of a robot's topic: its process, a killed one not cleaned up yet, and foreign ones,
/// which must not lock it out.
pub(crate) const WRITERS: usize = 4;
/// Number of frames that a subscriber holds at a time.
pub(crate) const BORROWED: usize = 2;
/// Number of frames that the publisher writes at a time.
pub(crate) const LOANED: usize = 1;

/// Factor of the queue length of observers. Observers run after the robot's processes and want every frame, whereas
/// the processes want the newest.
const ONLOOKERS: usize = 8;

/// Policy for a full subscriber queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// Wall time: the oldest frame of that subscriber is dropped, which shows as a gap.
    Newest,
    /// Lockstep time: sending fails with an error that names the topic.
    Every,
}

/// Queue settings, the same for every port of a domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Queues {
    /// Queue length of a subscriber in the robot's processes.
    pub frames: usize,
    /// Policy for a full queue.
    pub delivery: Delivery,
}

impl Queues {
    /// Maximum number of frames of a topic that exist at the same time. This much memory is allocated, so that the
    /// publisher always finds space for the next frame.
    #[must_use]
    pub fn alive(self) -> usize {
        alive(self.delivery, self.longest(), READERS, BORROWED)
    }

    /// Maximum queue length of any subscriber.
    pub(crate) fn longest(self) -> usize {
        match self.delivery {
            Delivery::Newest => self.frames.saturating_mul(ONLOOKERS),
            Delivery::Every => self.frames,
        }
    }
}

/// Maximum number of frames of a topic that exist at the same time. Each of the `readers` subscribers has a queue of
/// at most `longest` frames, and holds up to `borrowed` frames.
///
/// With dropping, every queue holds a subset of the last `longest` frames, so the queues share them. Only borrowed
/// frames can be older, and one frame is being written. Without dropping, every subscriber may hold different frames.
pub(crate) fn alive(delivery: Delivery, longest: usize, readers: usize, borrowed: usize) -> usize {
    match delivery {
        Delivery::Newest => longest.saturating_add(readers.saturating_mul(borrowed)),
        Delivery::Every => longest.saturating_add(borrowed).saturating_mul(readers),
    }
    .saturating_add(LOANED)
}
