use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpStream;

use serde_json::json;
use tungstenite::{Bytes, Message};

use crate::page::{Page, opened};
use crate::robot::Robot;

/// All that a page can wish for.
const WISHES: [&str; 19] = [
    "say", "take", "carry", "put", "cancel", "seat", "leave", "return", "screen", "add", "remove", "clear",
    "lay", "open", "play", "undo", "save", "record", "keep",
];

/// A small generator of numbers (xorshift), the same in every run.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }
}

/// The lines that a request is answered with, up to its content.
fn answer(host: &str, request: &str) -> Vec<String> {
    let mut stream = TcpStream::connect(host).expect("it listens");
    stream.write_all(request.as_bytes()).expect("sent");
    let lines = BufReader::new(stream).lines();
    lines.map_while(Result::ok).take_while(|line| !line.is_empty()).collect()
}

#[test]
fn pages_of_elsewhere_are_refused() {
    let robot = Robot::start("origin");
    let host = &robot.host;
    assert!(opened(host, "http://evil.example").expect_err("refused").contains("403"));
    assert!(opened(host, "null").expect_err("refused").contains("403"));
    assert!(opened(host, &format!("http://{host}")).is_ok());
    let get = |named: &str, path: &str| {
        let asked = format!("GET {path} HTTP/1.1\r\nHost: {named}\r\nConnection: close\r\n\r\n");
        answer(host, &asked).swap_remove(0)
    };
    assert_eq!(get(host, "/"), "HTTP/1.1 200 OK");
    assert_eq!(get(host, "/leo.urdf"), "HTTP/1.1 200 OK");
    assert_eq!(get(host, "/metrics"), "HTTP/1.1 200 OK");
    assert_eq!(get("evil.example", "/"), "HTTP/1.1 403 Forbidden");
    assert_eq!(get("evil.example", "/metrics"), "HTTP/1.1 403 Forbidden");
    assert_eq!(get(host, "/../etc/passwd"), "HTTP/1.1 404 Not Found");
}

#[test]
fn a_browser_is_told_to_reach_this_robot_alone() {
    let robot = Robot::start("policy");
    let host = &robot.host;
    for path in ["/", "/page.js", "/page.css"] {
        let asked = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
        let lines = answer(host, &asked);
        let header = |name: &str| {
            let mut said = lines.iter().filter_map(|line| line.strip_prefix(name)?.strip_prefix(": "));
            said.next().unwrap_or_else(|| panic!("{path} says no {name}: {lines:?}")).to_owned()
        };
        let policy = header("content-security-policy");
        let mut rules: Vec<&str> = policy.split("; ").collect();
        rules.sort_unstable();
        let reached = format!("connect-src 'self' ws://{host} wss://{host}");
        assert_eq!(
            rules,
            [
                "base-uri 'none'",
                &reached,
                "default-src 'self'",
                "form-action 'none'",
                "frame-ancestors 'none'",
                "img-src 'self' data: blob:",
                "object-src 'none'",
                "script-src 'self'",
                "style-src 'self'",
            ]
        );
        assert_eq!(header("x-content-type-options"), "nosniff");
        assert_eq!(header("referrer-policy"), "no-referrer");
    }
}

#[test]
fn whatever_a_page_says_is_answered_and_the_robot_goes_on() {
    let robot = Robot::start("garbage");
    let mut page = Page::open(&robot.host);
    page.wait("a robot at work", |cells| cells.values().any(|cell| cell["kind"] == "object"));
    for (message, said) in [
        ("", "EOF"),
        ("[]", "missing field `do`"),
        (r#"{"do":"fly","id":1}"#, "unknown variant `fly`"),
        (r#"{"do":"carry","id":1,"at":[0,0,1e999]}"#, "number out of range"),
        (r#"{"do":"put","id":1,"at":[0,0,0]}"#, "the hand is empty"),
        (r#"{"do":"seat","id":1,"eyes":[1e300,0,0],"looks_at":[0,0,0]}"#, "from -100 to 100 m"),
        (r#"{"do":"open","id":1,"lesson":"../../../../etc/passwd"}"#, "passwd.toml"),
    ] {
        page.send(Message::text(message));
        let complaint = page.complaint();
        assert!(
            complaint["error"].as_str().is_some_and(|error| error.contains(said)),
            "{message}: {complaint}"
        );
    }
    // What is malformed, but not what the robot refuses to do.
    let mut malformed = 4;
    await_refused(&mut page, malformed);
    // JSON that is well-formed, and yet no wish.
    for wish in WISHES {
        for message in [
            format!(r#"{{"do":"{wish}","id":7,"at":{{"x":[0,"there",null]}},"thing":12,"colour":false}}"#),
            format!(r#"{{"do":"{wish}","id":7,"{wish}":{{}},"id":7}}"#),
        ] {
            page.send(Message::text(message.as_str()));
            let complaint = page.complaint();
            assert!(complaint["error"].is_string(), "{message}: {complaint}");
            malformed += 1;
        }
    }
    await_refused(&mut page, malformed);
    drop(page);

    // Bytes of all kinds, in messages of all kinds, too large ones among them; each from a page of its own,
    // for it may be shut for it.
    let mut dice = Dice(2006);
    for _ in 0..60 {
        let length = usize::try_from(dice.roll() % 6000).expect("small");
        let bytes: Vec<u8> = (0..length).map(|_| dice.roll().to_le_bytes()[0]).collect();
        let mut socket = opened(&robot.host, &format!("http://{}", robot.host)).expect("it opens");
        let message = if dice.roll().is_multiple_of(2) {
            Message::binary(bytes)
        } else {
            Message::text(String::from_utf8_lossy(&bytes).into_owned())
        };
        // The robot may have shut the door before all of it was in.
        let _sent = socket.send(message);
        let _sent = socket.send(Message::Ping(Bytes::from_static(b"?")));
        // Who leaves before he was heard has said nothing.
        while let Ok(said) = socket.read() {
            if said.is_close() || said.to_text().is_ok_and(|text| text.starts_with("{\"answer\"")) {
                break;
            }
        }
        malformed += 1;
    }
    // Bytes that are no HTTP either.
    for _ in 0..20 {
        let mut stream = TcpStream::connect(&robot.host).expect("it listens");
        let bytes: Vec<u8> = (0..300).map(|_| dice.roll().to_le_bytes()[0]).collect();
        let _sent = stream.write_all(&bytes);
    }
    let mut other = Page::open(&robot.host);
    await_refused(&mut other, malformed);

    // Somebody who talks without end is told so, and others are heard.
    let mut loud = Page::open(&robot.host);
    for _ in 0..200 {
        loud.send(Message::text(r#"{"do":"undo","id":5}"#));
    }
    while !loud.complaint()["error"].as_str().is_some_and(|error| error.contains("more than 60 messages")) {}
    other.must("say", json!({ "text": "What did you learn?" }));
    let before = other.cells["now"]["t"].as_f64().expect("time");
    other.wait("time going on", |cells| cells["now"]["t"].as_f64().is_some_and(|now| now > before + 1.0));
    assert_eq!(other.cells["process/console"]["restarts"], 0);
}

/// Waits until so much is counted as refused, and no more.
fn await_refused(page: &mut Page, count: u64) {
    let mut counted = None;
    page.wait("what is malformed being counted", |cells| {
        counted = cells.get("process/console").and_then(|row| row["refused"].as_u64());
        counted >= Some(count)
    });
    assert_eq!(counted, Some(count));
}

#[test]
fn more_pages_than_there_may_be_are_turned_away_and_the_others_are_served() {
    let robot = Robot::start("many");
    let origin = format!("http://{}", robot.host);
    let mut pages: Vec<_> = (0..32).map(|_| Page::open(&robot.host)).collect();
    for page in &mut pages {
        page.wait("the robot", |cells| cells.contains_key("robot"));
    }
    assert!(opened(&robot.host, &origin).expect_err("refused").contains("503"));
    let end = clock::now() + crate::robot::PATIENCE;
    drop(pages);
    // The doors shut behind those who left.
    while opened(&robot.host, &origin).is_err() {
        assert!(clock::now() < end, "nobody is let in again");
    }
}
