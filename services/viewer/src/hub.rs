//! The clients of the server, and what each is to receive.

use std::collections::BTreeMap;

use message::TopicId;
use recording::ViewerMessage;

use crate::channels::{Channels, Novelty, Stamped};
use crate::outbox::Outbox;
use crate::protocol::{ClientMessage, Outgoing, Subscription, advertise, message_data, server_info, warning};

/// Maximum number of clients.
pub const MAX_CLIENTS: usize = 16;
/// Minimum interval between two times that are sent, in nanoseconds.
const MIN_TIME_INTERVAL_NS: u64 = 20_000_000;

/// The number of a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ClientId(u64);

/// Counters from the beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Number of clients, those that left included.
    pub clients: u64,
    /// Number of messages of channels that were sent.
    pub sent: u64,
    /// Number of messages of channels that were dropped, because a client read too slowly.
    pub dropped: u64,
}

/// The channels of a robot and the queues of the clients.
///
/// No clock, and no input or output: time is taken from the messages.
#[derive(Debug)]
pub struct Hub {
    session: String,
    channels: Channels,
    clients: BTreeMap<ClientId, Client>,
    time_ns: u64,
    /// The counters, without the dropped messages of the present clients.
    totals: Totals,
}

#[derive(Debug, Default)]
struct Client {
    outbox: Outbox,
    /// The numbers of its subscriptions, by channel.
    subscriptions: BTreeMap<u32, u32>,
}

impl Hub {
    /// A hub without clients. `session` is a name that no earlier hub had.
    #[must_use]
    pub fn new(session: String) -> Self {
        Self {
            session,
            channels: Channels::default(),
            clients: BTreeMap::new(),
            time_ns: 0,
            totals: Totals::default(),
        }
    }

    /// Queues messages for the clients that subscribed to their channels. `from` is the topic of the frame that they were
    /// made of, and `at_ns` its instant.
    pub fn publish(&mut self, from: TopicId, at_ns: u64, messages: Vec<ViewerMessage>) {
        for message in messages {
            let (id, novelty) = self.channels.id_of(&message);
            if let (Novelty::New, Some(channel)) = (novelty, self.channels.get(id)) {
                let news = advertise([(id, channel)]);
                self.clients.values_mut().for_each(|client| client.outbox.control(news.clone()));
            }
            let message = Stamped { at_ns, bytes: message.bytes.into() };
            for client in self.clients.values_mut() {
                if let Some(subscription) = client.subscriptions.get(&id) {
                    client.outbox.message(*subscription, message.clone());
                }
            }
            self.channels.keep(id, from, message);
        }
        // Frames of several topics come in any order. A time that goes back would make viewers discard what they show.
        if at_ns >= self.time_ns.saturating_add(MIN_TIME_INTERVAL_NS) {
            self.time_ns = at_ns;
            self.clients.values_mut().for_each(|client| client.outbox.time(at_ns));
        }
    }

    /// Adds a client, which receives the description of every channel; `None` if there are [`MAX_CLIENTS`].
    pub fn join(&mut self) -> Option<ClientId> {
        if self.clients.len() >= MAX_CLIENTS {
            return None;
        }
        self.totals.clients += 1;
        let id = ClientId(self.totals.clients);
        let mut client = Client::default();
        client.outbox.control(server_info(&self.session));
        client.outbox.control(advertise(self.channels.iter()));
        client.outbox.time(self.time_ns);
        self.clients.insert(id, client);
        Some(id)
    }

    /// Handles a text of a client.
    pub fn hear(&mut self, id: ClientId, text: &str) {
        let Some(client) = self.clients.get_mut(&id) else { return };
        match serde_json::from_str(text) {
            Ok(ClientMessage::Subscribe { subscriptions }) => {
                subscriptions.into_iter().for_each(|one| client.subscribe(one, &self.channels));
            }
            Ok(ClientMessage::Unsubscribe { subscription_ids }) => {
                subscription_ids.into_iter().for_each(|subscription| client.unsubscribe(subscription));
            }
            Ok(ClientMessage::Unsupported) => self.hear_unsupported(id),
            Err(error) => client.outbox.control(warning(&format!("this message is not understood: {error}"))),
        }
    }

    /// Answers a message that only publishers of other programs understand.
    pub fn hear_unsupported(&mut self, id: ClientId) {
        if let Some(client) = self.clients.get_mut(&id) {
            client.outbox.control(warning("leo view only sends messages of the robot: it takes no commands"));
        }
    }

    /// Whether a client must take something before its next message is read.
    #[must_use]
    pub fn must_take(&self, id: ClientId) -> bool {
        self.clients.get(&id).is_some_and(|client| client.outbox.has_control())
    }

    /// The next message for a client, if any.
    pub fn next(&mut self, id: ClientId) -> Option<Outgoing> {
        let (message, is_of_channel) = self.clients.get_mut(&id)?.outbox.next()?;
        self.totals.sent += u64::from(is_of_channel);
        Some(message)
    }

    /// Removes a client.
    pub fn leave(&mut self, id: ClientId) {
        if let Some(client) = self.clients.remove(&id) {
            self.totals.dropped += client.outbox.dropped();
        }
    }

    /// The counters so far.
    #[must_use]
    pub fn totals(&self) -> Totals {
        let dropped: u64 = self.clients.values().map(|client| client.outbox.dropped()).sum();
        Totals { dropped: self.totals.dropped + dropped, ..self.totals }
    }
}

impl Client {
    /// Subscribes to a channel, and queues its latest messages.
    fn subscribe(&mut self, Subscription { id, channel_id }: Subscription, channels: &Channels) {
        let Some(channel) = channels.get(channel_id) else {
            self.outbox.control(warning(&format!("there is no channel {channel_id}")));
            return;
        };
        // One subscription of each channel bounds their number.
        if self.subscriptions.contains_key(&channel_id) || self.subscriptions.values().any(|used| *used == id)
        {
            let reason = format!("subscription {id} or another one of channel {channel_id} exists already");
            self.outbox.control(warning(&reason));
            return;
        }
        self.subscriptions.insert(channel_id, id);
        for Stamped { at_ns, bytes } in channel.latest() {
            self.outbox.control(message_data(id, *at_ns, bytes));
        }
    }

    fn unsubscribe(&mut self, subscription: u32) {
        self.subscriptions.retain(|_, id| *id != subscription);
        self.outbox.unsubscribe(subscription);
    }
}

#[cfg(test)]
mod tests;
