use message::{Numbering, TopicId, with_topic};
use transport::{FrameSubscriber, Node, PortError, ReceiveError, TopicPorts};

use crate::Frame;
use crate::channel::{is_recorded, recorded_topics};

/// The subscribers of all recorded topics.
pub struct BufferSubscribers(Vec<Box<dyn Source>>);

/// A type-erased subscriber of one topic.
trait Source {
    fn topic(&self) -> TopicId;
    /// Takes all pending frames in order.
    fn take(&mut self, to: &mut dyn FnMut(Frame)) -> Result<(), ReceiveError>;
    /// Frames lost because they were not taken in time.
    fn drops(&self) -> u64;
}

struct BufferSubscriber<T: TopicPorts> {
    topic: TopicId,
    subscriber: FrameSubscriber<T>,
}

impl<T: TopicPorts> Source for BufferSubscriber<T> {
    fn topic(&self) -> TopicId {
        self.topic
    }

    fn take(&mut self, to: &mut dyn FnMut(Frame)) -> Result<(), ReceiveError> {
        while let Some(frame) = self.subscriber.receive()? {
            to(Frame::of::<T>(self.topic, frame.head(), frame.entries()));
        }
        Ok(())
    }

    fn drops(&self) -> u64 {
        self.subscriber.drops()
    }
}

/// How a subscriber is opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OpenMode {
    /// Before its publisher exists, with the queue size of the node.
    Make,
    /// On a running robot, if the topic exists.
    Find,
}

impl BufferSubscribers {
    /// Opens topics before the robot's processes do.
    ///
    /// # Errors
    ///
    /// Shared memory is full.
    pub fn make(node: &Node, topics: impl IntoIterator<Item = TopicId>) -> Result<Self, PortError> {
        let mut subscribers = Self(Vec::new());
        for topic in topics {
            subscribers.open(node, topic, OpenMode::Make)?;
        }
        Ok(subscribers)
    }

    /// No subscribers yet, for a running robot: see [`Self::find`].
    #[must_use]
    pub fn none() -> Self {
        Self(Vec::new())
    }

    /// Opens the topics of a running robot that exist and are not open yet.
    ///
    /// # Errors
    ///
    /// A topic has too many subscribers already, or another frame layout than this program's.
    pub fn find(&mut self, node: &Node) -> Result<(), PortError> {
        for topic in recorded_topics(0) {
            self.open(node, topic, OpenMode::Find)?;
        }
        for perspective in 0.. {
            let mut is_open = false;
            for topic in TopicId::one_of_each(0).into_iter().filter(|topic| is_recorded(*topic)) {
                let Some((Numbering::Perspective, first)) = topic.numbering() else { continue };
                let Some(topic) = TopicId::of_link_code(topic.row().code, first + perspective) else {
                    continue;
                };
                is_open |= self.open(node, topic, OpenMode::Find)?;
            }
            if !is_open {
                break;
            }
        }
        Ok(())
    }

    /// Opens a topic. Returns whether it is open now.
    fn open(&mut self, node: &Node, topic: TopicId, how: OpenMode) -> Result<bool, PortError> {
        if self.0.iter().any(|source| source.topic() == topic) {
            return Ok(true);
        }
        let source = with_topic!(topic, T => tap::<T>(node, topic, how))?;
        let is_open = source.is_some();
        self.0.extend(source);
        Ok(is_open)
    }

    /// Takes all pending frames: topic by topic, in the order in which they were opened.
    ///
    /// # Errors
    ///
    /// The middleware failed.
    pub fn take(&mut self, mut to: impl FnMut(Frame)) -> Result<(), ReceiveError> {
        self.0.iter_mut().try_for_each(|source| source.take(&mut to))
    }

    /// Number of frames of each topic that were lost because they were not taken in time.
    pub fn drops(&self) -> impl Iterator<Item = (TopicId, u64)> + '_ {
        self.0.iter().map(|source| (source.topic(), source.drops()))
    }
}

impl std::fmt::Debug for BufferSubscribers {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_list().entries(self.0.iter().map(|source| source.topic())).finish()
    }
}

/// Opens the subscriber of a topic; `None` if it does not exist yet.
fn tap<T: TopicPorts>(
    node: &Node,
    topic: TopicId,
    how: OpenMode,
) -> Result<Option<Box<dyn Source>>, PortError> {
    let subscriber = match how {
        OpenMode::Make => Some(node.subscriber::<T>(topic.number())?),
        OpenMode::Find => node.existing_subscriber::<T>(topic.number())?,
    };
    Ok(subscriber.map(|subscriber| Box::new(BufferSubscriber { topic, subscriber }) as Box<dyn Source>))
}
