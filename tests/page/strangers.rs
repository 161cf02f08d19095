use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpStream;

use serde_json::{Value, json};
use tungstenite::{Bytes, Message, WebSocket};

use crate::dice::{Dice, WISHES, frame};
use crate::page::{Page, opened};
use crate::robot::{Host, MAX_WAIT, Robot};

/// Opens a page as soon as earlier ones are closed.
fn let_in(host: &Host) -> WebSocket<TcpStream> {
    let end = clock::now() + MAX_WAIT;
    loop {
        match opened(host, &format!("http://{host}")) {
            Ok(socket) => return socket,
            Err(error) => assert!(clock::now() < end, "{error}"),
        }
    }
}

/// Checks that no process was restarted and that pages are still served.
fn goes_on(host: &Host) {
    drop(let_in(host));
    let mut page = Page::open(host);
    page.wait("the robot's processes", |cells| {
        cells.contains_key("now") && cells.contains_key("process/console")
    });
    let before = page.cells["now"]["t"].as_f64().expect("time");
    page.wait("time going on", |cells| cells["now"]["t"].as_f64().is_some_and(|now| now > before + 1.0));
    page.must("clear", json!({}));
    let rows = page.cells.iter().filter(|(key, _)| key.starts_with("process/"));
    let restarts: BTreeMap<_, _> = rows.map(|(key, row)| (key, &row["restarts"])).collect();
    assert!(restarts.len() > 3 && restarts.values().all(|restarts| **restarts == 0), "{restarts:?}");
}

/// The header lines of the answer to a request.
fn answer(host: &str, request: &str) -> Vec<String> {
    let mut stream = TcpStream::connect(host).expect("it listens");
    stream.write_all(request.as_bytes()).expect("sent");
    let lines = BufReader::new(stream).lines();
    lines.map_while(Result::ok).take_while(|line| !line.is_empty()).collect()
}

#[test]
fn pages_of_other_origins_are_refused() {
    let robot = Robot::start("origin");
    let host = &robot.host;
    assert!(opened(host, "http://evil.example").expect_err("refused").contains("403"));
    assert!(opened(host, "null").expect_err("refused").contains("403"));
    assert!(opened(host, &format!("http://{host}")).is_ok());
    let get = |named: &str, path: &str| {
        let known = format!("Authorization: Bearer {}\r\n", if named == &**host { &host.token } else { "" });
        let asked = format!("GET {path} HTTP/1.1\r\nHost: {named}\r\nConnection: close\r\n{known}\r\n");
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
        let known = format!("Authorization: Bearer {}", host.token);
        let asked = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{known}\r\n\r\n");
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
                "form-action 'self'",
                "frame-ancestors 'none'",
                "img-src 'self' data: blob:",
                "object-src 'none'",
                "script-src 'self'",
                "style-src 'self'",
            ]
        );
        assert_eq!(header("x-content-type-options"), "nosniff");
        assert_eq!(header("referrer-policy"), "same-origin");
    }
}

#[test]
fn every_page_message_is_answered_and_the_robot_continues() {
    let robot = Robot::start("garbage");
    let mut page = Page::open(&robot.host);
    page.wait("a robot at work", |cells| cells.values().any(|cell| cell["kind"] == "object"));
    for (message, said) in [
        ("", "ends where a value should be"),
        ("[]", "missing field `do`"),
        (r#"{"do":"fly","id":1}"#, "unknown value `fly`"),
        (r#"{"do":"carry","id":1,"at":[0,0,1e999]}"#, "the number is too large"),
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
    // Counts malformed messages, but not requests that the robot refuses.
    let mut malformed = 4;
    await_refused(&mut page, malformed);
    // Well-formed JSON, but no valid request.
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

    // Random bytes in all kinds of messages, some too large. Each uses its own page, which may be closed.
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
        // The robot may close the connection before all is sent.
        let _sent = socket.send(message);
        let _sent = socket.send(Message::Ping(Bytes::from_static(b"?")));
        // Wait for the answer or the end: bytes of a page that closes earlier may not be processed.
        while let Ok(said) = socket.read() {
            if said.is_close() || said.to_text().is_ok_and(|text| text.starts_with("{\"answer\"")) {
                break;
            }
        }
        malformed += 1;
    }
    // Bytes that are not even HTTP.
    for _ in 0..20 {
        let mut stream = TcpStream::connect(&*robot.host).expect("it listens");
        let bytes: Vec<u8> = (0..300).map(|_| dice.roll().to_le_bytes()[0]).collect();
        let _sent = stream.write_all(&bytes);
    }
    let mut other = Page::open(&robot.host);
    await_refused(&mut other, malformed);

    // A flooding page gets an error, and others are still served.
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

#[test]
fn every_random_request_is_answered_and_the_robot_continues() {
    let robot = Robot::start("wishes");
    let mut page = Page::open(&robot.host);
    page.wait("a robot at work", |cells| cells.values().any(|cell| cell["kind"] == "object"));
    let mut dice = Dice(2006);
    let mut answers: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    for _ in 0..400 {
        let wish = WISHES[dice.below(WISHES.len())];
        let fields = dice.fields(wish);
        let [done, refused] = answers.entry(wish).or_default();
        match page.ask(wish, fields) {
            Ok(_) => *done += 1,
            Err(_) => *refused += 1,
        }
    }
    assert_eq!(answers.len(), WISHES.len(), "{answers:?}");
    // Most requests succeeded once and failed once.
    for which in [0, 1] {
        assert!(answers.values().filter(|counts| counts[which] > 0).count() > 10, "{answers:?}");
    }
    goes_on(&robot.host);
}

#[test]
fn random_bytes_after_the_upgrade_are_answered_or_close_the_connection() {
    const LAST: u64 = 2006;
    // Longer than any accepted length, so that a preceding partial frame ends within two of these.
    let padding = "a".repeat(4000);
    let last = frame(&format!(r#"{{"do":"undo","id":{LAST},"more":"{padding}"}}"#), [0; 4]);
    let robot = Robot::start("frames");
    let mut dice = Dice(2006);
    let [mut answered, mut shut] = [0, 0];
    for _ in 0..300 {
        let wish = WISHES[dice.below(WISHES.len())];
        let mut said = dice.fields(wish);
        (said["do"], said["id"]) = (json!(wish), json!(1));
        let mask = [(); 4].map(|()| dice.byte());
        let mut bytes = frame(&said.to_string(), mask);
        dice.mutate(&mut bytes);
        let mut socket = let_in(&robot.host);
        // The robot may close the connection before all is sent.
        let _sent = socket.get_mut().write_all(&bytes);
        loop {
            let _sent = socket.get_mut().write_all(&last);
            let Ok(said) = socket.read() else {
                shut += 1;
                break;
            };
            let said = said.to_text().ok().and_then(|text| serde_json::from_str::<Value>(text).ok());
            if said.is_some_and(|said| said["answer"] == LAST) {
                answered += 1;
                break;
            }
        }
    }
    assert!(answered > 50 && shut > 50, "{answered} were answered, {shut} shut the door");
    goes_on(&robot.host);
}

/// Waits until exactly `count` messages were counted as refused.
fn await_refused(page: &mut Page, count: u64) {
    let mut counted = None;
    page.wait("what is malformed being counted", |cells| {
        counted = cells.get("process/console").and_then(|row| row["refused"].as_u64());
        counted >= Some(count)
    });
    assert_eq!(counted, Some(count));
}

#[test]
fn pages_beyond_the_limit_are_refused_and_others_served() {
    let robot = Robot::start("many");
    let origin = format!("http://{}", robot.host);
    let mut pages: Vec<_> = (0..32).map(|_| Page::open(&robot.host)).collect();
    for page in &mut pages {
        page.wait("the robot", |cells| cells.contains_key("robot"));
    }
    assert!(opened(&robot.host, &origin).expect_err("refused").contains("503"));
    let end = clock::now() + MAX_WAIT;
    drop(pages);
    // Closed pages free their slots.
    while opened(&robot.host, &origin).is_err() {
        assert!(clock::now() < end, "nobody is let in again");
    }
}
