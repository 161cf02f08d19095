//! The live protocol of Foxglove: the messages of the server, and those of its clients that it understands.

use serde::Deserialize;
use serde_json::{Value, json};

use crate::channels::Channel;

/// The subprotocols of the WebSocket, the newest first. Both have the same messages. Clients that are older than the
/// software development kit offer only the second.
pub(crate) const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// Marks a message of a channel.
const MESSAGE_DATA: u8 = 1;
/// Marks the present time of the robot.
const TIME: u8 = 2;
/// The level of a warning in a status message.
const WARNING: u8 = 1;

/// A message to a client.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outgoing {
    /// JSON.
    Text(String),
    /// A message of a channel, or the time.
    Binary(Vec<u8>),
}

/// The first message to a client. `session` differs between two servers, so that a client that reconnects knows whether
/// it meets the same one.
pub(crate) fn server_info(session: &str) -> Outgoing {
    text(&json!({
        "op": "serverInfo",
        "name": "Leo",
        // The time stamps are those of the robot's monotonic clock, which the computer of the viewer does not have.
        "capabilities": ["time"],
        "supportedEncodings": [],
        "metadata": {},
        "sessionId": session,
    }))
}

/// Announces channels with their schemas.
pub(crate) fn advertise<'a>(channels: impl IntoIterator<Item = (u32, &'a Channel)>) -> Outgoing {
    let channels: Vec<Value> = channels.into_iter().map(|(id, channel)| channel.described(id)).collect();
    text(&json!({ "op": "advertise", "channels": channels }))
}

/// A warning that viewers show to the user.
pub(crate) fn warning(message: &str) -> Outgoing {
    text(&json!({ "op": "status", "level": WARNING, "message": message }))
}

fn text(value: &Value) -> Outgoing {
    Outgoing::Text(value.to_string())
}

/// A message of a channel, for the subscription of a client.
pub(crate) fn message_data(subscription: u32, at_ns: u64, bytes: &[u8]) -> Outgoing {
    let head = [&[MESSAGE_DATA][..], &subscription.to_le_bytes(), &at_ns.to_le_bytes()].concat();
    Outgoing::Binary([&head, bytes].concat())
}

/// The present time of the robot.
pub(crate) fn time(at_ns: u64) -> Outgoing {
    Outgoing::Binary([&[TIME][..], &at_ns.to_le_bytes()].concat())
}

/// A message of a client.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq)]
#[serde(tag = "op", rename_all = "camelCase")]
pub(crate) enum ClientMessage {
    /// It wants the messages of channels.
    Subscribe { subscriptions: Vec<Subscription> },
    /// It no longer wants them.
    #[serde(rename_all = "camelCase")]
    Unsubscribe { subscription_ids: Vec<u32> },
    /// Anything else: publishing, parameters and services need capabilities that the server does not announce.
    #[serde(other)]
    Unsupported,
}

/// A subscription of a client; the client chooses its number.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Subscription {
    pub(crate) id: u32,
    pub(crate) channel_id: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_clients_are_parsed_and_unknown_ones_are_recognized() {
        let parsed = |text: &str| serde_json::from_str::<ClientMessage>(text);
        assert_eq!(
            parsed(r#"{"op":"subscribe","subscriptions":[{"id":0,"channelId":3}]}"#).unwrap(),
            ClientMessage::Subscribe { subscriptions: vec![Subscription { id: 0, channel_id: 3 }] }
        );
        assert_eq!(
            parsed(r#"{"op":"unsubscribe","subscriptionIds":[7]}"#).unwrap(),
            ClientMessage::Unsubscribe { subscription_ids: vec![7] }
        );
        assert_eq!(
            parsed(r#"{"op":"getParameters","parameterNames":[]}"#).unwrap(),
            ClientMessage::Unsupported
        );
        for nonsense in
            ["", "[]", "{}", r#"{"op":"subscribe"}"#, r#"{"op":"unsubscribe","subscriptionIds":[-1]}"#]
        {
            assert!(parsed(nonsense).is_err(), "{nonsense}");
        }
    }

    #[test]
    fn binary_messages_are_little_endian() {
        let Outgoing::Binary(bytes) = message_data(0x0102, 0x0304, &[9, 8]) else { panic!("is binary") };
        assert_eq!(bytes, [1, 2, 1, 0, 0, 4, 3, 0, 0, 0, 0, 0, 0, 9, 8]);
        assert_eq!(time(5), Outgoing::Binary(vec![2, 5, 0, 0, 0, 0, 0, 0, 0]));
    }
}
