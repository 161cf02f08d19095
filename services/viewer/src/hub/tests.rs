use recording::Schema;
use serde_json::Value;

use super::*;

const TEXT: Schema = Schema { name: "std_msgs/msg/String", text: "string data" };

fn message(topic: &str, bytes: &[u8]) -> Vec<ViewerMessage> {
    vec![ViewerMessage { topic: topic.to_owned(), schema: TEXT, bytes: bytes.to_vec() }]
}

/// All that waits for a client.
fn taken(hub: &mut Hub, id: ClientId) -> Vec<Outgoing> {
    std::iter::from_fn(|| hub.next(id)).collect()
}

/// The texts among them.
fn texts(messages: &[Outgoing]) -> Vec<Value> {
    let parsed = |message: &Outgoing| match message {
        Outgoing::Text(text) => serde_json::from_str(text).ok(),
        Outgoing::Binary(_) => None,
    };
    messages.iter().filter_map(parsed).collect()
}

fn data(messages: &[Outgoing]) -> Vec<&Outgoing> {
    messages.iter().filter(|message| matches!(message, Outgoing::Binary(bytes) if bytes[0] == 1)).collect()
}

#[test]
fn a_late_client_receives_every_channel_and_its_latest_messages() {
    let mut hub = Hub::new("now".to_owned());
    hub.publish(TopicId::Scene, 1, message("/robot_description", b"urdf"));
    hub.publish(TopicId::Scene, 2, message("/tf", b"old"));
    hub.publish(TopicId::Scene, 3, message("/tf", b"objects"));
    hub.publish(TopicId::JointStates, 4, message("/tf", b"body"));
    let late = hub.join().unwrap();
    let first = texts(&taken(&mut hub, late));
    assert_eq!((&first[0]["op"], &first[0]["sessionId"]), (&"serverInfo".into(), &"now".into()));
    let channels = first[1]["channels"].as_array().unwrap();
    let topics: Vec<&str> = channels.iter().map(|channel| channel["topic"].as_str().unwrap()).collect();
    assert_eq!(topics, ["/robot_description", "/tf"]);
    assert_eq!(
        (&channels[0]["schema"], &channels[0]["schemaEncoding"], &channels[0]["encoding"]),
        (&TEXT.text.into(), &"ros2msg".into(), &"cdr".into())
    );

    hub.hear(late, r#"{"op":"subscribe","subscriptions":[{"id":8,"channelId":1},{"id":9,"channelId":2}]}"#);
    let latest = taken(&mut hub, late);
    assert_eq!(latest.len(), 3);
    let expected = [message_data(8, 1, b"urdf"), message_data(9, 4, b"body"), message_data(9, 3, b"objects")];
    for message in expected {
        assert!(latest.contains(&message), "{message:?} of {latest:?}");
    }
    hub.publish(TopicId::Scene, 5, message("/tf", b"new"));
    assert_eq!(taken(&mut hub, late), [message_data(9, 5, b"new")]);
    assert_eq!(hub.totals(), Totals { clients: 1, sent: 1, dropped: 0 });
}

#[test]
fn a_channel_that_appears_later_is_announced_to_present_clients() {
    let mut hub = Hub::new(String::new());
    let client = hub.join().unwrap();
    assert_eq!(texts(&taken(&mut hub, client))[1]["channels"], Value::Array(Vec::new()));
    hub.publish(TopicId::Events, 1, message("/log", b"a"));
    let news = taken(&mut hub, client);
    assert_eq!(texts(&news)[0]["channels"][0]["topic"], "/log");
    // Without a subscription nothing of it is sent, and after one each message once.
    assert!(data(&news).is_empty());
    hub.hear(client, r#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":1}]}"#);
    assert_eq!(taken(&mut hub, client), [message_data(1, 1, b"a")]);
    hub.publish(TopicId::Events, 2, message("/log", b"b"));
    hub.hear(client, r#"{"op":"unsubscribe","subscriptionIds":[1]}"#);
    hub.publish(TopicId::Events, 3, message("/log", b"c"));
    assert!(taken(&mut hub, client).is_empty());
}

#[test]
fn the_time_never_goes_back() {
    let mut hub = Hub::new(String::new());
    let client = hub.join().unwrap();
    taken(&mut hub, client);
    let mut times = Vec::new();
    for at_ns in [100, 105, 90, 121, 119, 141].map(|ms| ms * 1_000_000) {
        hub.publish(TopicId::Events, at_ns, Vec::new());
        times.extend(taken(&mut hub, client));
    }
    assert_eq!(times, [100, 121, 141].map(|ms| crate::protocol::time(ms * 1_000_000)));
}

#[test]
fn requests_that_cannot_be_served_are_answered_by_a_warning() {
    let mut hub = Hub::new(String::new());
    hub.publish(TopicId::Events, 1, message("/log", b"a"));
    let client = hub.join().unwrap();
    taken(&mut hub, client);
    let mut warnings = Vec::new();
    for request in [
        r#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":1}]}"#,
        r#"{"op":"subscribe","subscriptions":[{"id":2,"channelId":1}]}"#,
        r#"{"op":"subscribe","subscriptions":[{"id":3,"channelId":7}]}"#,
        r#"{"op":"setParameters","parameters":[]}"#,
        "nonsense",
    ] {
        hub.hear(client, request);
        // A client takes the answers before its next request is read.
        assert!(hub.must_take(client));
        for answer in texts(&taken(&mut hub, client)) {
            assert_eq!((&answer["op"], &answer["level"]), (&"status".into(), &1.into()));
            warnings.push(answer["message"].as_str().unwrap().to_owned());
        }
    }
    insta::assert_snapshot!(warnings.join("\n"));
}

#[test]
fn clients_beyond_the_maximum_are_refused_until_one_leaves() {
    let mut hub = Hub::new(String::new());
    let clients: Vec<ClientId> = (0..MAX_CLIENTS).map(|_| hub.join().unwrap()).collect();
    assert_eq!(hub.join(), None);
    hub.leave(clients[3]);
    assert!(hub.join().is_some());
    assert_eq!(hub.totals().clients, 17);
}
