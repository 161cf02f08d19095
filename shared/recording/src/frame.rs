use message::{Bytes as _, Head as _, Header, Topic, TopicId, get_frame, put_frame};

/// A frame of a topic, byte by byte as in shared memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// The topic.
    pub topic: TopicId,
    /// The instant that it is valid at, in nanoseconds of the monotonic clock or of simulated time.
    pub at_ns: u64,
    /// Its sequence number.
    pub sequence: u64,
    /// Its head, then its entries.
    pub bytes: Vec<u8>,
}

impl Frame {
    /// Makes a frame of a head and entries. `topic` must belong to `T`.
    #[must_use]
    pub fn of<T: Topic>(topic: TopicId, head: &T::Head, entries: &[T::Entry]) -> Self {
        let Header { valid_at_ns, sequence, .. } = *head.header();
        let mut bytes = Vec::new();
        put_frame::<T>(head, entries, &mut bytes);
        Self { topic, at_ns: valid_at_ns, sequence, bytes }
    }

    /// Decodes head and entries; `None` if the bytes do not fit the topic's layout.
    #[must_use]
    pub fn read<T: Topic>(&self) -> Option<(T::Head, Vec<T::Entry>)> {
        get_frame::<T>(&self.bytes)
    }

    /// Its header: every head begins with one.
    #[must_use]
    pub fn header(&self) -> Header {
        Header::get(&self.bytes)
    }
}
