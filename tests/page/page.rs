use std::collections::BTreeMap;
use std::net::TcpStream;

use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Message, WebSocket};

use crate::robot::{Host, MAX_WAIT};

/// A page without a browser: it holds the state entries and waits for answers.
pub(crate) struct Page {
    socket: WebSocket<TcpStream>,
    pub(crate) cells: BTreeMap<String, Value>,
    /// Received bytes and messages.
    pub(crate) bytes: usize,
    pub(crate) messages: usize,
    answers: Vec<Value>,
    last: u64,
}

/// Opens a connection as a page; returns the reason if it is refused.
pub(crate) fn opened(host: &Host, origin: &str) -> Result<WebSocket<TcpStream>, String> {
    let stream = TcpStream::connect(&**host).map_err(|error| error.to_string())?;
    stream.set_read_timeout(Some(MAX_WAIT)).expect("a time");
    let mut request =
        format!("ws://{host}/live?token={}", host.token).into_client_request().expect("an address");
    request.headers_mut().insert("origin", origin.parse().expect("an origin"));
    let (socket, _) = tungstenite::client(request, stream).map_err(|error| error.to_string())?;
    Ok(socket)
}

impl Page {
    pub(crate) fn open(host: &Host) -> Self {
        let socket = opened(host, &format!("http://{host}")).expect("it opens");
        Self { socket, cells: BTreeMap::new(), bytes: 0, messages: 0, answers: Vec::new(), last: 0 }
    }

    /// Sends a message, which may be malformed.
    pub(crate) fn send(&mut self, message: Message) {
        self.socket.send(message).expect("it can be sent");
    }

    /// Receives the next message.
    pub(crate) fn hear(&mut self) {
        let Message::Text(text) = self.socket.read().expect("a message within a minute") else { return };
        self.bytes += text.len();
        self.messages += 1;
        let message: Value = serde_json::from_str(&text).expect("JSON");
        let Some(cells) = message["cells"].as_object() else {
            self.answers.push(message);
            return;
        };
        if message["fresh"] == true {
            self.cells.clear();
        }
        for (key, value) in cells {
            if value.is_null() {
                self.cells.remove(key);
            } else {
                self.cells.insert(key.clone(), value.clone());
            }
        }
    }

    /// Receives messages until a condition holds.
    pub(crate) fn wait(&mut self, what: &str, mut holds: impl FnMut(&BTreeMap<String, Value>) -> bool) {
        let end = clock::now() + MAX_WAIT;
        while !holds(&self.cells) {
            assert!(clock::now() < end, "{what} does not come about: {:#?}", self.lines());
            self.hear();
        }
    }

    /// The error answer to a malformed message or one without an ID.
    pub(crate) fn complaint(&mut self) -> Value {
        loop {
            if let Some(place) = self.answers.iter().position(|answer| !answer["error"].is_null()) {
                return self.answers.remove(place);
            }
            self.hear();
        }
    }

    /// Sends a request and waits for its answer.
    pub(crate) fn ask(&mut self, what: &str, with: Value) -> Result<Value, String> {
        self.last += 1;
        let mut message = with;
        message["id"] = json!(self.last);
        message["do"] = json!(what);
        self.send(Message::text(message.to_string()));
        loop {
            if let Some(place) = self.answers.iter().position(|answer| answer["answer"] == self.last) {
                let answer = self.answers.remove(place);
                return answer["error"].as_str().map_or(Ok(answer.clone()), |error| Err(error.to_owned()));
            }
            self.hear();
        }
    }

    /// Sends a request that must succeed.
    pub(crate) fn must(&mut self, what: &str, with: Value) -> Value {
        self.ask(what, with).unwrap_or_else(|error| panic!("{what}: {error}"))
    }

    /// A thing of the workspace by its name.
    pub(crate) fn thing(&self, name: &str) -> Option<&Value> {
        find(&self.cells, name)
    }

    /// Takes a thing, carries it over a position and drops it; returns once it rests.
    pub(crate) fn bring(&mut self, thing: &str, at: [f64; 2]) {
        let from = self.thing(thing).expect("it is there")["p"].clone();
        self.must("take", json!({ "thing": thing }));
        let from = [0, 1].map(|axis| from[axis].as_f64().expect("a place"));
        for step in 1..=10 {
            let share = f64::from(step) / 10.0;
            let [x, y] = [0, 1].map(|axis| from[axis] + (at[axis] - from[axis]) * share);
            self.must("carry", json!({ "at": [x, y, 0.2] }));
        }
        self.must("put", json!({ "at": [at[0], at[1], 0.2] }));
        self.wait("rest", |cells| find(cells, thing).is_some_and(|thing| thing["held"].is_null()));
    }

    /// The conversation and action lines.
    pub(crate) fn lines(&self) -> Vec<String> {
        let lines = self.cells.iter().filter(|(key, _)| key.starts_with("line/"));
        lines.map(|(key, line)| format!("{key} {} {} {}", line["who"], line["kind"], line["text"])).collect()
    }
}

/// A thing of the workspace by its name.
pub(crate) fn find<'a>(cells: &'a BTreeMap<String, Value>, name: &str) -> Option<&'a Value> {
    cells
        .iter()
        .find(|(key, thing)| key.starts_with("thing/") && thing["name"] == name)
        .map(|(_, thing)| thing)
}
