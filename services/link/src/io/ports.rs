//! Access to this machine's topics as bytes.

use std::collections::BTreeMap;
use std::sync::Arc;

use config::Robot;
use message::{Head as _, TopicId, get_frame, put_frame, with_topic};
use process::{ProcessError, ProcessNode};
use transport::{FramePublisher, FrameSubscriber, TopicPorts};

use crate::order::is_latched;
use crate::outbox::FrameNumber;

/// Callback for a frame that was read.
type Taker<'a> = &'a mut dyn FnMut(TopicId, FrameNumber, Arc<[u8]>);

/// A subscribed topic.
trait TopicReader {
    fn topic(&self) -> TopicId;
    fn take(&mut self, to: Taker<'_>) -> Result<(), ProcessError>;
    /// Subscribes again, so that the writer sees a new subscriber. No frame is lost or read twice.
    fn resubscribe(&mut self, member: &ProcessNode, to: Taker<'_>) -> Result<(), ProcessError>;
    fn drops(&self) -> u64;
}

struct Read<T: TopicPorts> {
    topic: TopicId,
    subscriber: FrameSubscriber<T>,
    bytes: Vec<u8>,
    /// The last frame read.
    number: Option<FrameNumber>,
    /// Frames dropped by earlier subscribers.
    drops: u64,
}

impl<T: TopicPorts> TopicReader for Read<T> {
    fn topic(&self) -> TopicId {
        self.topic
    }

    fn take(&mut self, to: Taker<'_>) -> Result<(), ProcessError> {
        while let Some(frame) = self.subscriber.receive()? {
            let header = frame.head().header();
            let number = Some((header.incarnation, header.sequence));
            if number <= self.number {
                continue;
            }
            self.number = number;
            self.bytes.clear();
            put_frame::<T>(frame.head(), frame.entries(), &mut self.bytes);
            to(self.topic, (header.incarnation, header.sequence), self.bytes.as_slice().into());
        }
        Ok(())
    }

    fn resubscribe(&mut self, member: &ProcessNode, to: Taker<'_>) -> Result<(), ProcessError> {
        // Both subscribers receive what is written in between, so the old one is drained first.
        let next = member.subscriber::<T>(self.topic.number())?;
        member.reserve_memory()?;
        self.take(to)?;
        self.drops += self.subscriber.drops();
        self.subscriber = next;
        Ok(())
    }

    fn drops(&self) -> u64 {
        self.drops + self.subscriber.drops()
    }
}

/// A published topic whose writer runs on the other machine.
trait TopicWriter {
    fn publish_frame(&mut self, bytes: &[u8]) -> Result<bool, ProcessError>;
    fn has_new_subscribers(&mut self) -> bool;
    fn undelivered(&self) -> u64;
}

impl<T: TopicPorts> TopicWriter for FramePublisher<T> {
    fn publish_frame(&mut self, bytes: &[u8]) -> Result<bool, ProcessError> {
        let Some((head, entries)) = get_frame::<T>(bytes) else { return Ok(false) };
        if entries.len() > self.capacity() {
            return Ok(false);
        }
        // The frame keeps its writer's sequence number, incarnation and stamps.
        self.send_all(head, &entries, |sent| *sent.header_mut() = *head.header())?;
        Ok(true)
    }

    fn has_new_subscribers(&mut self) -> bool {
        Self::has_new_subscribers(self)
    }

    fn undelivered(&self) -> u64 {
        Self::undelivered(self)
    }
}

/// The topics read on this machine.
pub(crate) struct TopicReaders(Vec<Box<dyn TopicReader>>);

impl TopicReaders {
    pub(crate) fn open(member: &ProcessNode, topics: &[TopicId]) -> Result<Self, ProcessError> {
        fn tap<T: TopicPorts>(
            member: &ProcessNode,
            topic: TopicId,
        ) -> Result<Box<dyn TopicReader>, ProcessError> {
            let subscriber = member.subscriber::<T>(topic.number())?;
            Ok(Box::new(Read { topic, subscriber, bytes: Vec::new(), number: None, drops: 0 }))
        }
        let open = |&topic: &TopicId| with_topic!(topic, T => tap::<T>(member, topic));
        Ok(Self(topics.iter().map(open).collect::<Result<_, _>>()?))
    }

    /// Reads all pending frames.
    pub(crate) fn take(&mut self, to: Taker<'_>) -> Result<(), ProcessError> {
        self.0.iter_mut().try_for_each(|tap| tap.take(to))
    }

    /// Subscribes again to the latched topics, so that their writers replay to new subscribers.
    pub(crate) fn resubscribe(&mut self, member: &ProcessNode, to: Taker<'_>) -> Result<(), ProcessError> {
        let mut latched = self.0.iter_mut().filter(|tap| is_latched(tap.topic()));
        latched.try_for_each(|tap| tap.resubscribe(member, to))
    }

    pub(crate) fn drops(&self) -> u64 {
        self.0.iter().map(|tap| tap.drops()).sum()
    }
}

/// The topics published on this machine.
#[derive(Default)]
pub(crate) struct TopicWriters(BTreeMap<TopicId, Box<dyn TopicWriter>>);

impl TopicWriters {
    pub(crate) fn open(
        member: &ProcessNode,
        topics: &[TopicId],
        robot: &Robot,
    ) -> Result<Self, ProcessError> {
        fn spring<T: TopicPorts>(
            member: &ProcessNode,
            topic: TopicId,
            capacity: usize,
        ) -> Result<Box<dyn TopicWriter>, ProcessError> {
            Ok(Box::new(member.publisher::<T>(topic.number(), capacity)?))
        }
        let (objects, joints) = (robot.leo.buffers.max_objects.get(), robot.motor.joints.len());
        let open = |&topic: &TopicId| {
            let capacity = topic.row().capacity.entries(objects, joints);
            Ok((topic, with_topic!(topic, T => spring::<T>(member, topic, capacity))?))
        };
        Ok(Self(topics.iter().map(open).collect::<Result<_, ProcessError>>()?))
    }

    /// Publishes a frame; `false` if the topic is not published here or the frame does not fit.
    pub(crate) fn publish_frame(&mut self, topic: TopicId, bytes: &[u8]) -> Result<bool, ProcessError> {
        self.0.get_mut(&topic).map_or(Ok(false), |spring| spring.publish_frame(bytes))
    }

    /// Whether a latched topic has a new local subscriber.
    pub(crate) fn has_new_subscribers(&mut self) -> bool {
        let latched = self.0.iter_mut().filter(|(topic, _)| is_latched(**topic));
        latched.fold(false, |any, (_, spring)| spring.has_new_subscribers() || any)
    }

    pub(crate) fn undelivered(&self) -> u64 {
        self.0.values().map(|spring| spring.undelivered()).sum()
    }
}
