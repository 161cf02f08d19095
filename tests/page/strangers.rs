use std::io::{Read as _, Write as _};
use std::net::TcpStream;

use serde_json::json;
use tungstenite::{Bytes, Message};

use crate::page::{Page, opened};
use crate::robot::Robot;

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

/// The first line that a request is answered with.
fn answer(host: &str, request: &str) -> String {
    let mut stream = TcpStream::connect(host).expect("it listens");
    stream.write_all(request.as_bytes()).expect("sent");
    let mut answer = String::new();
    let _cut = stream.take(200).read_to_string(&mut answer);
    answer.lines().next().unwrap_or("").to_owned()
}

#[test]
fn pages_of_elsewhere_are_refused() {
    let robot = Robot::start("origin");
    let host = &robot.host;
    assert!(opened(host, "http://evil.example").expect_err("refused").contains("403"));
    assert!(opened(host, "null").expect_err("refused").contains("403"));
    assert!(opened(host, &format!("http://{host}")).is_ok());
    let get = |named: &str, path: &str| {
        answer(host, &format!("GET {path} HTTP/1.1\r\nHost: {named}\r\nConnection: close\r\n\r\n"))
    };
    assert_eq!(get(host, "/"), "HTTP/1.1 200 OK");
    assert_eq!(get(host, "/leo.urdf"), "HTTP/1.1 200 OK");
    assert_eq!(get(host, "/metrics"), "HTTP/1.1 200 OK");
    assert_eq!(get("evil.example", "/"), "HTTP/1.1 403 Forbidden");
    assert_eq!(get("evil.example", "/metrics"), "HTTP/1.1 403 Forbidden");
    assert_eq!(get(host, "/../etc/passwd"), "HTTP/1.1 404 Not Found");
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
    // Somebody who talks without end is told so, and others are heard.
    for _ in 0..200 {
        page.send(Message::text(r#"{"do":"undo","id":5}"#));
    }
    while !page.complaint()["error"].as_str().is_some_and(|error| error.contains("more than 60 messages")) {}
    let mut other = Page::open(&robot.host);
    other.must("say", json!({ "text": "What did you learn?" }));

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
    }
    // Bytes that are no HTTP either.
    for _ in 0..20 {
        let mut stream = TcpStream::connect(&robot.host).expect("it listens");
        let bytes: Vec<u8> = (0..300).map(|_| dice.roll().to_le_bytes()[0]).collect();
        let _sent = stream.write_all(&bytes);
    }
    let before = other.cells["now"]["t"].as_f64().expect("time");
    other.wait("time going on", |cells| cells["now"]["t"].as_f64().is_some_and(|now| now > before + 1.0));
    assert_eq!(other.cells["process/console"]["restarts"], 0);
    other.wait("the complaints counted", |cells| {
        cells["process/console"]["refused"].as_u64().is_some_and(|refused| refused > 10)
    });
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
