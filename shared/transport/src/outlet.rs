use std::fmt;
use std::mem::MaybeUninit;

use iceoryx2::port::BackpressureAction;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, CallbackProgression};
use iceoryx2::sample_mut::SampleMut;
use iceoryx2::sample_mut_uninit::SampleMutUninit;
use iceoryx2::service::ipc::Service;
use iceoryx2::service::port_factory::PortFactory as _;
use message::{Head as _, Topic};

use crate::node::topic_name;
use crate::queues::{MAX_LOANED, MAX_SUBSCRIBERS, max_frames};
use crate::service::{Frames, event_service, frame_service};
use crate::writers::identity;
use crate::{Node, OverflowPolicy, PortError, SendError};

/// Uninitialised memory of a frame.
type Loan<T> = SampleMutUninit<Service, [MaybeUninit<<T as Topic>::Entry>], <T as Topic>::Head>;

/// Publisher of a topic.
pub struct FramePublisher<T: Topic> {
    publisher: Publisher<Service, [T::Entry], T::Head>,
    service: Frames<T>,
    notifications: Notifier<Service>,
    topic: String,
    capacity: usize,
    overflow_policy: OverflowPolicy,
    incarnation: u64,
    sequence: u64,
    undelivered: u64,
    /// Subscribers at the last call of `has_new_subscribers`, and a buffer for the next call.
    known: Vec<u128>,
    spare: Vec<u128>,
}

impl<T: Topic> FramePublisher<T> {
    pub(crate) fn open(node: &Node, number: Option<u32>, capacity: usize) -> Result<Self, PortError> {
        let queues = node.queues();
        let (topic, purpose) = (topic_name::<T>(number), "writing");
        let failed = |reason: &dyn fmt::Debug| PortError::new(&topic, purpose, reason);
        let service = frame_service::<T>(node.raw(), (&topic, number), queues, purpose)?;
        let publishers = publishers::<T>(&service);
        // Under a supervisor, subscribers reject foreign publishers. Without one, the first publisher keeps the
        // topic.
        if !publishers.is_empty() && (!node.is_supervised() || T::writer(number).is_none()) {
            return Err(PortError::taken(&topic, &publishers));
        }
        // The process that created the topic may have given it longer queues.
        let made = service.static_config();
        let (readers, borrowed) = (made.max_subscribers(), made.subscriber_max_borrowed_samples());
        let max_frames =
            max_frames(queues.overflow_policy, made.subscriber_max_buffer_size(), readers, borrowed);
        let publisher = service
            .publisher_builder()
            .initial_max_slice_len(capacity)
            .allocation_strategy(AllocationStrategy::Static)
            .max_loaned_samples(MAX_LOANED)
            // The middleware's default assumes that the queues share no frames.
            .override_sample_preallocation(move |_| max_frames)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            // A queue can be full only without overflow.
            .set_backpressure_handler(|_| BackpressureAction::DiscardDataAndFail)
            .create()
            .map_err(|error| {
                if error == PublisherCreateError::ExceedsMaxSupportedPublishers {
                    PortError::taken(&topic, &publishers)
                } else {
                    failed(&error)
                }
            })?;
        let notifications = event_service::<T>(node.raw(), (&topic, number), purpose)?
            .notifier_builder()
            .create()
            .map_err(|error| failed(&error))?;
        let overflow_policy = queues.overflow_policy;
        Ok(Self {
            publisher,
            service,
            notifications,
            topic,
            capacity,
            overflow_policy,
            incarnation: node.incarnation(),
            sequence: 0,
            undelivered: 0,
            known: Vec::with_capacity(MAX_SUBSCRIBERS),
            spare: Vec::with_capacity(MAX_SUBSCRIBERS),
        })
    }

    /// Maximum number of entries of a frame.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// Whether there are new subscribers since the last call. A subscriber that reconnected counts as new; so do all
    /// subscribers at the first call.
    pub fn has_new_subscribers(&mut self) -> bool {
        let mut there = std::mem::take(&mut self.spare);
        there.clear();
        self.service.dynamic_config().list_subscribers(|reader| {
            there.push(reader.subscriber_id.value());
            CallbackProgression::Continue
        });
        let has_new_subscribers = there.iter().any(|reader| !self.known.contains(reader));
        self.spare = std::mem::replace(&mut self.known, there);
        has_new_subscribers
    }

    /// Frames that could not be delivered to some subscriber.
    #[must_use]
    pub fn undelivered(&self) -> u64 {
        self.undelivered
    }

    /// Publishes a frame of `count` entries and notifies the subscribers; returns its sequence number.
    ///
    /// `entry(index)` gives the entries, which are written in place in shared memory. Then `finish_head` can set time stamps
    /// in the head. Entries beyond the capacity are left out and counted in the header.
    ///
    /// # Errors
    ///
    /// No memory is free for another frame, or in lockstep, a subscriber's queue is full.
    pub fn send(
        &mut self,
        head: T::Head,
        count: usize,
        entry: impl FnMut(usize) -> T::Entry,
        finish_head: impl FnOnce(&mut T::Head),
    ) -> Result<u64, SendError> {
        let mut sample = self.loan(count)?;
        *sample.user_header_mut() = head;
        self.deliver(sample.write_from_fn(entry), count, finish_head)
    }

    /// Publishes a frame with these entries, like [`Self::send`].
    ///
    /// # Errors
    ///
    /// As [`Self::send`].
    pub fn send_all(
        &mut self,
        head: T::Head,
        entries: &[T::Entry],
        finish_head: impl FnOnce(&mut T::Head),
    ) -> Result<u64, SendError> {
        let mut sample = self.loan(entries.len())?;
        *sample.user_header_mut() = head;
        let fitting = entries.get(..sample.payload().len()).unwrap_or(entries);
        self.deliver(sample.write_from_slice(fitting), entries.len(), finish_head)
    }

    /// Memory for a frame of as many entries as fit.
    fn loan(&self, count: usize) -> Result<Loan<T>, SendError> {
        self.publisher.loan_slice_uninit(count.min(self.capacity)).map_err(|error| self.failed(&error))
    }

    fn deliver(
        &mut self,
        mut sample: SampleMut<Service, [T::Entry], T::Head>,
        count: usize,
        finish_head: impl FnOnce(&mut T::Head),
    ) -> Result<u64, SendError> {
        let over_capacity = count.saturating_sub(self.capacity);
        self.sequence += 1;
        let header = sample.user_header_mut().header_mut();
        header.sequence = self.sequence;
        header.incarnation = self.incarnation;
        header.over_capacity =
            header.over_capacity.saturating_add(u64::try_from(over_capacity).unwrap_or(u64::MAX));
        finish_head(sample.user_header_mut());
        if let Err(error) = sample.send() {
            self.undelivered += 1;
            // In wall time, a broken connection affects only that subscriber: the others have received the frame.
            if self.overflow_policy == OverflowPolicy::Fail {
                tracing::debug!(topic = self.topic, ?error, "not delivered");
                return Err(SendError::QueueFull { topic: self.topic.clone() });
            }
        }
        // A subscriber that died since the janitor's last scan cannot be notified. This affects no other subscriber.
        if self.notifications.notify().is_err() {
            self.undelivered += 1;
        }
        Ok(self.sequence)
    }

    fn failed(&self, reason: &dyn fmt::Debug) -> SendError {
        SendError::Failed { topic: self.topic.clone(), reason: format!("{reason:?}") }
    }
}

/// The process ids of the publishers.
fn publishers<T: Topic>(service: &Frames<T>) -> Vec<u32> {
    let mut pids = Vec::new();
    service.dynamic_config().list_publishers(|publisher| {
        pids.push(identity(publisher.publisher_id.value()).0);
        CallbackProgression::Continue
    });
    pids
}

impl<T: Topic> fmt::Debug for FramePublisher<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "Outlet({}, {} sent)", self.topic, self.sequence)
    }
}
