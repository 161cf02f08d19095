use std::fmt;
use std::time::Duration;

use iceoryx2::port::listener::Listener;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::sample::Sample;
use iceoryx2::service::ipc::Service;
use iceoryx2::service::port_factory::PortFactory as _;
use message::{Head as _, Process, Topic};

use crate::node::topic_name;
use crate::service::{event_service, existing_frame_service, frame_service};
use crate::writers::PublisherFilter;
use crate::{Node, PortError, ReceiveError};

/// Maximum number of frames refused in one call. It exceeds the number of frames that all refused publishers have in
/// their queues.
const MAX_REFUSED: usize = 256;

/// Subscriber to a topic.
pub struct FrameSubscriber<T: Topic> {
    subscriber: Subscriber<Service, [T::Entry], T::Head>,
    notifications: Option<Listener<Service>>,
    topic: String,
    writers: PublisherFilter,
    last: Option<(u64, u64)>,
    drops: u64,
}

/// A received frame, read in place in shared memory while this is held.
pub struct Frame<T: Topic> {
    sample: Sample<Service, [T::Entry], T::Head>,
}

impl<T: Topic> Frame<T> {
    /// The head of the frame.
    #[must_use]
    pub fn head(&self) -> &T::Head {
        self.sample.user_header()
    }

    /// The entries of the frame.
    #[must_use]
    pub fn entries(&self) -> &[T::Entry] {
        self.sample.payload()
    }
}

impl<T: Topic> fmt::Debug for Frame<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "Frame({:?}, {} entries)", self.head(), self.entries().len())
    }
}

impl<T: Topic> FrameSubscriber<T> {
    pub(crate) fn open(
        node: &Node,
        number: Option<u32>,
        owner: Option<Process>,
        is_woken: bool,
    ) -> Result<Self, PortError> {
        let (queues, writers) = (node.queues(), node.writers(owner));
        let (topic, purpose) = (topic_name::<T>(number), "reading");
        let failed = |reason: &dyn fmt::Debug| PortError::new(&topic, purpose, reason);
        let service = frame_service::<T>(node.raw(), (&topic, number), queues, purpose)?;
        let subscriber = service
            .subscriber_builder()
            .buffer_size(queues.frames)
            .create()
            .map_err(|error| failed(&error))?;
        let notifications = if is_woken {
            let service = event_service::<T>(node.raw(), (&topic, number), purpose)?;
            Some(service.listener_builder().create().map_err(|error| failed(&error))?)
        } else {
            None
        };
        Ok(Self { subscriber, notifications, topic, writers, last: None, drops: 0 })
    }

    /// A subscriber to an existing topic, with the maximum queue length of the topic. `None` if the topic does not
    /// exist.
    pub(crate) fn open_existing(node: &Node, number: Option<u32>) -> Result<Option<Self>, PortError> {
        let (topic, writers) = (topic_name::<T>(number), node.writers(T::writer(number)));
        let Some(service) = existing_frame_service::<T>(node.raw(), &topic)? else { return Ok(None) };
        let frames = service.static_config().subscriber_max_buffer_size();
        let subscriber = service.subscriber_builder().buffer_size(frames).create();
        let subscriber = subscriber.map_err(|error| PortError::new(&topic, "reading", error))?;
        Ok(Some(Self { subscriber, notifications: None, topic, writers, last: None, drops: 0 }))
    }

    /// The oldest frame in the queue, if any. Skips frames of processes that may not publish.
    ///
    /// # Errors
    ///
    /// The middleware failed.
    pub fn receive(&mut self) -> Result<Option<Frame<T>>, ReceiveError> {
        for _refused in 0..=MAX_REFUSED {
            let Some(sample) = self.subscriber.receive().map_err(|error| self.failed(&error))? else {
                return Ok(None);
            };
            if self.writers.accept(sample.origin().value(), &self.topic) {
                let frame: Frame<T> = Frame { sample };
                self.account(frame.head().header().incarnation, frame.head().header().sequence);
                return Ok(Some(frame));
            }
        }
        Ok(None)
    }

    /// The newest frame in the queue, if any. Skipped older frames do not count as drops.
    ///
    /// # Errors
    ///
    /// The middleware failed.
    pub fn newest(&mut self) -> Result<Option<Frame<T>>, ReceiveError> {
        let mut newest = None;
        while let Some(frame) = self.receive()? {
            newest = Some(frame);
        }
        Ok(newest)
    }

    /// Waits up to `max` for a notification of the writer. Returns at once if one was sent since the last wait. May
    /// wake spuriously, so check whether a frame is there.
    ///
    /// # Errors
    ///
    /// The subscriber was opened without notifications, or the middleware failed.
    pub fn wait(&mut self, max: Duration) -> Result<(), ReceiveError> {
        let Some(notifications) = &self.notifications else {
            return Err(self.failed(&"the subscriber was opened without a notifier"));
        };
        match notifications.timed_wait(|_| {}, max) {
            Ok(_) => Ok(()),
            // A signal arrived; the caller checks its stop flag.
            Err(iceoryx2::port::listener::ListenerWaitError::InterruptSignal) => Ok(()),
            Err(error) => Err(self.failed(&error)),
        }
    }

    /// Frames lost because this subscriber was slow, by gaps of the sequence number.
    #[must_use]
    pub fn drops(&self) -> u64 {
        self.drops
    }

    fn account(&mut self, incarnation: u64, sequence: u64) {
        if let Some((last_incarnation, last_sequence)) = self.last
            && last_incarnation == incarnation
        {
            let lost = sequence.saturating_sub(last_sequence.saturating_add(1));
            self.drops = self.drops.saturating_add(lost);
        }
        self.last = Some((incarnation, sequence));
    }

    fn failed(&self, reason: &dyn fmt::Debug) -> ReceiveError {
        ReceiveError { topic: self.topic.clone(), reason: format!("{reason:?}") }
    }
}

impl<T: Topic> fmt::Debug for FrameSubscriber<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "Inlet({}, {:?})", self.topic, self.last)
    }
}
