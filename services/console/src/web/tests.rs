use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};

use clock::Duration;
use message::{TeacherAct, TeacherActKind};
use serde_json::Value;
use tungstenite::client::IntoClientRequest as _;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::{Message, WebSocket};

use super::*;

/// Patience of these tests with a loaded machine.
const LONG: Duration = Duration::from_secs(60);
/// Nobody is asked whether he is there, and everybody is waited for: far longer than a test waits, or one
/// patience could end what a test says that another one ends.
const ENDLESS: Patience = Patience { beat: HOUR, send: HOUR, question: HOUR, connection: HOUR };
const HOUR: Duration = Duration::from_secs(3600);

fn served(patience: Patience) -> Web {
    let anywhere = SocketAddr::from(([127, 0, 0, 1], 0));
    Web::serve(anywhere, Door::default(), "<robot/>", 1, patience).unwrap()
}

fn host(web: &Web) -> String {
    web.url.trim_start_matches("http://").trim_end_matches('/').to_owned()
}

fn opened(web: &Web) -> WebSocket<TcpStream> {
    let host = host(web);
    let stream = TcpStream::connect(&host).unwrap();
    stream.set_read_timeout(Some(LONG)).unwrap();
    tungstenite::client(format!("ws://{host}/live").into_client_request().unwrap(), stream).unwrap().0
}

/// The next text that a page hears.
fn heard(page: &mut WebSocket<TcpStream>) -> Value {
    loop {
        if let Message::Text(text) = page.read().unwrap() {
            return serde_json::from_str(&text).unwrap();
        }
    }
}

/// What a page is told as it is shut.
fn farewell(page: &mut WebSocket<TcpStream>) -> (CloseCode, String) {
    loop {
        if let Message::Close(close) = page.read().unwrap() {
            let close = close.unwrap();
            return (close.code, close.reason.to_string());
        }
    }
}

/// The page that has let go of what it held.
fn let_go(web: &Web) -> u16 {
    let asked = web.wishes.recv_timeout(LONG).expect("somebody lets go");
    let Wish::Act(act) = asked.wish else { panic!("an act") };
    assert_eq!((act.kind(), asked.id), (Some(TeacherActKind::Cancel), None));
    asked.page
}

/// Returns once so many pages are open.
fn await_open(web: &Web, count: u64) {
    let end = clock::now() + LONG;
    while web.open() != count {
        assert!(clock::now() < end, "{} pages are open", web.open());
    }
}

/// What is answered on a connection until it is shut.
fn answered(mut stream: TcpStream) -> String {
    let mut said = Vec::new();
    stream.set_read_timeout(Some(LONG)).unwrap();
    match stream.read_to_end(&mut said) {
        // Whoever has not said all that he began to say is shut with a reset.
        Err(error) if error.kind() == io::ErrorKind::ConnectionReset => {}
        read => drop(read.expect("it is shut")),
    }
    String::from_utf8_lossy(&said).into_owned()
}

#[test]
fn where_it_is_served_at_every_address_one_that_can_be_opened_is_said() {
    for (every, said) in [("0.0.0.0:0", "http://127.0.0.1:"), ("[::]:0", "http://[::1]:")] {
        let served = Web::serve(every.parse().unwrap(), Door::default(), "<robot/>", 1, ENDLESS);
        // Not every machine speaks both.
        let Ok(web) = served else { continue };
        assert!(web.everywhere && web.url.starts_with(said) && web.url.contains("/?token="), "{}", web.url);
        let host = web.url.trim_start_matches("http://").split('/').next().unwrap();
        TcpStream::connect(host).unwrap();
    }
    assert!(!served(ENDLESS).everywhere);
}

#[test]
fn where_others_can_reach_it_nothing_is_served_without_the_token_and_each_refusal_is_counted() {
    let web = Web::serve("0.0.0.0:0".parse().unwrap(), Door::default(), "<robot/>", 1, ENDLESS).unwrap();
    let (host, query) = web.url.trim_start_matches("http://").split_once('/').unwrap();
    let token = query.strip_prefix("?token=").expect("there is one");
    let upgrade = "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let asked = |path: &str, query: &str| {
        let (connection, more) = if path == "/live" { ("Upgrade", upgrade) } else { ("close", "") };
        let mut stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(LONG)).unwrap();
        write!(
            stream,
            "GET {path}{query} HTTP/1.1\r\nHost: {host}\r\nConnection: {connection}\r\n{more}\r\n"
        )
        .unwrap();
        let mut answer = [0; 12];
        stream.read_exact(&mut answer).unwrap();
        String::from_utf8_lossy(&answer).into_owned()
    };
    let mut refused = 0;
    for path in ["/", "/live", "/metrics", "/leo.urdf"] {
        let wrong = [
            "?token=".to_owned(),
            format!("?token={}", &token[1..]),
            format!("?token={token}0"),
            format!("?token={}", token.chars().rev().collect::<String>()),
            format!("?other={token}"),
        ];
        for query in std::iter::once(String::new()).chain(wrong) {
            assert_eq!(asked(path, &query), "HTTP/1.1 403", "{path}{query}");
            refused += 1;
            assert_eq!(web.refused(), refused, "{path}{query}");
        }
        let said = if path == "/live" { "HTTP/1.1 101" } else { "HTTP/1.1 200" };
        assert_eq!(asked(path, &format!("?token={token}")), said, "{path}");
        assert_eq!(web.refused(), refused, "{path}");
    }
    assert!(refused > 0);
}

#[test]
fn who_does_not_say_what_he_wants_is_shut_and_keeps_nobody_out() {
    let web = served(Patience { question: Duration::from_millis(200), ..ENDLESS });
    let silent: Vec<_> = (0..200)
        .map(|number| {
            let mut stream = TcpStream::connect(host(&web)).unwrap();
            if number % 2 == 0 {
                stream.write_all(b"GET /leo.urdf HTTP/1.1\r\nHo").unwrap();
            }
            stream
        })
        .collect();
    let mut asks = TcpStream::connect(host(&web)).unwrap();
    write!(asks, "GET /leo.urdf HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", host(&web)).unwrap();
    assert!(answered(asks).ends_with("<robot/>"));
    for stream in silent {
        let said = answered(stream);
        assert!(!said.contains("<robot/>"), "{said}");
    }
}

#[test]
fn a_connection_ends_after_a_while_whatever_it_asks_and_a_page_of_its_own_does_not() {
    let web = served(Patience { connection: Duration::from_millis(300), ..ENDLESS });
    let mut page = opened(&web);
    let mut asks = TcpStream::connect(host(&web)).unwrap();
    write!(asks, "GET /leo.urdf HTTP/1.1\r\nHost: {}\r\n\r\n", host(&web)).unwrap();
    let said = answered(asks);
    assert!(said.ends_with("<robot/>") && said.starts_with("HTTP/1.1 200"), "{said}");
    // The page was there before.
    page.send(Message::text("no message")).unwrap();
    while heard(&mut page).get("error").is_none() {}
    assert_eq!(web.open(), 1);
}

#[test]
fn a_page_that_answers_no_beat_is_shut_and_lets_go_and_one_that_does_stays() {
    let web = served(Patience { beat: Duration::from_millis(200), ..ENDLESS });
    // A machine that has lost its network says nothing any more, and does not shut its end.
    let silent = opened(&web);
    let mut there = opened(&web);
    let end = clock::now() + LONG;
    while web.wishes.is_empty() {
        assert!(clock::now() < end, "the silent page holds on");
        heard(&mut there);
    }
    assert_eq!(let_go(&web), 1);
    there.send(Message::text(r#"{"do":"undo","id":5}"#)).unwrap();
    let asked = web.wishes.recv_timeout(LONG).unwrap();
    assert_eq!((asked.page, asked.id), (2, Some(5)));
    await_open(&web, 1);
    drop(silent);
}

#[test]
fn a_page_that_does_not_read_is_shut_and_lets_go() {
    let web = served(Patience { send: Duration::from_millis(100), ..ENDLESS });
    // More than the system takes in on the way.
    web.shared.sheet().put("large", &"a".repeat(32 << 20));
    let page = opened(&web);
    let_go(&web);
    await_open(&web, 0);
    drop(page);
}

#[test]
fn a_page_hears_that_leo_is_there_where_nothing_changes() {
    let web = served(Patience { beat: Duration::from_millis(50), ..ENDLESS });
    web.shared.sheet().put("cell", &1);
    let mut page = opened(&web);
    let cells = heard(&mut page);
    assert_eq!(cells["fresh"], true);
    for _ in 0..3 {
        let said = heard(&mut page);
        assert_eq!((&said["version"], &said["fresh"]), (&cells["version"], &Value::Bool(false)));
        assert_eq!(said["cells"].as_object().unwrap().len(), 0);
    }
}

#[test]
fn what_a_page_holds_is_let_go_however_much_the_loop_has_to_do() {
    let web = served(ENDLESS);
    let mut page = opened(&web);
    assert_eq!(heard(&mut page)["fresh"], true);
    let (answer, _unread) = tokio::sync::mpsc::channel(1);
    let wish = || {
        let undo = TeacherAct::new(TeacherActKind::Undo, 1);
        Asked { page: 9, id: Some(1), wish: Wish::Act(Box::new(undo)), answer: answer.clone() }
    };
    while web.shared.ask(wish()) {}
    drop(page);
    // It has gone while the loop was busy.
    await_open(&web, 0);
    for _ in 0..WISHES {
        assert_eq!(web.wishes.recv_timeout(LONG).unwrap().page, 9);
    }
    assert_eq!(let_go(&web), 1);
}

#[test]
fn no_more_pages_are_let_in_than_there_may_be_however_many_come_at_once() {
    let web = served(ENDLESS);
    let host = host(&web);
    let request = format!(
        "GET /live HTTP/1.1\r\nHost: {host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    );
    let mut pages: Vec<TcpStream> = (0..80).map(|_| TcpStream::connect(&host).unwrap()).collect();
    for page in &mut pages {
        page.write_all(request.as_bytes()).unwrap();
    }
    let mut answers = [0; 2];
    for page in &mut pages {
        page.set_read_timeout(Some(LONG)).unwrap();
        let mut answer = [0; 12];
        page.read_exact(&mut answer).unwrap();
        match &answer {
            b"HTTP/1.1 101" => answers[0] += 1,
            b"HTTP/1.1 503" => answers[1] += 1,
            other => panic!("{}", String::from_utf8_lossy(other)),
        }
    }
    assert_eq!(answers, [32, 48]);
    drop(pages);
    await_open(&web, 0);
}

#[test]
fn a_message_that_is_too_long_is_counted_and_its_page_told_why_it_is_shut() {
    let web = served(ENDLESS);
    let mut page = opened(&web);
    page.send(Message::text("a".repeat(4096))).unwrap();
    let answer =
        std::iter::repeat_with(|| heard(&mut page)).find(|said| said.get("answer").is_some()).unwrap();
    assert!(answer["error"].is_string(), "{answer}");
    assert_eq!(web.refused(), 1);
    page.send(Message::text("a".repeat(4097))).unwrap();
    assert_eq!(farewell(&mut page), (CloseCode::Size, "a message has at most 4096 bytes".to_owned()));
    assert_eq!(web.refused(), 2);
    let_go(&web);
}

#[test]
fn what_is_no_message_is_counted_and_its_page_told_so() {
    let web = served(ENDLESS);
    let mut page = opened(&web);
    // A text frame that is none: masked with nothing, and no UTF-8.
    page.get_mut().write_all(&[0x81, 0x81, 0, 0, 0, 0, 0xff]).unwrap();
    assert_eq!(farewell(&mut page).0, CloseCode::Invalid);
    assert_eq!(web.refused(), 1);
    let mut page = opened(&web);
    // An operation that there is not.
    page.get_mut().write_all(&[0x83, 0x80, 0, 0, 0, 0]).unwrap();
    assert_eq!(farewell(&mut page).0, CloseCode::Protocol);
    assert_eq!(web.refused(), 2);
}

#[test]
fn whatever_a_page_says_counts_and_a_flood_shuts_it() {
    for message in [
        Message::text(r#"{"do":"undo","id":5}"#),
        Message::binary(vec![0; 8]),
        Message::Ping(tungstenite::Bytes::new()),
        Message::Pong(tungstenite::Bytes::new()),
    ] {
        let web = served(ENDLESS);
        let mut page = opened(&web);
        let said = (0..200_000).take_while(|_| page.send(message.clone()).is_ok()).count();
        assert!(said >= 600, "shut after {said}");
        let end = clock::now() + LONG;
        while web.wishes.try_iter().all(|asked| asked.id.is_some()) {
            assert!(clock::now() < end, "{message:?} is taken without end");
        }
        assert!(web.refused() > 0);
        await_open(&web, 0);
    }
}

#[test]
fn a_message_too_many_is_answered_by_its_number_and_not_heard() {
    let web = served(ENDLESS);
    let mut page = opened(&web);
    for id in 0..300 {
        page.send(Message::text(format!(r#"{{"do":"undo","id":{id}}}"#))).unwrap();
    }
    let mut answers = std::iter::repeat_with(|| heard(&mut page)).filter(|said| said.get("answer").is_some());
    let refused = answers.next().unwrap();
    assert!(refused["error"].as_str().unwrap().contains("more than 60 messages"), "{refused}");
    // The robot has no say in it: what is taken waits for its loop.
    assert!(refused["answer"].as_u64().unwrap() >= 60, "{refused}");
    assert!(web.wishes.try_iter().all(|asked| asked.id != refused["answer"].as_u64()));
}
