//! The channels of a robot, and the latest messages of each.

use std::collections::BTreeMap;
use std::sync::Arc;

use message::TopicId;
use recording::{Schema, ViewerMessage};
use serde_json::{Value, json};

/// An encoded message with its time stamp. Clients share the bytes.
#[derive(Clone, Debug)]
pub(crate) struct Stamped {
    pub(crate) at_ns: u64,
    pub(crate) bytes: Arc<[u8]>,
}

/// A channel.
#[derive(Clone, Debug)]
pub(crate) struct Channel {
    topic: String,
    schema: Schema,
    /// The latest message from each topic of the robot: `/tf` has the body from one, and the objects from another.
    latest: BTreeMap<TopicId, Stamped>,
}

impl Channel {
    /// Its description for clients.
    pub(crate) fn described(&self, id: u32) -> Value {
        json!({
            "id": id,
            "topic": self.topic,
            "encoding": Schema::MESSAGE_ENCODING,
            "schemaName": self.schema.name,
            "schema": self.schema.text,
            "schemaEncoding": Schema::ENCODING,
        })
    }

    /// Its latest messages, which a client receives that subscribes late.
    pub(crate) fn latest(&self) -> impl Iterator<Item = &Stamped> {
        self.latest.values()
    }
}

/// All channels that had a message, by their numbers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Channels {
    by_id: BTreeMap<u32, Channel>,
    ids: BTreeMap<String, u32>,
}

impl Channels {
    /// The channel of a message, which is added if it is new.
    pub(crate) fn id_of(&mut self, message: &ViewerMessage) -> (u32, Novelty) {
        if let Some(id) = self.ids.get(&message.topic) {
            return (*id, Novelty::Known);
        }
        let id = self.by_id.last_key_value().map_or(1, |(last, _)| last.saturating_add(1));
        let topic = message.topic.clone();
        self.ids.insert(topic.clone(), id);
        self.by_id.insert(id, Channel { topic, schema: message.schema, latest: BTreeMap::new() });
        (id, Novelty::New)
    }

    /// Keeps a message as the latest one of its channel and of the topic that it comes from.
    pub(crate) fn keep(&mut self, id: u32, from: TopicId, message: Stamped) {
        if let Some(channel) = self.by_id.get_mut(&id) {
            channel.latest.insert(from, message);
        }
    }

    pub(crate) fn get(&self, id: u32) -> Option<&Channel> {
        self.by_id.get(&id)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (u32, &Channel)> {
        self.by_id.iter().map(|(id, channel)| (*id, channel))
    }
}

/// Whether a channel is new.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Novelty {
    New,
    Known,
}
