//! `leo view` with a real robot, and clients that are not ours. A process of its own, because a process joins one domain.
#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod npm;
#[path = "../supervision/robot.rs"]
#[expect(dead_code, reason = "other tests use the rest of it")]
mod robot;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{BufRead as _, BufReader};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use message::{Scene, SceneObject};
use rustix::process::Signal;
use serde_json::{Value, json};
use testkit::robot::Said;
use transport::{Domain, FrameSubscriber, Node, OverflowPolicy, Queues};
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Message, WebSocket};

use robot::{MAX_WAIT, Robot, domain, leo, signal, wait_until};

/// The channels of a robot with one partner.
const TOPICS: [&str; 7] =
    ["/beliefs/leo", "/beliefs/the_teacher", "/joint_states", "/log", "/robot_description", "/scene", "/tf"];

/// A running `leo view`; dropping it kills it.
struct View {
    child: Child,
    said: Said,
    url: String,
}

impl View {
    /// Starts it for a robot, and waits until it says where viewers connect.
    fn of(robot: &Robot, arguments: &[&str]) -> Self {
        let mut command = leo(&["view"]);
        command
            .args(arguments)
            .arg("--domain")
            .arg(robot.domain())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = command.spawn().expect("starts");
        let said = Said::default();
        said.listen(child.stdout.take().expect("piped"));
        said.listen(child.stderr.take().expect("piped"));
        assert!(wait_until(|| said.text().contains("Ctrl-C ends it")), "{}", said.text());
        let text = said.text();
        let url = text.split("and enter ").nth(1).and_then(|rest| rest.lines().next()).expect("an address");
        Self { child, said, url: url.to_owned() }
    }

    fn pid(&self) -> i32 {
        i32::try_from(self.child.id()).expect("a process number")
    }

    /// Number of its open file descriptors.
    fn descriptors(&self) -> usize {
        fs::read_dir(format!("/proc/{}/fd", self.pid())).map_or(0, Iterator::count)
    }

    /// Waits for its end. Returns its exit status, and what it said.
    fn end(mut self) -> (ExitStatus, String) {
        let mut status = None;
        let ended = wait_until(|| {
            status = self.child.try_wait().expect("is ours");
            status.is_some()
        });
        assert!(ended, "it does not end: {}", self.said.text());
        // The threads that read its output may be behind.
        wait_until(|| self.said.text().contains("connected;"));
        (status.expect("ended"), self.said.text())
    }
}

impl Drop for View {
    fn drop(&mut self) {
        let _dead = self.child.kill().and_then(|()| self.child.wait());
    }
}

/// An independent client, which prints what it receives as JSON lines; dropping it kills it.
struct Client {
    child: Child,
    lines: Receiver<String>,
    received: Vec<Value>,
}

impl Client {
    fn of(view: &View, folder: &Path, subprotocol: &str) -> Self {
        let mut command = Command::new("node");
        command.args(["client.mjs", &view.url, subprotocol]).current_dir(folder).stdout(Stdio::piped());
        let mut child = command.spawn().expect("node runs");
        let output = BufReader::new(child.stdout.take().expect("piped"));
        // Read without a break: a client that waits for its reader reads nothing itself.
        let (to, lines) = channel();
        thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|line| to.send(line)));
        Self { child, lines, received: Vec::new() }
    }

    /// Reads until a value fits.
    fn read_until(&mut self, fits: impl Fn(&Value) -> bool) -> Value {
        let until = clock::now() + MAX_WAIT;
        while let Ok(line) = self.lines.recv_timeout(MAX_WAIT) {
            let value: Value = serde_json::from_str(&line).expect("JSON");
            let is_it = fits(&value);
            self.received.push(value.clone());
            if is_it {
                return value;
            }
            assert!(clock::now() < until, "{:?}", self.summary());
        }
        panic!("the client ended, or receives nothing: {:?}", self.summary());
    }

    /// Reads until there was a message of every channel.
    fn read_all_channels(&mut self) {
        let missing: BTreeSet<&str> = TOPICS.into();
        let missing = std::cell::RefCell::new(missing);
        self.read_until(|value| {
            missing.borrow_mut().remove(value["topic"].as_str().unwrap_or_default());
            missing.borrow().is_empty()
        });
    }

    /// The messages of a channel so far.
    fn of_topic(&self, topic: &str) -> impl Iterator<Item = &Value> {
        self.received.iter().filter(move |value| value["topic"] == topic)
    }

    /// What it received besides messages and times, and the number of messages of each channel.
    fn summary(&self) -> (Vec<&Value>, BTreeMap<&str, usize>) {
        let others =
            self.received.iter().filter(|value| value["topic"].is_null() && value["time_ns"].is_null());
        let mut counts = BTreeMap::new();
        for topic in self.received.iter().filter_map(|value| value["topic"].as_str()) {
            *counts.entry(topic).or_default() += 1;
        }
        (others.collect(), counts)
    }

    /// Waits until it says that the connection was closed.
    fn await_close(mut self) {
        self.read_until(|value| !value["closed"].is_null());
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        let _dead = self.child.kill().and_then(|()| self.child.wait());
    }
}

/// The positions of the objects that a robot publishes, by time stamp.
struct Positions {
    scenes: FrameSubscriber<Scene>,
    by_stamp: BTreeMap<u64, Vec<(String, [f64; 3])>>,
}

impl Positions {
    fn of(robot: &Robot) -> (Node, Self) {
        let domain = Domain::at(robot.domain()).expect("a domain");
        let queues = Queues { frames: 64, overflow_policy: OverflowPolicy::DropOldest };
        let node = Node::join(&domain, "observer", 1, queues).expect("joins");
        let scenes = node.existing_subscriber::<Scene>(None).expect("a free reader").expect("is there");
        (node, Self { scenes, by_stamp: BTreeMap::new() })
    }

    fn take(&mut self) {
        while let Some(frame) = self.scenes.receive().expect("works") {
            let position = |object: &SceneObject| (object.name.as_str().to_owned(), object.position_m);
            let positions = frame.entries().iter().map(position).collect();
            self.by_stamp.insert(message::Head::header(frame.head()).valid_at_ns, positions);
        }
    }

    /// Checks that a transform of an object is the position that the robot published; `None` if that was not read.
    fn confirm(&self, link: &Value) -> Option<()> {
        let child = link["child"].as_str()?.strip_prefix("scene/")?;
        let objects = self.by_stamp.get(&link["at_ns"].as_u64()?)?;
        let (_, position_m) = objects.iter().find(|(name, _)| name == child)?;
        // JavaScript writes 0.0 as 0.
        let shown_m: Vec<f64> = link["position_m"].as_array()?.iter().filter_map(Value::as_f64).collect();
        assert_eq!((&link["parent"], shown_m.as_slice()), (&"world".into(), position_m.as_slice()), "{link}");
        Some(())
    }
}

#[test]
fn live_viewers_decode_every_channel_and_late_ones_miss_nothing() {
    let Some(folder) = npm::installed("tests/viewers/client") else { return };
    let robot = Robot::ready("viewers", &[("max_deaths", "1000")]);
    let (node, mut positions) = Positions::of(&robot);
    let view = View::of(&robot, &["--listen", "127.0.0.1:0"]);
    let mut early = Client::of(&view, &folder, "foxglove.websocket.v1");
    early.read_all_channels();
    let (others, _) = early.summary();
    assert_eq!(*others[0], json!({ "name": "Leo", "capabilities": ["time"] }));
    let described =
        |topic: &str| others.iter().find(|value| value["advertised"] == topic).expect("announced");
    assert_eq!(
        *described("/tf"),
        &json!({ "advertised": "/tf", "encoding": "cdr", "schemaName": "tf2_msgs/msg/TFMessage",
            "schemaEncoding": "ros2msg" })
    );

    // The values are those of the robot, with its time stamps.
    let mut confirmed = 0;
    while confirmed < 20 {
        let transforms = early.read_until(|value| value["topic"] == "/tf");
        positions.take();
        for link in transforms["value"].as_array().expect("a list") {
            confirmed += usize::from(positions.confirm(link).is_some());
        }
    }

    // The robot's description was sent once, before this client came.
    let mut late = Client::of(&view, &folder, "foxglove.sdk.v1");
    late.read_all_channels();
    let description = late.of_topic("/robot_description").next().expect("is received");
    assert_eq!(description["value"], config::Robot::load(None).expect("is built in").urdf.as_str());
    for (parent, child) in [("world", "base_link"), ("world", "scene/red")] {
        late.read_until(|value| {
            let links = value["value"].as_array().filter(|_| value["topic"] == "/tf");
            links.is_some_and(|links| {
                links.iter().any(|link| link["parent"] == parent && link["child"] == child)
            })
        });
    }
    assert_eq!(late.of_topic("/joint_states").next().expect("is received")["value"], 65);

    // A process that is restarted is followed.
    let killed = robot.processes().get("simulator").copied().expect("it runs");
    signal(killed, Signal::KILL);
    assert!(wait_until(|| robot.processes().get("simulator").is_some_and(|&pid| pid != killed)));
    let restarted_ns = clock::now().as_nanos();
    late.read_until(|value| value["topic"] == "/scene" && value["at_ns"].as_u64() > Some(restarted_ns));

    // The clock of the robot is sent, and does not go back.
    let times: Vec<u64> = late.received.iter().filter_map(|value| value["time_ns"].as_u64()).collect();
    assert!(times.len() > 2 && times.is_sorted(), "{times:?}");

    // Every viewer notices the end. One that is not behind learns the reason.
    let mut idle = connect(&view, None).expect("is accepted");
    signal(view.pid(), Signal::TERM);
    let farewell = loop {
        if let Message::Close(frame) = idle.read().expect("a farewell") {
            break frame.expect("a reason");
        }
    };
    assert_eq!((u16::from(farewell.code), farewell.reason.as_str()), (1001, "leo view ends"));
    let (status, said) = view.end();
    assert!(status.success(), "{said}");
    assert!(said.contains("3 viewers were connected; "), "{said}");
    for client in [early, late] {
        client.await_close();
    }
    drop((positions, node));
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{said}");
}

/// Connects a client of another library, as a web page of an origin.
fn connect(view: &View, origin: Option<&str>) -> Result<WebSocket<TcpStream>, String> {
    let stream = TcpStream::connect(view.url.trim_start_matches("ws://")).expect("listens");
    let mut request = view.url.as_str().into_client_request().expect("a request");
    let protocol = "foxglove.sdk.v1".parse().expect("a value");
    request.headers_mut().insert("sec-websocket-protocol", protocol);
    if let Some(origin) = origin {
        request.headers_mut().insert("origin", origin.parse().expect("a value"));
    }
    let (mut socket, _) = tungstenite::client(request, stream).map_err(|error| error.to_string())?;
    assert!(socket.read().expect("is sent").is_text());
    Ok(socket)
}

#[test]
fn a_web_page_of_a_foreign_origin_reads_nothing() {
    let robot = Robot::ready("foreign-page", &[]);
    let view = View::of(&robot, &["--listen", "127.0.0.1:0", "--origin", "https://viewer.example"]);
    for _again in 0..2 {
        let refusal = connect(&view, Some("https://evil.example")).err();
        assert!(refusal.as_ref().is_some_and(|error| error.contains("403")), "{refusal:?}");
    }
    for origin in ["https://viewer.example", "https://app.foxglove.dev"] {
        assert!(connect(&view, Some(origin)).is_ok(), "{origin}: {}", view.said.text());
    }
    let reported = || view.said.text().matches("\"https://evil.example\" was refused").count();
    assert!(wait_until(|| reported() == 1), "{}", view.said.text());
    signal(view.pid(), Signal::TERM);
    let (status, said) = view.end();
    assert!(status.success() && said.contains("2 viewers were connected; "), "{said}");
    robot.stop(Signal::TERM);
}

#[test]
fn a_viewer_that_reads_nothing_is_disconnected_and_its_losses_are_counted() {
    let robot = Robot::ready("slow-viewer", &[]);
    let view = View::of(&robot, &["--listen", "127.0.0.1:0"]);
    let before = view.descriptors();
    let mut slow = connect(&view, None).expect("is accepted");
    let channels = 1..=u32::try_from(TOPICS.len()).expect("few");
    let subscriptions: Vec<Value> = channels.map(|id| json!({ "id": id, "channelId": id })).collect();
    let request = json!({ "op": "subscribe", "subscriptions": subscriptions }).to_string();
    slow.send(Message::text(request)).expect("is read");
    // It does not read the messages that it asked for, so the network takes no more of them after a while.
    assert!(wait_until(|| view.descriptors() > before), "{}", view.said.text());
    assert!(wait_until(|| view.descriptors() == before), "it stays connected: {}", view.said.text());
    let (status, _) = robot.stop(Signal::TERM);
    assert!(status.success());
    // It ends with the robot.
    let (status, said) = view.end();
    assert!(status.success(), "{said}");
    assert!(said.contains("1 viewer was connected; "), "{said}");
    assert!(said.contains("dropped: a viewer was too slow"), "{said}");
}

/// A `leo view` that must end by itself.
fn refused(arguments: &[&str]) -> Output {
    leo(&["view"]).args(arguments).output().expect("runs")
}

#[test]
fn a_view_without_a_robot_or_at_a_used_address_is_refused() {
    let nowhere = domain("no-robot");
    let refusal = refused(&["--domain", nowhere.to_str().expect("a path of letters")]);
    let said = String::from_utf8_lossy(&refusal.stderr).into_owned();
    assert!(refusal.status.code() == Some(2) && said.contains("start one with `leo run`"), "{said}");

    let robot = Robot::ready("view-refused", &[]);
    let root = robot.domain().to_str().expect("a path of letters").to_owned();
    let taken = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = taken.local_addr().expect("an address").to_string();
    let refusal = refused(&["--domain", &root, "--listen", &address]);
    let said = String::from_utf8_lossy(&refusal.stderr).into_owned();
    assert_eq!(refusal.status.code(), Some(1), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains(&format!("{address} is in use: ")), "{said}");

    // On every address, it warns in one line.
    let view = View::of(&robot, &["--listen", "0.0.0.0:0"]);
    assert!(wait_until(|| view.said.text().contains("there is no access control")), "{}", view.said.text());
    assert_eq!(view.said.text().matches("WARN").count(), 1, "{}", view.said.text());
    signal(view.pid(), Signal::INT);
    let (status, said) = view.end();
    assert!(status.success() && said.contains("0 viewers were connected; "), "{said}");

    // What a killed robot leaves is removed by the next one, which another test may start at any moment.
    robot.stop(Signal::KILL);
    let refusal = refused(&["--domain", &root]);
    let said = String::from_utf8_lossy(&refusal.stderr).into_owned();
    assert!(!refusal.status.success() && said.contains("start one with `leo run`"), "{said}");
}
