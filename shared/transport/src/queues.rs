/// Maximum number of subscribers to a topic: its process, a recorder, a benchmark and observers.
pub(crate) const MAX_SUBSCRIBERS: usize = 8;
/// Maximum number of publishers of a robot's topic: its process, a killed one not cleaned up yet, and foreign ones,
/// which must not lock it out.
pub(crate) const MAX_PUBLISHERS: usize = 4;
/// Number of frames that a subscriber holds at a time.
pub(crate) const MAX_BORROWED: usize = 2;
/// Number of frames that the publisher writes at a time.
pub(crate) const MAX_LOANED: usize = 1;

/// Factor of the queue length of observers. Observers run after the robot's processes and want every frame, whereas
/// the processes want the newest.
const OBSERVER_QUEUE_FACTOR: usize = 8;

/// Policy for a full subscriber queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OverflowPolicy {
    /// Wall time: the oldest frame of that subscriber is dropped, which shows as a gap.
    DropOldest,
    /// Lockstep time: sending fails with an error that names the topic.
    Fail,
}

/// Queue settings, the same for every port of a domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Queues {
    /// Queue length of a subscriber in the robot's processes.
    pub frames: usize,
    /// Policy for a full queue.
    pub overflow_policy: OverflowPolicy,
}

impl Queues {
    /// Maximum number of frames of a topic that exist at the same time. This much memory is allocated, so that the
    /// publisher always finds space for the next frame.
    #[must_use]
    pub fn max_frames(self) -> usize {
        max_frames(self.overflow_policy, self.max_queue_length(), MAX_SUBSCRIBERS, MAX_BORROWED)
    }

    /// Maximum queue length of any subscriber.
    pub(crate) fn max_queue_length(self) -> usize {
        match self.overflow_policy {
            OverflowPolicy::DropOldest => self.frames.saturating_mul(OBSERVER_QUEUE_FACTOR),
            OverflowPolicy::Fail => self.frames,
        }
    }
}

/// Maximum number of frames of a topic that exist at the same time. Each of the `readers` subscribers has a queue of
/// at most `max_queue_length` frames, and holds up to `borrowed` frames.
///
/// With dropping, every queue holds a subset of the last `max_queue_length` frames, so the queues share them. Only
/// borrowed frames can be older, and one frame is being written. Without dropping, every subscriber may hold different
/// frames.
pub(crate) fn max_frames(
    overflow_policy: OverflowPolicy,
    max_queue_length: usize,
    readers: usize,
    borrowed: usize,
) -> usize {
    match overflow_policy {
        OverflowPolicy::DropOldest => max_queue_length.saturating_add(readers.saturating_mul(borrowed)),
        OverflowPolicy::Fail => max_queue_length.saturating_add(borrowed).saturating_mul(readers),
    }
    .saturating_add(MAX_LOANED)
}
