// Subscribes to every channel of a server, and prints what it receives as one JSON value a line.
//
//     node client.mjs ws://127.0.0.1:8765 foxglove.sdk.v1
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import protocol from "@foxglove/ws-protocol";
import WebSocket from "ws";

const [url, subprotocol] = process.argv.slice(2);
const client = new protocol.FoxgloveClient({ ws: new WebSocket(url, [subprotocol]) });
// The channel and the reader of each subscription.
const subscriptions = new Map();

const print = (value) => process.stdout.write(JSON.stringify(value) + "\n");
const nanos = ({ sec, nanosec }) => sec * 1e9 + nanosec;
const xyz = ({ x, y, z }) => [x, y, z];

/** The part of a message that the tests compare. */
function digest(topic, message) {
  switch (topic) {
    case "/robot_description":
      return message.data;
    case "/tf":
      return message.transforms.map(({ header, child_frame_id, transform }) => ({
        parent: header.frame_id,
        child: child_frame_id,
        at_ns: nanos(header.stamp),
        position_m: xyz(transform.translation),
      }));
    case "/joint_states":
      return message.name.length;
    case "/log":
      return message.msg;
    default:
      return message.markers.length;
  }
}

client.on("serverInfo", ({ name, capabilities }) => print({ name, capabilities }));
client.on("status", ({ message }) => print({ status: message }));
client.on("error", (error) => print({ error: String(error) }));
client.on("close", ({ code, reason }) => print({ closed: code, reason }));
client.on("advertise", (channels) => {
  for (const channel of channels) {
    const { topic, encoding, schemaName, schemaEncoding, schema } = channel;
    print({ advertised: topic, encoding, schemaName, schemaEncoding });
    const reader = new MessageReader(parse(schema, { ros2: true }));
    subscriptions.set(client.subscribe(channel.id), { topic, reader });
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const { topic, reader } = subscriptions.get(subscriptionId);
  print({ topic, at_ns: Number(timestamp), value: digest(topic, reader.readMessage(data)) });
});
client.on("time", ({ timestamp }) => print({ time_ns: Number(timestamp) }));
