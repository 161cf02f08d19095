use message::{Bytes, Topic};
use transport::{FrameSubscriber, Node, PortError, ReceiveError};

use crate::buffer::with_topic;
use crate::{Buffer, Frame};

/// The subscribers of all recorded buffers.
pub struct BufferSubscribers(Vec<Box<dyn Source>>);

/// A type-erased subscriber of one buffer.
trait Source {
    fn buffer(&self) -> Buffer;
    /// Takes all pending frames in order.
    fn take(&mut self, to: &mut dyn FnMut(Frame)) -> Result<(), ReceiveError>;
    /// Frames lost because they were not taken in time.
    fn drops(&self) -> u64;
}

struct BufferSubscriber<T: Topic> {
    buffer: Buffer,
    subscriber: FrameSubscriber<T>,
}

impl<T: Topic<Head: Bytes, Entry: Bytes>> Source for BufferSubscriber<T> {
    fn buffer(&self) -> Buffer {
        self.buffer
    }

    fn take(&mut self, to: &mut dyn FnMut(Frame)) -> Result<(), ReceiveError> {
        while let Some(frame) = self.subscriber.receive()? {
            to(Frame::of::<T>(self.buffer, frame.head(), frame.entries()));
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
    /// Opens buffers before the robot's processes do.
    ///
    /// # Errors
    ///
    /// Shared memory is full.
    pub fn make(node: &Node, buffers: impl IntoIterator<Item = Buffer>) -> Result<Self, PortError> {
        let mut subscribers = Self(Vec::new());
        for buffer in buffers {
            subscribers.open(node, buffer, OpenMode::Make)?;
        }
        Ok(subscribers)
    }

    /// No subscribers yet, for a running robot: see [`Self::find`].
    #[must_use]
    pub fn none() -> Self {
        Self(Vec::new())
    }

    /// Opens the buffers of a running robot that exist and are not open yet.
    ///
    /// # Errors
    ///
    /// A buffer has too many subscribers already, or another frame layout than this program's.
    pub fn find(&mut self, node: &Node) -> Result<(), PortError> {
        for buffer in Buffer::all(0) {
            self.open(node, buffer, OpenMode::Find)?;
        }
        let mut perspective = 0;
        while self.open(node, Buffer::Beliefs(perspective), OpenMode::Find)? {
            perspective += 1;
            self.open(node, Buffer::Divergences(perspective), OpenMode::Find)?;
        }
        Ok(())
    }

    /// Opens a buffer. Returns whether it is open now.
    fn open(&mut self, node: &Node, buffer: Buffer, how: OpenMode) -> Result<bool, PortError> {
        if self.0.iter().any(|source| source.buffer() == buffer) {
            return Ok(true);
        }
        let tap = with_topic!(buffer, T => tap::<T>(node, buffer, how))?;
        let is_open = tap.is_some();
        self.0.extend(tap);
        Ok(is_open)
    }

    /// Takes all pending frames: buffer by buffer, in the order in which they were opened.
    ///
    /// # Errors
    ///
    /// The middleware failed.
    pub fn take(&mut self, mut to: impl FnMut(Frame)) -> Result<(), ReceiveError> {
        self.0.iter_mut().try_for_each(|source| source.take(&mut to))
    }

    /// Number of frames of each buffer that were lost because they were not taken in time.
    pub fn drops(&self) -> impl Iterator<Item = (Buffer, u64)> + '_ {
        self.0.iter().map(|source| (source.buffer(), source.drops()))
    }
}

impl std::fmt::Debug for BufferSubscribers {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_list().entries(self.0.iter().map(|source| source.buffer())).finish()
    }
}

fn tap<T: Topic<Head: Bytes, Entry: Bytes> + 'static>(
    node: &Node,
    buffer: Buffer,
    how: OpenMode,
) -> Result<Option<Box<dyn Source>>, PortError> {
    let (_, number) = buffer.name();
    let subscriber = match how {
        OpenMode::Make => Some(node.subscriber::<T>(number)?),
        OpenMode::Find => node.existing_subscriber::<T>(number)?,
    };
    Ok(subscriber.map(|subscriber| Box::new(BufferSubscriber { buffer, subscriber }) as Box<dyn Source>))
}
