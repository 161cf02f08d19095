//! Access to this machine's topics as bytes.

use std::collections::BTreeMap;
use std::sync::Arc;

use config::Robot;
use message::{
    ActsAnswered, Beliefs, Bytes, Divergences, Events, Head as _, JointGoals, JointStates, Percepts, Scene,
    TeacherActs, Topic, Utterances, get_frame, put_frame,
};
use process::{Failure, ProcessNode};
use transport::{FramePublisher, FrameSubscriber};

use crate::Stream;
use crate::outbox::Place;

/// Callback for a frame that was read.
type Taker<'a> = &'a mut dyn FnMut(Stream, Place, Arc<[u8]>);

/// A subscribed topic.
trait TopicReader {
    fn stream(&self) -> Stream;
    fn take(&mut self, to: Taker<'_>) -> Result<(), Failure>;
    /// Subscribes again, so that the writer sees a new subscriber. No frame is lost or read twice.
    fn resubscribe(&mut self, member: &ProcessNode, to: Taker<'_>) -> Result<(), Failure>;
    fn drops(&self) -> u64;
}

struct Read<T: Topic> {
    stream: Stream,
    subscriber: FrameSubscriber<T>,
    bytes: Vec<u8>,
    /// The last frame read.
    place: Option<Place>,
    /// Frames dropped by earlier subscribers.
    drops: u64,
}

impl<T: Topic<Head: Bytes, Entry: Bytes>> TopicReader for Read<T> {
    fn stream(&self) -> Stream {
        self.stream
    }

    fn take(&mut self, to: Taker<'_>) -> Result<(), Failure> {
        while let Some(frame) = self.subscriber.receive()? {
            let header = frame.head().header();
            let place = Some((header.incarnation, header.sequence));
            if place <= self.place {
                continue;
            }
            self.place = place;
            self.bytes.clear();
            put_frame::<T>(frame.head(), frame.entries(), &mut self.bytes);
            to(self.stream, (header.incarnation, header.sequence), self.bytes.as_slice().into());
        }
        Ok(())
    }

    fn resubscribe(&mut self, member: &ProcessNode, to: Taker<'_>) -> Result<(), Failure> {
        // Both subscribers receive what is written in between, so the old one is drained first.
        let next = member.subscriber::<T>(self.stream.name().1)?;
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
    fn publish_frame(&mut self, bytes: &[u8]) -> Result<bool, Failure>;
    fn has_new_subscribers(&mut self) -> bool;
    fn undelivered(&self) -> u64;
}

impl<T: Topic<Head: Bytes, Entry: Bytes>> TopicWriter for FramePublisher<T> {
    fn publish_frame(&mut self, bytes: &[u8]) -> Result<bool, Failure> {
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
    pub(crate) fn open(member: &ProcessNode, streams: &[Stream]) -> Result<Self, Failure> {
        fn tap<T: Topic<Head: Bytes, Entry: Bytes> + 'static>(
            member: &ProcessNode,
            stream: Stream,
        ) -> Result<Box<dyn TopicReader>, Failure> {
            let subscriber = member.subscriber::<T>(stream.name().1)?;
            Ok(Box::new(Read { stream, subscriber, bytes: Vec::new(), place: None, drops: 0 }))
        }
        let open = |&stream: &Stream| match stream {
            Stream::Percepts => tap::<Percepts>(member, stream),
            Stream::Beliefs(_) => tap::<Beliefs>(member, stream),
            Stream::Divergences(_) => tap::<Divergences>(member, stream),
            Stream::JointStates => tap::<JointStates>(member, stream),
            Stream::Scene => tap::<Scene>(member, stream),
            Stream::JointGoals => tap::<JointGoals>(member, stream),
            Stream::TeacherActs => tap::<TeacherActs>(member, stream),
            Stream::ActsAnswered => tap::<ActsAnswered>(member, stream),
            Stream::Utterances => tap::<Utterances>(member, stream),
            Stream::Events => tap::<Events>(member, stream),
        };
        Ok(Self(streams.iter().map(open).collect::<Result<_, _>>()?))
    }

    /// Reads all pending frames.
    pub(crate) fn take(&mut self, to: Taker<'_>) -> Result<(), Failure> {
        self.0.iter_mut().try_for_each(|tap| tap.take(to))
    }

    /// Subscribes again to the latched topic, so that its writer replays to new subscribers.
    pub(crate) fn resubscribe(&mut self, member: &ProcessNode, to: Taker<'_>) -> Result<(), Failure> {
        let retold = self.0.iter_mut().find(|tap| tap.stream() == Stream::LATCHED);
        retold.map_or(Ok(()), |tap| tap.resubscribe(member, to))
    }

    pub(crate) fn drops(&self) -> u64 {
        self.0.iter().map(|tap| tap.drops()).sum()
    }
}

/// The topics published on this machine.
#[derive(Default)]
pub(crate) struct TopicWriters(BTreeMap<Stream, Box<dyn TopicWriter>>);

impl TopicWriters {
    pub(crate) fn open(member: &ProcessNode, streams: &[Stream], robot: &Robot) -> Result<Self, Failure> {
        fn spring<T: Topic<Head: Bytes, Entry: Bytes> + 'static>(
            member: &ProcessNode,
            stream: Stream,
            capacity: usize,
        ) -> Result<Box<dyn TopicWriter>, Failure> {
            Ok(Box::new(member.publisher::<T>(stream.name().1, capacity)?))
        }
        let (objects, joints) = (robot.leo.buffers.max_objects.get(), robot.motor.joints.len());
        let open = |&stream: &Stream| {
            let spring = match stream {
                Stream::Percepts => spring::<Percepts>(member, stream, objects),
                Stream::Beliefs(_) => spring::<Beliefs>(member, stream, objects),
                Stream::Divergences(_) => spring::<Divergences>(member, stream, 2 * objects),
                Stream::JointStates => spring::<JointStates>(member, stream, joints),
                Stream::Scene => spring::<Scene>(member, stream, objects),
                Stream::JointGoals => spring::<JointGoals>(member, stream, joints),
                Stream::TeacherActs => spring::<TeacherActs>(member, stream, WORDS),
                Stream::ActsAnswered => spring::<ActsAnswered>(member, stream, WORDS),
                Stream::Utterances => spring::<Utterances>(member, stream, WORDS),
                Stream::Events => spring::<Events>(member, stream, WORDS),
            };
            Ok((stream, spring?))
        };
        Ok(Self(streams.iter().map(open).collect::<Result<_, Failure>>()?))
    }

    /// Publishes a frame; `false` if the topic is not published here or the frame does not fit.
    pub(crate) fn publish_frame(&mut self, stream: Stream, bytes: &[u8]) -> Result<bool, Failure> {
        self.0.get_mut(&stream).map_or(Ok(false), |spring| spring.publish_frame(bytes))
    }

    /// Whether the latched topic has a new local subscriber.
    pub(crate) fn has_new_subscribers(&mut self) -> bool {
        self.0.get_mut(&Stream::LATCHED).is_some_and(|spring| spring.has_new_subscribers())
    }

    pub(crate) fn undelivered(&self) -> u64 {
        self.0.values().map(|spring| spring.undelivered()).sum()
    }
}

/// Capacity of a frame of commands, utterances or events, in entries.
const WORDS: usize = 64;
